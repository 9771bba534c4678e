# SPDX-License-Identifier: Apache-2.0
"""An effect of one's own rig over its own coordinate, as measured: law and shape together along a run.

Force over rate or travel, flow over pressure, a signal over what it was told, the response to a step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.effects.parameters import Active, Axis, Curve, family_of
from pneumo_ros.own_rig.measures import Scaling
from pneumo_ros.own_rig.physics import Physics
from pneumo_ros.own_rig.records import OwnRecord
from pneumo_ros.slots import flow as fl
from pneumo_ros.slots import force as fo
from pneumo_ros.slots import signal as si
from pneumo_ros.slots.kinds import Flow, Force
from pneumo_ros.slots.library import SlotEffect

BINS = 25
STEP_ROWS = 60
DIFFERENCE = 1e-3  # of a typical value, for the band
LAW = 0.015  # of the curve: what another law of the kind leaves of a band
OVER_RATE = ("coulomb_friction", "viscous_damping", "hysteresis")
STEPS = ("lag", "delay")
Found = Callable[[Sequence[Active]], tuple[Array, Array]]


class Running(Protocol):
    """What is needed of a rig: its slots, their effects, and a run along which they are seen."""

    @property
    def physics(self) -> Physics: ...

    @property
    def scaling(self) -> Scaling: ...

    @property
    def library(self) -> Mapping[str, SlotEffect]: ...

    def initial(self, record: OwnRecord, active: Sequence[Active] = ()) -> tuple[Array, Array]: ...

    def run(
        self, record: OwnRecord, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> tuple[Array, Array, Array]:
        """Channels (N, C), coordinates of the slots in the equations (N, K, 3) and what acts there (N, K)."""

    def values(self, active: Sequence[Active]) -> tuple[Array, Mask]:
        """Values of the slots in the equations (K, V), and which are at work."""

    def signal_values(self, place: str, active: Sequence[Active]) -> Array | None:
        """Values of a signal's slot (V,); None where nothing is at work."""


def curve_of(
    model: Running, record: OwnRecord, nuisance: Array, active: Sequence[Active], own: Sequence[Active], cov: Array
) -> Curve:
    """The curve of one effect's parts.

    Parameters
    ----------
    nuisance, active : the whole structure, along whose run it is evaluated
    own : its parts, at one site
    cov : (P, P) covariance of their values, in order
    """
    slot = next(slot for slot in model.physics.slots if slot.place == own[0].site)
    family = family_of(own[0].effect)
    if isinstance(slot, (Force, Flow)):
        where = model.run(record, nuisance, model.initial(record, active)[0], active)[1]
        seen = where[:, model.physics.inside.index(slot)]
        seen = seen[np.isfinite(seen).all(axis=1)]
        if isinstance(slot, Flow):
            axes = Axis("pressure", slot.pressure_unit), Axis("flow", slot.unit)
            column = 0
        else:
            rate = family in OVER_RATE or (family not in _OVER_TRAVEL and float(np.ptp(seen[:, 1])) > 0.0)
            axes = (
                Axis(*(("rate", f"{slot.travel_unit}/s") if rate else ("travel", slot.travel_unit))),
                Axis("force", slot.unit),
            )
            column = 1 if rate else 0
        found: Found = lambda parts: (seen[:, column], _along(model, parts, seen, record))  # noqa: E731
    else:
        step = family in STEPS
        axes = (Axis("time after a step", "s"), Axis("share that acts", "1")) if step else (
            Axis("true value", "SI"), Axis("value after it", "SI"))  # fmt: skip
        found = lambda parts: _signal(model, parts, record, step)  # noqa: E731
        if step:
            return Curve(*axes, _points(model, own, found, cov, binned=False))
    return Curve(*axes, _points(model, own, found, cov, binned=True))


_OVER_TRAVEL = ("stop", "spring_error", "backlash", "relaxation", "resonance", "lift_off")


