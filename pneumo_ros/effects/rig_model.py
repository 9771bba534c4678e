# SPDX-License-Identifier: Apache-2.0
"""The half car as the diagnosis sees it: nuisance parameters from the rig's tolerances, effects, one compiled
kernel.

Effects that the rig's own configuration names (:attr:`RigModel.configured`) are in every simulation, before those that
are asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any, Protocol, TypeVar, cast

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.effects.composition import CORRECTIONS, Compiled, Slot, compose
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
from pneumo_ros.effects.loading import load_library
from pneumo_ros.effects.parameters import Active, Curve, Parameter
from pneumo_ros.effects.shapes.families import anything_at
from pneumo_ros.plant.air_spring import MEAN_AREA, VOLUME_OFFSET, AreaSurface, Gas, load_surface
from pneumo_ros.plant.half_car import Body, HalfCar, half_car, simulate, substeps
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import Rig
from pneumo_ros.rig.channels import CHANNELS, channels_of_states

FIT_STEP = 2e-3  # s: one RK4 step a sample at 500 Hz
COARSEST = 4e-3  # s: one step of a coarse record, for sensitivities only
JUMP = 12.0  # medians of the command's change from row to row
SPARSE = 0.1  # more jumps than this share of rows are a signal, not events
# The log stamps commands no finer than a sample and says nothing of the bus: a shift of all commands within a sample
# is no effect.
COMMAND_DELAY = "command_delay"
COMMAND_DELAY_STD = 1.5e-4  # s; rigs without a fault show up to 0.12 ms
SLOPE_SHARE = 0.5  # of the volume scale's tolerance, for the slope of V(h) about the design height
Memories = tuple[Memory, ...]  # one an effect; empty before the first block
NO_CORRECTION = np.zeros((0, len(CORRECTIONS)))

# Nuisance parameter -> the rig's quantity. What two parts have each (bushings, springs) is free for each. Beside them
# the slope of V(h) has a tolerance of its own: a common factor alone would make V/(dV/dh), the air's stiffness, exact.
NUISANCE = {
    "sprung_mass": "sprung_mass",
    "pitch_inertia": "pitch_inertia",
    "unsprung_mass_front": "unsprung_mass_front",
    "unsprung_mass_rear": "unsprung_mass_rear",
    "tyre_stiffness_front": "tyre_stiffness_front",
    "tyre_stiffness_rear": "tyre_stiffness_rear",
    "bushing_damping_front": "bushing_damping",
    "bushing_damping_rear": "bushing_damping",
    "supply_pressure": "supply_pressure",
    "outlet_area_front": "outlet_area_front",
    "outlet_area_rear": "outlet_area_rear",
    "effective_area_scale_front": "effective_area_scale",
    "effective_area_scale_rear": "effective_area_scale",
    "volume_scale_front": "volume_scale",
    "volume_scale_rear": "volume_scale",
    "discharge_coefficient_front": "discharge_coefficient",
    "discharge_coefficient_rear": "discharge_coefficient",
}


class Drive(Protocol):
    """What a simulation takes from a log of the half car, N rows on one time base.

    ``commands`` (N, 4) m2, row i held from row i to row i + 1; ``road`` (N, 2) m, linear between rows; ``initial``
    (10,) with its standard deviation.
    """

    @property
    def rig(self) -> Rig: ...
    @property
    def period(self) -> float: ...
    @property
    def measured(self) -> Array: ...
    @property
    def weight(self) -> Array: ...
    @property
    def commands(self) -> Array: ...
    @property
    def road(self) -> Array: ...
    @property
    def initial(self) -> Array: ...
    @property
    def initial_std(self) -> Array: ...


Log = TypeVar("Log", bound=Drive)


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
        found, own = [], dict(self.rig.ends)
        for name, source in NUISANCE.items():
            q = getattr(self.rig, source)
            if q.std > 0.0:
                found.append(Parameter(name, q.unit, own.get(name, q.value), q.std))
        slope = SLOPE_SHARE * self.rig.volume_scale.std
        slopes = [f"volume_slope_{end}" for end in ("front", "rear")] if slope > 0.0 else []
        found += [Parameter(name, "1", own.get(name, 1.0), slope) for name in slopes]
        found.append(Parameter(COMMAND_DELAY, "s", 0.0, COMMAND_DELAY_STD))
        return tuple(found)

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
        state = np.asarray(record.initial, dtype=float)
        channels, rates = _channels(state, self._base.body), _ends_rates(state, self._base.body)
        for one in reversed((*self.configured, *active)):
            effect = self.library[one.effect]
            if effect.undo is not None:
                channels = effect.undo(channels.reshape(1, -1), channels_of(one.site), one.values)[0]
        body = self.plant(None, active).body
        return _state(channels, rates, body), np.asarray(record.initial_std, dtype=float)

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
        out = _channels(states, plant.body)
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

    def simulate_channels(self, state: Array) -> Array:
        """What ideal sensors show of one state, (6,)."""
        return _channels(np.asarray(state, dtype=float), self._base.body)

    def states(
        self,
        record: Drive,
        nuisance: Array | None = None,
        initial: Array | None = None,
        active: Sequence[Active] = (),
        correction: Array | None = None,
        rows: int | None = None,
    ) -> Array:
        """States of :mod:`pneumo_ros.plant.half_car`, (rows or N, 10)."""
        count = len(record.measured) if rows is None else rows
        inputs = Inputs(record.commands[: count - 1], record.road[:count])
        if nuisance is not None:
            late = float(nuisance[[p.name for p in self.parameters].index(COMMAND_DELAY)])
            inputs = inputs._replace(commands=_shifted(inputs.commands, late / record.period))
        inputs = self.driven(inputs, record.period, active)[0]
        start = self.initial(record, active)[0] if initial is None else initial
        plant = self.plant(nuisance, active)
        whole = self.step >= FIT_STEP and substeps(record.period, COARSEST) == 1
        steps = 1 if whole else substeps(record.period, self.step)
        commands, road = np.ascontiguousarray(inputs.commands), np.ascontiguousarray(inputs.road)
        terms = self.terms(active)
        if not terms and correction is None:
            return simulate(start, commands, road, record.period, steps, *plant, self.surface)
        held = NO_CORRECTION if correction is None else np.ascontiguousarray(correction[: count - 1])
        on, values = self.switches(terms)
        return self.kernel(start, commands, road, held, record.period, steps, *plant, self.surface, on, values,
                           self.inner(), False)  # fmt: skip

    def coarse(self, record: Log) -> Log:
        """Every other row, commands averaged in pairs: half the steps, true to 1 % of a sensitivity."""
        rows = len(record.measured) // 2 * 2
        return _replaced(
            record,
            period=2.0 * record.period,
            measured=record.measured[:rows:2],
            weight=record.weight[:rows:2],
            commands=record.commands[:rows].reshape(-1, 2, 4).mean(axis=1),
            road=record.road[:rows:2],
        )

    def changes(self, record: Drive) -> dict[str, float]:
        """Factor on each nuisance parameter that the record's own configuration states differently from this rig's."""
        pairs = {name: (getattr(record.rig, q).value, getattr(self.rig, q).value) for name, q in NUISANCE.items()}
        return {name: new / old for name, (new, old) in pairs.items() if old > 0.0 and new != old}

    def events(self, record: Drive) -> list[tuple[int, int]]:
        """Jumps of the inlet commands (row, column); none where the command moves all the time."""
        found = []
        for column in (0, 1):
            steps = np.abs(np.diff(record.commands[:, column]))
            limit = max(JUMP * float(np.median(steps)), 0.02 * float(np.ptp(record.commands[:, column])), 1e-12)
            rows = np.flatnonzero(steps > limit) + 1
            if len(rows) < SPARSE * len(steps):
                found += [(int(row), column) for row in rows]
        return found

    def advanced(self, record: Log, events: list[tuple[int, int]], lead: Array) -> Log:
        """The record with jumps ``lead`` samples earlier: the row before takes that share of the jump."""
        commands = record.commands.copy()
        for (row, column), share in zip(events, lead, strict=True):
            commands[row - 1, column] += share * (record.commands[row, column] - record.commands[row - 1, column])
        return _replaced(record, commands=commands)

    def plant(self, nuisance: Array | None = None, active: Sequence[Active] = ()) -> Plant:
        """Parameters of the nominal equations with nuisance values and the active parameter changes."""
        v = {} if nuisance is None else dict(zip((p.name for p in self.parameters), map(float, nuisance), strict=True))
        plant = _plant(self.rig, self._base, {**dict(self.rig.ends), **v})
        for one in (*self.configured, *active):
            effect = self.library[one.effect]
            if effect.plant is not None:
                plant = effect.plant(plant, ends_of(one.site), one.values)
        return plant

    @cached_property
    def slots(self) -> tuple[Slot, ...]:
        """Terms of the library in the kernel's order."""
        found: dict[str, Slot] = {}
        for _, e in sorted(self.library.items()):
            if e.term is not None:
                name, count = e.place_in_kernel, max([len(e.parameters), *(column + 1 for column in e.columns)])
                known = found.get(name)
                found[name] = Slot(name, e.term, max(count, known.parameters if known else 0))
        return tuple(found[name] for name in sorted(found))

    @cached_property
    def kernel(self) -> Compiled:
        """The library's compiled kernel."""
        return _kernel(self.slots)

    @cached_property
    def _base(self) -> HalfCar:
        return _base(self.rig, self.step)

    def terms(self, active: Sequence[Active] = ()) -> list[Active]:
        """Those that act inside the kernel, the configured ones first."""
        return [one for one in (*self.configured, *active) if self.library[one.effect].term is not None]

    def inner(self) -> Array:
        """Room for the states of the kernel's terms, (K, 2, S)."""
        return np.zeros((max(1, len(self.slots)), 2, max([1, *(slot.term.states for slot in self.slots)])))

    def switches(self, terms: Sequence[Active]) -> tuple[Mask, Array]:
        """Which terms act at which end, (K, 2), and their parameters (K, 2, M), as the kernel takes them."""
        slots = {slot.name: k for k, slot in enumerate(self.slots)}
        on = np.zeros((max(1, len(slots)), 2), dtype=np.bool_)
        values = np.ones((max(1, len(slots)), 2, max([1, *(slot.parameters for slot in self.slots)])))
        for one in terms:
            effect = self.library[one.effect]
            k = slots[effect.place_in_kernel]
            for end in ends_of(one.site).columns:
                if not effect.columns:
                    values[k, end, : len(one.values)] = one.values
                else:
                    values[k, end] = values[k, end] if on[k, end] else 0.0
                    values[k, end, list(effect.columns)] += one.values
                on[k, end] = True
        return on, values


