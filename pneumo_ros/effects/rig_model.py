# SPDX-License-Identifier: Apache-2.0
"""The half car as the diagnosis sees it: nuisance parameters from the rig's tolerances, effects, one compiled
kernel.

Effects that the rig's own configuration names (:attr:`RigModel.configured`) are in every simulation, before those that
are asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.effects.composition import CORRECTIONS, Compiled, Slot
from pneumo_ros.effects.configured import configured_effects
from pneumo_ros.effects.contract import (
    SENSOR_PLACES,
    Effect,
    Inputs,
    Memory,
    Plant,
    channels_of,
    ends_of,
)
from pneumo_ros.effects.drive import Drive, Log, coarsened, command_jumps, shifted, with_earlier_jumps, with_push
from pneumo_ros.effects.loading import load_library
from pneumo_ros.effects.nuisance import COMMAND_DELAY, NUISANCE, nominal_plant, nuisance_parameters, plant_with
from pneumo_ros.effects.observed import ideal_channels, rates_of_channels, state_of
from pneumo_ros.effects.parameters import Active, Curve, Parameter
from pneumo_ros.effects.shapes.families import anything_at
from pneumo_ros.effects.switches import Layout, kernel_of, layout_of, room_for_states, slots_of, switches_of
from pneumo_ros.laws.filters import held_means
from pneumo_ros.plant.air_spring import AreaSurface, load_surface
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.integrator import simulate, substeps
from pneumo_ros.rig import Rig
from pneumo_ros.rig.channels import CHANNELS

FIT_STEP = 2e-3  # s: one RK4 step a sample at 500 Hz
COARSEST = 4.2e-3  # s: one step of a coarse record, for sensitivities only; 500 Hz in pairs by a clock that runs slow
Memories = tuple[Memory, ...]  # one an effect; empty before the first block
STILL = 1e-10  # m2
PLANTS = 64  # kept at a time
DRIVEN = 32  # records with what their commands and road come to, kept at a time
NO_CORRECTION = np.zeros((0, len(CORRECTIONS)))


@dataclass(frozen=True)
class RigModel:
    """A rig with a library of effects: what the diagnosis fits, and what a corrected rig is stepped by.

    Attributes
    ----------
    rig : nominal values and tolerances
    library : effects by id, all of them in the compiled kernel
    withheld : ids that the competition does without (the kernel keeps them, so nothing is compiled anew)
    step : longest RK4 step, s
    """

    rig: Rig
    library: Mapping[str, Effect] = field(default_factory=load_library)
    withheld: frozenset[str] = frozenset()
    step: float = FIT_STEP
    surface: AreaSurface = field(default_factory=load_surface)

    channels = CHANNELS

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Nuisance parameters; a quantity without tolerance is exact and stays."""
        return nuisance_parameters(self.rig)

    @cached_property
    def effects(self) -> Mapping[str, Effect]:
        """The effects that compete, at the sites that are left to them.

        The kernel has one place for a term at an end: where a configured effect has taken it, no second one competes.
        """
        free = {name: self._free(effect) for name, effect in self.library.items() if name not in self.withheld}
        return {name: effect for name, effect in free.items() if effect.sites}

    def _free(self, effect: Effect) -> Effect:
        taken = [ends_of(one.site) for one in self.configured if one.effect == effect.id and effect.term is not None]
        sites = [s for s in effect.sites if not any(a and b for t in taken for a, b in zip(ends_of(s), t, strict=True))]
        return effect if len(sites) == len(effect.sites) else replace(effect, sites=tuple(sites))

    @cached_property
    def configured(self) -> tuple[Active, ...]:
        """The effects that the rig's configuration names.

        Raises
        ------
        InputError
            if one is not in the library, or its site, parameters or place in the kernel cannot be.
        """
        return configured_effects(self.rig, self.library)

    def places(self, active: Active) -> tuple[str, ...]:
        """Places touched, first the one blamed."""
        effect = self.library[active.effect]
        if effect.outputs is not None:
            return tuple(SENSOR_PLACES[CHANNELS[channel]] for channel in channels_of(active.site))
        ends = [end for end, on in zip(("front", "rear"), ends_of(active.site), strict=True) if on]
        return tuple(dict.fromkeys(place.format(end=end) for place in effect.places for end in ends))

    def anything_at(self, place: str) -> tuple[tuple[str, str], ...]:
        """(effect, site) of what may act at a place; nothing where no term reaches."""
        return tuple(part for part in anything_at(place) if part[0] in self.effects)

    def curve(
        self, record: Drive, nuisance: Array, active: Sequence[Active], own: Sequence[Active], covariance: Array
    ) -> Curve | None:
        """Curve of one effect's parts along a record, see :mod:`pneumo_ros.effects.curves`."""
        from pneumo_ros.effects.curves import curve_of

        return curve_of(self, record, nuisance, active, own, covariance)

    def side(self, active: Active) -> str | None:
        """The end for an effect of an end; None for the whole rig and for sensors (their place names the channel)."""
        on_an_end = self.library[active.effect].outputs is None and active.site in ("front", "rear", "both")
        return active.site if on_an_end else None

    def initial(self, record: Drive, active: Sequence[Active] = ()) -> tuple[Array, Array]:
        """State at the record's first row: the measured one, seen through the active sensor effects."""
        state, std = np.asarray(record.initial, dtype=float), np.asarray(record.initial_std, dtype=float)
        nominal, body = self._base.body, self.plant(None, active).body
        every = [(self.library[one.effect].undo, one) for one in (*self.configured, *active)]
        undone = [(undo, one) for undo, one in every if undo is not None]
        if not undone and (body.front_arm, body.rear_arm) == (nominal.front_arm, nominal.rear_arm):
            return state, std  # the way to the sensors and back again
        channels, rates = ideal_channels(state, nominal), rates_of_channels(state, nominal)
        for undo, one in reversed(undone):
            channels = undo(channels.reshape(1, -1), channels_of(one.site), one.values)[0]
        return state_of(channels, rates, body), std

    def predict(
        self, record: Drive, nuisance: Array, initial: Array, active: Sequence[Active] = (), rows: int | None = None
    ) -> Array:
        """Predicted channels, (rows or N, 6)."""
        return self.simulate(record, nuisance, initial, active, rows=rows)

    def simulate(
        self,
        record: Drive,
        nuisance: Array | None = None,
        initial: Array | None = None,
        active: Sequence[Active] = (),
        correction: Array | None = None,
        rows: int | None = None,
    ) -> Array:
        """Predicted channels with optional additive corrections (N, 9), columns CORRECTIONS, held over each period."""
        states = self.states(record, nuisance, initial, active, correction, rows)
        plant = self.plant(nuisance, active)
        out = ideal_channels(states, plant.body)
        return self.sensed(out, record.period, active)[0]

    def sensed(
        self, channels: Array, period: float, active: Sequence[Active] = (), memory: Memories = ()
    ) -> tuple[Array, Memories]:
        """What the sensors make of a block of rows (N, 6), and what their effects keep for the next block."""
        kept = []
        for one, before in _with_memory((*self.configured, *active), memory):
            effect = self.library[one.effect]
            if effect.outputs is not None:
                channels, before = effect.outputs(channels, period, channels_of(one.site), one.values, before)
            kept.append(before)
        return channels, tuple(kept)

    def driven(
        self, inputs: Inputs, period: float, active: Sequence[Active] = (), memory: Memories = ()
    ) -> tuple[Inputs, Memories]:
        """What of a block of commands and road acts on the plant, and what the effects keep for the next block."""
        kept = []
        for one, before in _with_memory((*self.configured, *active), memory):
            effect = self.library[one.effect]
            if effect.inputs is not None:
                inputs, before = effect.inputs(inputs, period, ends_of(one.site), one.values, before)
            kept.append(before)
        return inputs, tuple(kept)

    def _driven_by(self, record: Drive, count: int, late: float, active: Sequence[Active]) -> Inputs:
        """What of a record's first rows acts on the plant, its commands ``late`` s later; kept, because most of what a
        fit varies does not touch it.
        """
        acting = tuple(one for one in (*self.configured, *active) if self.library[one.effect].inputs is not None)
        key = (id(record), count, late, acting)
        known = self._inputs_kept.get(key)
        if known is not None and known[0] is record:
            return known[1]
        inputs = Inputs(record.commands[: count - 1], record.road[:count])
        if late != 0.0:
            inputs = inputs._replace(commands=shifted(inputs.commands, late / record.period))
        commands, road = self.driven(inputs, record.period, active)[0]
        inputs = Inputs(np.ascontiguousarray(commands), np.ascontiguousarray(road))
        if len(self._inputs_kept) >= DRIVEN:
            self._inputs_kept.clear()
        self._inputs_kept[key] = (record, inputs)
        return inputs

    @cached_property
    def _inputs_kept(self) -> dict[tuple[int, int, float, tuple[Active, ...]], tuple[Drive, Inputs]]:
        return {}

    def simulate_channels(self, state: Array) -> Array:
        """What ideal sensors show of one state, (6,)."""
        return ideal_channels(np.asarray(state, dtype=float), self._base.body)

    def states(
        self,
        record: Drive,
        nuisance: Array | None = None,
        initial: Array | None = None,
        active: Sequence[Active] = (),
        correction: Array | None = None,
        rows: int | None = None,
    ) -> Array:
        """States of :mod:`pneumo_ros.plant.equations`, (rows or N, 10)."""
        count = len(record.measured) if rows is None else rows
        late = 0.0
        if nuisance is not None:
            late = float(nuisance[[p.name for p in self.parameters].index(COMMAND_DELAY)])
        commands, road = self._driven_by(record, count, late, active)
        start = self.initial(record, active)[0] if initial is None else initial
        plant = self.plant(nuisance, active)
        whole = self.step >= FIT_STEP and substeps(record.period, COARSEST) == 1
        steps = 1 if whole else substeps(record.period, self.step)
        terms = self.terms(active)
        if not terms and correction is None:
            return simulate(start, commands, road, record.period, steps, *plant, self.surface)
        held = NO_CORRECTION if correction is None else np.ascontiguousarray(correction[: count - 1])
        on, values = self.switches(terms)
        return self.kernel(start, commands, road, held, record.period, steps, *plant, self.surface, on, values,
                           self.inner(), False)  # fmt: skip

    def coarse(self, record: Log) -> Log:
        """Every other row, commands averaged in pairs: half the steps, true to 1 % of a sensitivity."""
        return coarsened(record)

    def coarse_serves(self, active: Sequence[Active]) -> bool:
        """Whether that is so with some effects: what sticks jumps to other commands at half the rate."""
        shapes = ((self.library[one.effect].sticks, one.values) for one in active)
        return not any(values[where[0]] > 0.0 for where, values in shapes if where)

    def changes(self, record: Drive) -> dict[str, float]:
        """Factor on each nuisance parameter that the record's own configuration states differently from this rig's."""
        pairs = {name: (getattr(record.rig, name).value, getattr(self.rig, name).value) for name in NUISANCE}
        return {name: new / old for name, (new, old) in pairs.items() if old > 0.0 and new != old}

    def events(self, record: Drive) -> list[tuple[int, int]]:
        """Jumps of the inlet commands (row, column); none where the command moves all the time."""
        return command_jumps(record)

    def advanced(self, record: Log, events: list[tuple[int, int]], lead: Array) -> Log:
        """The record with jumps ``lead`` samples earlier: the row before takes that share of the jump."""
        return with_earlier_jumps(record, events, lead)

    def columns(self, site: str) -> tuple[int, ...]:
        """Columns of the commands of a site's inlets and outlets."""
        return tuple(column for end in ends_of(site).columns for column in (end, 2 + end))

    def amount(self, record: Drive, column: int) -> float:
        """Standard deviation of a command, m2; 0 of one that only rounding moves."""
        std = float(np.std(record.commands[:, column]))
        return std if std > STILL else 0.0

    def pushed(self, record: Log, column: int, first: int, last: int) -> Log:
        """The record with one command raised by its :meth:`amount` over rows ``first`` to ``last`` - 1."""
        return with_push(record, column, slice(first, last), self.amount(record, column))

    def kept_off(self, record: Drive, column: int, instants: Array, ends: NDArray[np.int64]) -> Array:
        """(K, P) m2, by how much a command is off, in the mean over rows ``ends[p]`` to ``ends[p + 1]`` - 1, when a
        driver takes it at ``instants`` (K, 2), every so many seconds from such a share of them on, and keeps it.
        """
        commands = np.ascontiguousarray(record.commands[:, column])
        means = np.add.reduceat(commands, ends[:-1]) / np.diff(ends)
        return np.asarray(held_means(commands[: ends[-1]], record.period, instants, ends) - means)

    def plant(self, nuisance: Array | None = None, active: Sequence[Active] = ()) -> Plant:
        """Parameters of the nominal equations with nuisance values and the active parameter changes."""
        plant = self._plant_with(nuisance)
        for one in (*self.configured, *active):
            effect = self.library[one.effect]
            if effect.plant is not None:
                plant = effect.plant(plant, ends_of(one.site), one.values)
        return plant

    def _plant_with(self, nuisance: Array | None) -> Plant:
        key = b"" if nuisance is None else np.asarray(nuisance, dtype=float).tobytes()
        plant = self._plants.get(key)
        if plant is None:
            values = (
                () if nuisance is None else zip((p.name for p in self.parameters), map(float, nuisance), strict=True)
            )
            plant = plant_with(self.rig, self._base, dict(values))
            if len(self._plants) >= PLANTS:
                self._plants.clear()
            self._plants[key] = plant
        return plant

    @cached_property
    def _plants(self) -> dict[bytes, Plant]:
        """Equations by the nuisance values lately asked for: a simulation asks four times, a Jacobian for one beside
        each of the others."""
        return {}

    @cached_property
    def slots(self) -> tuple[Slot, ...]:
        """Terms of the library in the kernel's order."""
        return slots_of(self.library)

    @cached_property
    def kernel(self) -> Compiled:
        """The library's compiled kernel."""
        return kernel_of(self.slots)

    @cached_property
    def _base(self) -> HalfCar:
        return nominal_plant(self.rig, self.step)

    def terms(self, active: Sequence[Active] = ()) -> list[Active]:
        """Those that act inside the kernel, the configured ones first."""
        return [one for one in (*self.configured, *active) if self.library[one.effect].term is not None]

    def inner(self) -> Array:
        """Room for the states of the kernel's terms, (K, 2, S)."""
        return room_for_states(self.slots)

    def switches(self, terms: Sequence[Active]) -> tuple[Mask, Array]:
        """Which terms act at which end, (K, 2), and their parameters (K, 2, M), as the kernel takes them."""
        return switches_of(self._layout, self.library, terms)

    @cached_property
    def _layout(self) -> Layout:
        return layout_of(self.slots)


def _with_memory(active: Sequence[Active], memory: Memories) -> Iterator[tuple[Active, Memory]]:
    return zip(active, memory or (None,) * len(active), strict=True)