def _along(model: Running, parts: Sequence[Active], seen: Array, record: OwnRecord) -> Array:
    """What the parts do along coordinates (M, 3)."""
    P, _ = model.values(parts)
    k = [slot.place for slot in model.physics.inside].index(parts[0].site)
    S, slot = model.scaling.inside[k], model.physics.inside[k]
    z, out = np.zeros(max(fo.MEMORIES, fl.MEMORIES)), np.empty(len(seen))
    if isinstance(slot, Flow):
        fl.start(seen[0], z, record.since, P[k], S)
        for i, c in enumerate(seen):
            out[i] = fl.flow(c, z, P[k], S)
            fl.advance(c, z, record.period, P[k], S)
        return out
    values, scales = fo.steadied(P[k], S, float(model.scaling.mobility[k]), record.period / model.scaling.substeps)
    fo.start(seen[0], z, scales)
    for i, c in enumerate(seen):
        fo.advance(c, z, record.period, values, scales)
        out[i] = fo.force(c, z, values, scales)
    return out


def _signal(model: Running, parts: Sequence[Active], record: OwnRecord, step: bool) -> tuple[Array, Array]:
    place = parts[0].site
    S = model.scaling.signals[place]
    P = model.signal_values(place, parts)
    if step:
        length = 4.0 * max(
            float(S[si.S_LAGS + 2]), *(P[[si.LAG, si.SECOND_LAG, si.DELAY, si.SLOWNESS]] if P is not None else (0.0,))
        )
        period = length / STEP_ROWS
        u = np.ones(STEP_ROWS + 4)
        u[:4] = 0.0
        y = u if P is None else si.passed(u, period, P, S)
        return np.asarray(np.arange(STEP_ROWS) * period), y[4:]
    names = model.physics.names
    name = place.partition(":")[2]
    u = record.measured[:, names.channels.index(name)] if place.startswith("sensor:") else (
        record.inputs[:, names.inputs.index(name)])  # fmt: skip
    return u.copy(), u if P is None else si.passed(u, record.period, P, S)


def _points(model: Running, own: Sequence[Active], found: Found, cov: Array, binned: bool) -> Array:
    """(B, 5) curve with its 90 % band by linear propagation of the values' covariance."""
    x, y = found(own)
    bins, centres, weight = _bins(x) if binned else (np.arange(len(x), dtype=np.intp), x, np.full(len(x), 1.0 / len(x)))
    mean = _means(y, bins, len(centres))
    slopes = []
    for part, one in enumerate(own):
        for k, p in enumerate(model.library[one.effect].by_site[one.site]):
            size = DIFFERENCE * p.typical * (1.0 if one.values[k] + DIFFERENCE * p.typical <= p.high else -1.0)
            values = [v + size * (m == k) for m, v in enumerate(one.values)]
            moved = [Active(a.effect, a.site, tuple(values)) if m == part else a for m, a in enumerate(own)]
            slopes.append((_means(found(moved)[1], bins, len(centres)) - mean) / size)
    slope = np.array(slopes)
    band = 1.645 * np.hypot(np.sqrt(np.maximum(np.einsum("pb,pq,qb->b", slope, cov, slope), 0.0)), LAW * np.abs(mean))
    return np.column_stack([centres, mean, mean - band, mean + band, weight])


def _bins(x: Array) -> tuple[NDArray[np.intp], Array, Array]:
    low, high = np.quantile(x, [0.002, 0.998])
    edges = np.linspace(low, max(high, low + 1e-12), BINS + 1)
    bins = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    counts = np.bincount(bins, minlength=BINS)
    kept = np.flatnonzero(counts)
    index = np.full(BINS, -1)
    index[kept] = np.arange(len(kept))
    return index[bins], np.bincount(bins, x, BINS)[kept] / counts[kept], counts[kept] / len(x)


def _means(y: Array, bins: NDArray[np.intp], count: int) -> Array:
    return np.asarray(np.bincount(bins, y, count) / np.maximum(np.bincount(bins, minlength=count), 1))