@lru_cache(maxsize=8)
def _kernel(slots: tuple[Slot, ...]) -> Compiled:
    return compose(slots)


@lru_cache(maxsize=32)
def _base(rig: Rig, step: float) -> HalfCar:
    own = dict(rig.ends)
    given = [own.get(f"reference_pressure_{end}") for end in ("front", "rear")]
    front, rear = (v if v is not None else trim(rig).pressures[k] for k, v in enumerate(given))
    return half_car(rig, (front, rear), step=step)


def _with_memory(active: Sequence[Active], memory: Memories) -> Iterator[tuple[Active, Memory]]:
    return zip(active, memory or (None,) * len(active), strict=True)


def _shifted(commands: Array, samples: float) -> Array:
    """Held commands a part of a sample later (positive) or earlier, as means over the rows."""
    share = min(abs(samples), 1.0)
    moved = np.empty_like(commands)
    if samples >= 0.0:
        moved[1:], moved[0] = commands[:-1], commands[0]
    else:
        moved[:-1], moved[-1] = commands[1:], commands[-1]
    return (1.0 - share) * commands + share * moved


def _plant(rig: Rig, base: HalfCar, v: Mapping[str, float]) -> Plant:
    body = base.body
    body = body._replace(
        **{name: v[name] for name in body._fields if name in v},
        damping_front=v.get("bushing_damping_front", body.damping_front),
        damping_rear=v.get("bushing_damping_rear", body.damping_rear),
        area_scale_front=v.get("effective_area_scale_front", body.area_scale_front),
        area_scale_rear=v.get("effective_area_scale_rear", body.area_scale_rear),
    )
    return Plant(body, _gas(rig, base.front, v, "front"), _gas(rig, base.rear, v, "rear"))


