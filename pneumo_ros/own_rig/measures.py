# SPDX-License-Identifier: Apache-2.0
"""Scales of a rig's slots, from its logs: what its rates and travels are, and what would be an evident size there.

The nominal model is run in short windows, each from the log's own state, so that it stays near the data even where a
free run would not. A size is evident that moves the outputs of such a window by four tenths of what the log moves, or
the slot's own travel by four tenths of what that moves: between parts that are tied to one another no force moves far
what is measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.own_rig.kernel import FLOW, FORCE, SCALES, VALUES
from pneumo_ros.own_rig.physics import Physics
from pneumo_ros.own_rig.records import OwnRecord
from pneumo_ros.slots import flow as fl
from pneumo_ros.slots import force as fo
from pneumo_ros.slots import signal as si
from pneumo_ros.slots.kinds import Flow, Force, Slot
from pneumo_ros.slots.laws import Measures

EVIDENT = 0.4  # of the standard deviation of a channel, or of the slot's travel
WINDOWS = 12  # in a record, at most
LARGE = 5.0  # evident sizes that friction may have before its turnover is widened
SEARCHES = 12  # steps in the search of a size
FINEST, MOST_STEPS = 0.7, 40  # rad in a sub-step; sub-steps in a period
FOR_FRICTION = 2  # sub-steps that friction alone is given: beyond them its turnover is widened
NARROW = 0.04  # of the usual rate: what friction may turn over within
ADIABATIC = 1.4  # ratio of specific heats of air and other gases of two atoms: the largest of the usual ones


@dataclass(frozen=True)
class Window:
    """A piece of a record with the state that it starts from."""

    record: OwnRecord
    state: Array


@dataclass(frozen=True)
class Scaling:
    """All that the data say of the slots.

    Attributes
    ----------
    measures : by place
    inside : (K, SCALES) of those in the equations
    signals : place -> (S,) of signals
    mobility : (K,) change of a slot's rate in a second for a unit of its force
    substeps : of a row
    """

    measures: dict[str, Measures]
    inside: Array
    signals: dict[str, Array]
    mobility: Array
    substeps: int


class Scaler:
    """Runs windows of the nominal model to find scales."""

    def __init__(self, physics: Physics, windows: Sequence[Window], nominal: Array, held: Mask) -> None:
        self.physics, self.windows, self.nominal, self.held = physics, windows, nominal, held
        self.terms = np.array([FLOW if isinstance(s, Flow) else FORCE for s in physics.inside], dtype=np.int64)
        self.period = windows[0].record.period
        self.substeps = self._fine_enough()
        self.spread = np.sqrt(np.mean([w.record.scale**2 for w in windows], axis=0))

    def scaling(self) -> Scaling:
        """Scales of every slot."""
        where = self._coordinates()
        slow = self._slowest()
        whole = max(len(w.record.measured) for w in self.windows) * self.period * len(self.windows)
        inside = np.ones((len(self.physics.inside), SCALES))
        mobility = np.array([self._mobility(k) for k in range(len(self.physics.inside))])
        measures: dict[str, Measures] = {}
        for k, slot in enumerate(self.physics.inside):
            seen = where[:, k]
            if isinstance(slot, Flow):
                inside[k, : fl.SCALES] = fl.scales_of(seen[:, 0], seen[:, 2], slot.gas, slow, whole)
            else:
                inside[k, : fo.SCALES] = fo.scales_of(seen[:, 0], seen[:, 1], seen[:, 2], slow)
        for k, slot in enumerate(self.physics.inside):
            measures[slot.place] = self._measured(slot, k, where[:, k], inside, slow, whole)
        signals = {}
        for slot in self.physics.slots:
            if slot.kind in ("input", "sensor"):
                values, unit = self._signal(slot)
                S = si.scales_of(values, slow)
                signals[slot.place] = S
                swing, peak = float(S[si.S_SWING]), float(S[si.S_PEAK])
                measures[slot.place] = Measures(swing, swing / slow, swing, 0.0, peak, peak, slow, whole, unit, unit)
        rubbed = [
            self._steps(measures[s.place], mobility[k])
            for k, s in enumerate(self.physics.inside)
            if isinstance(s, Force)
        ]
        steps = max(self.substeps, min(max(rubbed, default=1), FOR_FRICTION))
        return Scaling(measures, inside, signals, mobility, steps)

    def _steps(self, m: Measures, mobility: float) -> int:
        """Sub-steps in which evident friction turns over within a narrow band."""
        return int(np.ceil(LARGE * m.size * abs(mobility) * self.period / (NARROW * m.rate)))

    def _measured(self, slot: Slot, k: int, seen: Array, inside: Array, slow: float, whole: float) -> Measures:
        if isinstance(slot, Flow):
            low, high = (float(v) for v in np.quantile(seen[:, 0], [0.002, 0.998]))
            size = self._evident(k, inside, fl.STEADY)
            nominal = float(np.quantile(np.abs(seen[:, 2]), 0.95))
            settles = self._settles(k, slot, high)
            return Measures(size, max(high - low, 1e-12) / slow, max(high - low, 1e-12), low, max(high, 1e-12), nominal,
                            slow, whole, slot.unit, slot.pressure_unit, settles=settles)  # fmt: skip
        assert isinstance(slot, Force)
        S = inside[k]
        moving = float(np.ptp(seen[:, 1])) > 0.0
        size = self._evident(k, inside, fo.COULOMB if moving else fo.STEADY)
        low, high = float(S[fo.S_BELOW]), float(S[fo.S_ABOVE])
        load = float(np.quantile(np.abs(seen[:, 2]), 0.95))
        return Measures(size, float(S[fo.S_RATE]), float(S[fo.S_SWING]), low, high, load, slow, whole, slot.unit,
                        slot.travel_unit, varied=varied(seen[:, 1]))  # fmt: skip

    def _settles(self, k: int, slot: Flow, pressure: float) -> float:
        """What seems to flow out at most while a gas at some pressure (absolute) cools: filled to it from nothing and
        with no heat lost, it is :data:`ADIABATIC` times as warm as what was let in, so that its pressure falls to that
        part of itself. Infinite where the slot is no gas's.
        """
        moved = abs(self._change(k, 0))
        return (1.0 - 1.0 / ADIABATIC) * abs(pressure) / moved if slot.gas and moved > 0.0 else np.inf

    def _evident(self, k: int, inside: Array, column: int) -> float:
        """Size of one value at a slot that moves the windows' outputs by :data:`EVIDENT` of what the log moves."""
        base, size = self._run(None, inside, k), 1.0
        spread = np.append(self.spread, np.std(base[:, -1]) or np.inf)
        for _ in range(SEARCHES):
            P = np.zeros((len(inside), VALUES))
            P[k, column] = size
            if isinstance(self.physics.inside[k], Force):
                P[k, fo.ATOMS_AT_WORK] = float(column >= fo.LAWS)
            change = (self._run(P, inside, k) - base) / spread
            moved = float(np.max(np.sqrt(np.mean(change**2, axis=0))))
            if not np.isfinite(moved):
                size *= 1e-3
            elif moved == 0.0:
                size *= 1e3
            elif 0.5 * EVIDENT < moved < 2.0 * EVIDENT:
                break
            else:
                size *= float(np.clip(EVIDENT / moved, 1e-4, 1e4))
        return size

    def _run(self, P: Array | None, inside: Array, k: int) -> Array:
        """Outputs of all windows, one after the other, and a slot's travel (a flow's pressure) beside them."""
        slots = len(inside)
        on = np.zeros(slots, bool) if P is None else np.asarray(P.any(axis=1), dtype=bool)
        values = np.zeros((slots, VALUES)) if P is None else P
        runs = [self._one(w, on, values, inside) for w in self.windows]
        column = 0 if isinstance(self.physics.inside[k], Flow) else 1
        return np.vstack([np.column_stack([seen, where[:, k, column]]) for seen, where, _ in runs])

    def _one(self, w: Window, on: Mask, P: Array, S: Array) -> tuple[Array, Array, Array]:
        return self.physics.kernel.run(w.state, w.record.inputs, self.held, self.period, self.substeps, self.nominal,
                                       self.terms, on, P, S, w.record.since)  # fmt: skip

    def _coordinates(self) -> Array:
        """(M, K, 3) coordinates of the slots along the windows."""
        slots = len(self.physics.inside)
        off, P, S = np.zeros(slots, bool), np.zeros((slots, VALUES)), np.ones((slots, SCALES))
        seen = np.concatenate([self._one(w, off, P, S)[1] for w in self.windows])
        return np.where(np.isfinite(seen), np.clip(seen, -1e100, 1e100), 0.0)

    def _slowest(self) -> float:
        """s, period of the slowest motion."""
        return self.windows[0].record.pace.period

    def _signal(self, slot: Slot) -> tuple[Array, str]:
        names = self.physics.names.channels if slot.kind == "sensor" else self.physics.names.inputs
        k = names.index(slot.name)
        held = [w.record.measured if slot.kind == "sensor" else w.record.inputs for w in self.windows]
        return np.concatenate([one[:, k] for one in held]), "SI"

    def _slope(self, state: Array, u: Array, f: Array) -> Array:
        out = np.zeros(len(state))
        self.physics.kernel.derivative(state, u, self.nominal, f, out)
        return out

    def _fine_enough(self) -> int:
        """Sub-steps in which the nominal model's fastest mode turns by at most :data:`FINEST`."""
        fastest = 0.0
        for w in self.windows[:6]:
            n = len(w.state)
            if n == 0:
                return 1
            u, f = w.record.inputs[0], np.zeros(len(self.physics.inside))
            base, J = self._slope(w.state, u, f), np.zeros((n, n))
            for j in range(n):
                step = 1e-6 * max(1e-3, abs(w.state[j]))
                moved = w.state.copy()
                moved[j] += step
                J[:, j] = (self._slope(moved, u, f) - base) / step
            if np.all(np.isfinite(J)):
                fastest = max(fastest, float(np.max(np.abs(np.linalg.eigvals(J)))))
        return int(np.clip(np.ceil(fastest * self.period / FINEST), 1, MOST_STEPS))

    def _mobility(self, k: int) -> float:
        """By differences at the first window: of the slot's rate over the states, and of the states over its force."""
        w = self.windows[0]
        if not isinstance(self.physics.inside[k], Force):
            return 0.0
        if self.physics.kernel.mobility is not None:
            found = self.physics.kernel.mobility(k, w.state, w.record.inputs, self.held, self.period, self.nominal)
            return found if np.isfinite(found) else 0.0
        return self._change(k, 1)

    def _change(self, k: int, coordinate: int) -> float:
        """What a slot's coordinate changes by in a second for a unit of what acts there; 0 where nobody knows."""
        w = self.windows[0]
        if len(w.state) == 0 or self.physics.kernel.mobility is not None:
            return 0.0
        slots, u = len(self.physics.inside), w.record.inputs[0]
        f = np.zeros(slots)
        base = self._slope(w.state, u, f)
        f[k] = 1.0
        pushed = self._slope(w.state, u, f) - base

        def rate(state: Array) -> float:
            out = np.zeros((slots, 3))
            self.physics.kernel.coordinates(state, u, self.nominal, out)
            return float(out[k, coordinate])

        steps = 1e-6 * np.maximum(1e-3, np.abs(w.state))
        here = rate(w.state)
        slope = [(rate(w.state + s * e) - here) / s for s, e in zip(steps, np.eye(len(steps)), strict=True)]
        found = float(np.array(slope) @ pushed)
        return found if np.isfinite(found) else 0.0


def varied(rate: Array) -> float:
    """Share of a rate (mean square) that its direction alone does not explain: 0 at one speed out and one back.

    A force in proportion to the rate is told from dry friction by this part only. 1 where nothing moves.
    """
    whole = float(np.sum(rate**2))
    ways = [rate[rate > 0.0], rate[rate < 0.0]]
    told = sum(len(way) * float(np.mean(way)) ** 2 for way in ways if len(way))
    return 1.0 - told / whole if whole > 0.0 else 1.0
