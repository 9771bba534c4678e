# SPDX-License-Identifier: Apache-2.0
"""A rig of one's own as the diagnosis sees it: parameters inside their tolerances, effects at its slots, a free run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.effects.parameters import ANYTHING, Active, Curve, Parameter
from pneumo_ros.errors import InputError
from pneumo_ros.own_rig.description import Description
from pneumo_ros.own_rig.kernel import FLOW, FORCE, VALUES
from pneumo_ros.own_rig.measures import WINDOWS, Scaler, Scaling, Window
from pneumo_ros.own_rig.physics import Physics
from pneumo_ros.own_rig.records import OwnRecord, first_values
from pneumo_ros.slots import force as fo
from pneumo_ros.slots import signal as si
from pneumo_ros.slots.kinds import Flow, Force
from pneumo_ros.slots.library import SlotEffect, effects_of


@dataclass(frozen=True)
class OwnRig:
    """A user's model with the effects that its slots may have.

    Attributes
    ----------
    description, physics : rig.yaml and rig.py
    scaling : what the logs say of the slots
    withheld : families that do not compete
    configured : effects that a saved rig has
    """

    description: Description
    physics: Physics
    scaling: Scaling
    withheld: frozenset[str] = frozenset()
    configured: tuple[Active, ...] = ()
    _scratch: dict[str, Array] = field(default_factory=dict, repr=False, compare=False)

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of what is measured."""
        return self.physics.names.channels

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those with a tolerance."""
        table = self.description.parameters.items()
        return tuple(Parameter(name, q.unit, q.value, q.std) for name, q in table if q.std > 0.0)

    @cached_property
    def library(self) -> Mapping[str, SlotEffect]:
        """Every effect that this rig knows."""
        return effects_of(self.physics.slots, self.scaling.measures, self.description.families)

    @cached_property
    def effects(self) -> Mapping[str, SlotEffect]:
        """Effects that compete, by id: the library without the withheld families."""
        return {name: one for name, one in self.library.items() if name.partition(".")[0] not in self.withheld}

    @cached_property
    def nominal(self) -> Array:
        """All parameters at their nominal values."""
        return np.array([q.value for q in self.description.parameters.values()])

    @cached_property
    def held(self) -> Mask:
        """Which inputs are held from row to row."""
        return np.array([spec.hold for spec in self.description.inputs.values()], dtype=bool)

    @cached_property
    def terms(self) -> Array:
        """What evaluates each slot in the equations."""
        return np.array([FLOW if isinstance(s, Flow) else FORCE for s in self.physics.inside], dtype=np.int64)

    def places(self, active: Active) -> tuple[str, ...]:
        """Name of the slot that the effect acts at."""
        return (active.site,)

    def side(self, active: Active) -> str | None:
        """The slot, for those in the equations: friction against the ground is not friction against the base."""
        return active.site if ":" not in active.site else None

    def anything_at(self, place: str) -> tuple[tuple[str, str], ...]:
        """The ceiling of a slot."""
        kinds = {slot.place: slot.kind for slot in self.physics.slots}
        return ((f"{ANYTHING}.{kinds[place]}", place),) if place in kinds else ()

    def curve(
        self, record: OwnRecord, nuisance: Array, active: Sequence[Active], own: Sequence[Active], covariance: Array
    ) -> Curve | None:
        """One effect over its own coordinate along a record."""
        from pneumo_ros.own_rig.curves import curve_of

        return curve_of(self, record, nuisance, active, own, covariance)

    def initial(self, record: OwnRecord, active: Sequence[Active] = ()) -> tuple[Array, Array]:
        """State at the record's first row, seen through the active sensor effects, and its standard deviation."""
        seen = self._through_sensors(record, (*self.configured, *active))
        return start_state(self.description, self.physics, record, seen)

    def predict(
        self, record: OwnRecord, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> Array:
        """Free run, (rows or N, C)."""
        return self.run(record, nuisance, initial, active, rows)[0]

    def run(
        self, record: OwnRecord, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> tuple[Array, Array, Array]:
        """Channels (N, C), coordinates of the slots in the equations (N, K, 3) and what acts there (N, K)."""
        acting = (*self.configured, *active)
        inputs = self.driven(record.inputs[:rows], record.period, acting)
        P, on = self.values(acting)
        S = self.scaling.inside.copy()
        h = record.period / self.scaling.substeps
        for k, slot in enumerate(self.physics.inside):
            if on[k] and isinstance(slot, Force):
                P[k], S[k] = fo.steadied(P[k], S[k], float(self.scaling.mobility[k]), h)
        p, steps, state = self.given(nuisance), self.scaling.substeps, np.asarray(initial, dtype=float)
        out, where, acted = self.physics.kernel.run(
            state, inputs, self.held, record.period, steps, p, self.terms, on, P, S, record.since
        )
        return self._sensed(out, record.period, acting), where, acted

    def given(self, nuisance: Array | None) -> Array:
        """All parameters, those with a tolerance at other values."""
        values = self.nominal.copy()
        if nuisance is not None:
            free = [k for k, q in enumerate(self.description.parameters.values()) if q.std > 0.0]
            values[free] = nuisance
        return values

    def values(self, active: Sequence[Active]) -> tuple[Array, Mask]:
        """Values of the slots in the equations (K, V), and which are at work."""
        places = [slot.place for slot in self.physics.inside]
        P = np.zeros((len(places), VALUES))
        for one in active:
            if one.site in places:
                P[places.index(one.site), list(self.library[one.effect].columns[one.site])] += one.values
        on = np.asarray(P.any(axis=1), dtype=bool)
        forces = self.terms == FORCE
        P[forces, fo.ATOMS_AT_WORK] = P[forces, fo.LAWS : fo.ATOMS_AT_WORK].any(axis=1)
        return P, on

    def signal_values(self, place: str, active: Sequence[Active]) -> Array | None:
        """Values of a signal's slot (V,); None where nothing is at work."""
        P = np.zeros(si.VALUES)
        for one in active:
            if one.site == place:
                P[list(self.library[one.effect].columns[place])] += one.values
        return P if P.any() else None

    def driven(self, inputs: Array, period: float, active: Sequence[Active]) -> Array:
        """Inputs (N, U) as they reach the rig; a rate moves with its signal."""
        out = np.ascontiguousarray(inputs)
        for slot in self.physics.slots:
            P = self.signal_values(slot.place, active) if slot.kind == "input" else None
            if P is None:
                continue
            out = out.copy() if out is inputs else out
            k = self.physics.names.inputs.index(slot.name)
            moved = si.passed(inputs[:, k], period, P, self.scaling.signals[slot.place])
            for j, spec in enumerate(self.description.inputs.values()):
                if spec.rate_of == slot.name:
                    out[:, j] = inputs[:, j] + np.gradient(moved - inputs[:, k], period)
            out[:, k] = moved
        return out

    def _sensed(self, channels: Array, period: float, active: Sequence[Active]) -> Array:
        for slot in self.physics.slots:
            P = self.signal_values(slot.place, active) if slot.kind == "sensor" else None
            if P is not None:
                k = self.channels.index(slot.name)
                channels[:, k] = si.passed(channels[:, k], period, P, self.scaling.signals[slot.place])
        return channels

    def _through_sensors(self, record: OwnRecord, active: Sequence[Active]) -> Array:
        rows = record.measured[:64]
        for slot in self.physics.slots:
            P = self.signal_values(slot.place, active) if slot.kind == "sensor" else None
            if P is not None:
                rows = rows.copy()
                k = self.channels.index(slot.name)
                rows[:, k] = si.undone(rows[:, k], P, self.scaling.signals[slot.place])
        return rows


def start_state(rig: Description, physics: Physics, record: OwnRecord, seen: Array) -> tuple[Array, Array]:
    """State and standard deviation at a record's first row as the rig file says where it starts.

    ``seen`` : the first rows of what is measured, seen through the sensors
    """
    state, std = np.zeros(len(rig.states)), np.ones(len(rig.states))
    for j, start in enumerate(rig.states.values()):
        if not start.channel:
            state[j], std[j] = start.value, start.std
        elif start.channel in physics.names.inputs:
            state[j], std[j] = record.inputs[0, physics.names.inputs.index(start.channel)], 0.0
        else:
            k = physics.names.channels.index(start.channel)
            found, spread = first_values(record, seen[:, k], float(record.noise[k]))
            state[j], std[j] = found[int(start.rate)], spread[int(start.rate)]
        std[j] = max(std[j], 1e-9 * abs(state[j]), 1e-12)
    return state, std


def own_rig(rig: Description, physics: Physics, records: Sequence[OwnRecord], withheld: Sequence[str] = ()) -> OwnRig:
    """The model of a rig, its slots scaled by the logs that are fitted.

    Raises
    ------
    InputError
        if the nominal model runs away within moments.
    """
    nominal = np.array([q.value for q in rig.parameters.values()])
    held = np.array([spec.hold for spec in rig.inputs.values()], dtype=bool)
    windows = [w for record in records for w in windows_of(rig, physics, record)]
    scaling = Scaler(physics, windows, nominal, held).scaling()
    if rig.scales:
        scaling = _saved(scaling, rig, physics)
    model = OwnRig(rig, physics, scaling, frozenset(withheld))
    _check_configured(rig, model)
    model = OwnRig(rig, physics, scaling, frozenset(withheld), rig.effects)
    for w in windows:
        if not np.all(np.isfinite(model.predict(w.record, None, w.state, ()))):  # type: ignore[arg-type]
            raise InputError("the nominal model runs away within moments", where=w.record.name,
                             remedy="check units, signs and parameters of rig.py and rig.yaml")  # fmt: skip
    return model


def windows_of(rig: Description, physics: Physics, record: OwnRecord) -> list[Window]:
    """Pieces of a record about a block long, each with the state that the rig file reads from its first rows."""
    rows = len(record.measured)
    length = int(np.clip(round(record.pace.block / record.period), min(40, rows), rows))
    starts = np.unique(np.linspace(0, rows - length, min(WINDOWS, max(1, rows // length))).astype(int))
    pieces = [record.slice(int(s), int(s) + length) for s in starts]
    return [Window(piece, start_state(rig, physics, piece, piece.measured[:64])[0]) for piece in pieces]


def _saved(scaling: Scaling, rig: Description, physics: Physics) -> Scaling:
    """Scales as a saved rig states them: its effects were fitted with those."""
    inside, signals = scaling.inside.copy(), dict(scaling.signals)
    places = [slot.place for slot in physics.inside]
    for place, values in rig.scales.items():
        if place in places:
            inside[places.index(place), : len(values)] = values
        elif place in signals and len(values) == len(signals[place]):
            signals[place] = np.array(values)
    return Scaling(scaling.measures, inside, signals, scaling.mobility, scaling.substeps)


def _check_configured(rig: Description, model: OwnRig) -> None:
    for one in rig.effects:
        known = model.library.get(one.effect)
        if known is None or one.site not in known.sites or len(one.values) != len(known.by_site[one.site]):
            told = f"{one.effect} at {one.site}"
            raise InputError("no such effect at this slot", where=rig.path, key="effects", value=told,
                             remedy="give the rig.py that it was saved with")  # fmt: skip