def _gas(rig: Rig, gas: Gas, v: Mapping[str, float], end: str) -> Gas:
    volume = v.get(f"volume_scale_{end}", rig.volume_scale.value)
    slope = volume * v.get(f"volume_slope_{end}", 1.0)
    level = VOLUME_OFFSET + MEAN_AREA * rig.design_height.value
    coefficient = v.get(f"discharge_coefficient_{end}", rig.discharge_coefficient.value)
    supply = v.get("supply_pressure", gas.supply_pressure)
    # The log carries the commanded outlet; the estimate is of the opening that the nominal command really gives.
    nominal = getattr(rig, f"outlet_area_{end}").value
    opening = v.get(f"outlet_area_{end}", nominal) / nominal if nominal > 0.0 else 1.0
    return gas._replace(
        supply_pressure=supply,
        supply_power=(gas.reference_pressure / supply) ** gas.k,
        inlet_scale=coefficient,
        outlet_scale=coefficient * opening,
        volume_offset=level * volume - MEAN_AREA * slope * rig.design_height.value,
        mean_area=MEAN_AREA * slope,
    )


def _channels(states: Array, body: Body) -> Array:
    """(..., 10) -> (..., 6): sprung points above the axles, axles, pressures."""
    out = np.empty((*states.shape[:-1], len(CHANNELS)))
    for k, column in enumerate(channels_of_states(states, body.front_arm, body.rear_arm)):
        out[..., k] = column
    return out


def _ends_rates(state: Array, body: Body) -> Array:
    return _channels(np.concatenate([state[4:8], np.zeros(6)]), body)[:4]


def _state(channels: Array, rates: Array, body: Body) -> Array:
    base = body.front_arm + body.rear_arm
    pitch, pitch_rate = (channels[0] - channels[1]) / base, (rates[0] - rates[1]) / base
    heave, heave_rate = channels[0] - body.front_arm * pitch, rates[0] - body.front_arm * pitch_rate
    return np.array([heave, pitch, *channels[2:4], heave_rate, pitch_rate, *rates[2:4], *channels[4:6]])


def _replaced(record: Log, **changes: object) -> Log:
    """A copy of a frozen record with other values."""
    return cast(Log, replace(cast(Any, record), **changes))
