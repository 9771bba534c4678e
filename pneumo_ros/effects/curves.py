# SPDX-License-Identifier: Apache-2.0
"""The curve of an effect over its own coordinate: force over rate, flow over pressure, opening over command, a step.

A law is a curve, a family's shape beside it another; together they are what was measured. Along a run of the rig the
terms are evaluated as they act (with their memories), and averaged over narrow bins of the coordinate, so that what a
bin holds is the mean law there and how much of the run stood in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array
from pneumo_ros.effects.composition import PlantTerm, Slot
from pneumo_ros.effects.contract import Effect, Inputs, Memory, Plant, channels_of, ends_of
from pneumo_ros.effects.drive import Drive
from pneumo_ros.effects.hooks import Air, Strut, Tyre, air_of, strut_of, tyre_loads, tyre_of
from pneumo_ros.effects.parameters import Active, Axis, Curve, family_of
from pneumo_ros.plant.air_spring import AreaSurface
from pneumo_ros.units import GAS_CONSTANT

THINNED = 8e-3  # s between rows that are evaluated
BINS = 25
STEP_TIME, STEP_ROWS = 0.3, 60  # s of a step response, and its points
SWEPT = np.geomspace(1.0, 40.0, 200)  # Hz, of a frequency response
DIFFERENCE = 1e-3  # of a typical value, for the band


class Running(Protocol):
    """What is needed of a rig's model: its effects, and a run along which they are seen."""

    @property
    def library(self) -> Mapping[str, Effect]: ...

    @property
    def surface(self) -> AreaSurface: ...

    @property
    def slots(self) -> Sequence[Slot]: ...

    def states(self, record: Drive, nuisance: Array, initial: None, active: Sequence[Active]) -> Array: ...

    def driven(self, inputs: Inputs, period: float, active: Sequence[Active]) -> tuple[Inputs, tuple[Memory, ...]]: ...

    def plant(self, nuisance: Array, active: Sequence[Active]) -> Plant: ...


class _Row(NamedTuple):
    """One end at one instant: the kernel's signals and the flow of both ends."""

    strut: Strut
    air: Air
    tyre: Tyre


Reader = Callable[[Sequence[_Row], Array], tuple[Array, Array]]  # rows and the term's output -> x, y

RATE, HEIGHT, FORCE = Axis("strut rate", "m/s"), Axis("strut height", "m"), Axis("force up on the body", "N")
PRESSURE, FLOW = Axis("pressure", "Pa"), Axis("mass flow into the spring", "kg/s")
STEP = (Axis("time after a step", "s"), Axis("share that acts", "1"))


def _flow(rows: Sequence[_Row], y: Array) -> Array:
    return np.array([v * r.air.volume / (r.air.exponent * GAS_CONSTANT * r.air.temperature)
                     for r, v in zip(rows, y, strict=True)])  # fmt: skip


def _heat(rows: Sequence[_Row], y: Array) -> Array:
    return np.array([v * r.air.volume / (r.air.exponent - 1.0) for r, v in zip(rows, y, strict=True)])


def _of(rows: Sequence[_Row], read: Callable[[_Row], float]) -> Array:
    return np.array([read(r) for r in rows])


# Family -> axes of its curve, and how the kernel's rows and the term's output give it.
TERMS: dict[str, tuple[Axis, Axis, Reader]] = {
    "coulomb_friction": (RATE, FORCE, lambda r, y: (_of(r, lambda s: s.strut.rate), y)),
    "viscous_damping": (RATE, FORCE, lambda r, y: (_of(r, lambda s: s.strut.rate), y)),
    "bellows_hysteresis": (RATE, FORCE, lambda r, y: (_of(r, lambda s: s.strut.rate), y)),
    "bump_stop": (HEIGHT, FORCE, lambda r, y: (_of(r, lambda s: s.strut.height), y)),
    "effective_area_error": (HEIGHT, FORCE, lambda r, y: (_of(r, lambda s: s.strut.height), y)),
    "anything.force": (HEIGHT, FORCE, lambda r, y: (_of(r, lambda s: s.strut.height), y)),
    "leak": (PRESSURE, FLOW, lambda r, y: (_of(r, lambda s: s.air.pressure), _flow(r, y))),
    "anything.air": (PRESSURE, FLOW, lambda r, y: (_of(r, lambda s: s.air.pressure), _flow(r, y))),
    "orifice_coefficient": (
        Axis("nominal inflow", "kg/s"), FLOW, lambda r, y: (_of(r, lambda s: s.air.inflow), _flow(r, y))
    ),
    "heat_transfer": (
        Axis("wall over polytropic temperature", "K"), Axis("heat from the wall", "W"),
        lambda r, y: (_of(r, lambda s: s.air.supply_temperature - s.air.temperature), _heat(r, y)),
    ),
    "tyre_damping": (
        Axis("compression rate", "m/s"), Axis("force up on the axle", "N"),
        lambda r, y: (_of(r, lambda s: s.tyre.rate), y),
    ),
    "tyre_liftoff": (
        Axis("tyre compression", "m"), Axis("force up on the axle", "N"),
        lambda r, y: (_of(r, lambda s: s.tyre.compression), y),
    ),
    "supply_droop": (
        Axis("flow drawn", "kg/s"), Axis("sag of the supply", "Pa"), lambda r, y: (_of(r, lambda s: s.air.inflow), y)
    ),
}  # fmt: skip
TERMS["anything.tyre"], TERMS["anything.supply"] = TERMS["tyre_damping"], TERMS["supply_droop"]
# What rings has no law over its own coordinate: the size of its answer to a motion, over frequency.
RINGS = {
    "anything.body": (Axis("frequency", "Hz"), Axis("apparent mass", "kg")),
    "anything.ground": (Axis("frequency", "Hz"), Axis("ground's motion over the road's, axles held", "1")),
}
# What ties the body or the struts: force over how far they have moved from where they began.
TIES = {
    "anything.held": (Axis("height of the body where it is held, from the begin", "m"), FORCE),
    "anything.bar": (
        Axis("height of the front spring over the rear one's, from the begin", "m"),
        Axis("force on the front spring", "N"),
    ),
}  # fmt: skip
EXCHANGED = (Axis("front pressure over the rear one", "Pa"), Axis("mass flow into the front spring", "kg/s"))
STEPS = ("valve_lag", "transport_delay", "exciter_lag", "pressure_lag")
OPENINGS = ("valve_deadband", "anything.valve")


def curve_of(
    model: Running, record: Drive, nuisance: Array, active: Sequence[Active], own: Sequence[Active], cov: Array
) -> Curve | None:
    """The curve of one effect (law and shape at one site) of a fitted structure; None where it has none.

    Parameters
    ----------
    record : the run along which it is evaluated
    nuisance, active : the whole structure
    own : the effect's parts
    cov : (P, P) covariance of their values, SI, in order
    """
    family = family_of(own[0].effect)
    if family == "anything":
        family = own[0].effect
    outputs = model.library[own[0].effect].outputs is not None
    if family in TERMS:
        x, y, read = TERMS[family]
        rows = _rows(model, record, nuisance, active, own[0].site, family.endswith("supply_droop"))
        found = lambda parts: read(rows.one, _along(model, parts, rows))  # noqa: E731
    elif family in STEPS:
        (x, y), found = STEP, lambda parts: _step_response(model, parts)
    elif family in OPENINGS:
        x, y = Axis("command", "m2"), Axis("opening", "m2")
        found = lambda parts: _openings(model, record, parts)  # noqa: E731
    elif family in TIES:
        x, y = TIES[family]
        ends = _rows(model, record, nuisance, active, "front", False)
        found = lambda parts: _tied(model, parts[0], ends)  # noqa: E731
    elif family == "anything.pipe":
        x, y = EXCHANGED
        both = _rows(model, record, nuisance, active, "front", False)
        found = lambda parts: _exchanged(model, parts[0], both)  # noqa: E731
    elif family in RINGS:
        x, y = RINGS[family]
        stiffness = model.plant(nuisance, active).body.tyre_stiffness_front
        found = lambda parts: (SWEPT, ringing(parts[0], stiffness))  # noqa: E731
    elif outputs:
        unit = "m" if own[0].site.startswith(("sprung", "unsprung")) else "Pa"
        creeps = family.endswith("offset")  # a zero moves with time, a scale with what is read
        x = Axis("time since the log began", "s") if creeps else Axis("true value", unit)
        y = Axis("error of the reading", unit)
        found = lambda parts: _errors(model, record, parts, creeps)  # noqa: E731
    else:
        return None
    return Curve(x, y, _banded(model, own, found, cov, each=family in STEPS or family in RINGS))


def _banded(
    model: Running, own: Sequence[Active], found: Callable[[Sequence[Active]], tuple[Array, Array]], cov: Array,
    each: bool,
) -> Array:  # fmt: skip
    """(B, 5) binned curve with its 90 % band by linear propagation of the parameters' covariance; ``each`` point is a
    bin of its own where the coordinate is none of the log's.
    """
    x, y = found(own)
    bins, centres, weight = _bins(x, each)
    mean = _binned(y, bins, len(centres))
    slopes = []
    for part, k, step_size in _moves(model, own):
        values = list(own[part].values)
        values[k] += step_size
        moved = [Active(a.effect, a.site, tuple(values)) if m == part else a for m, a in enumerate(own)]
        slopes.append((_binned(found(moved)[1], bins, len(centres)) - mean) / step_size)
    slope = np.array(slopes)
    std = np.sqrt(np.maximum(np.einsum("pb,pq,qb->b", slope, cov, slope), 0.0))
    band = 1.645 * np.hypot(std, 0.015 * np.abs(mean))
    return np.column_stack([centres, mean, mean - band, mean + band, weight])


def _moves(model: Running, own: Sequence[Active]) -> Iterator[tuple[int, int, float]]:
    for part, active in enumerate(own):
        for k, p in enumerate(model.library[active.effect].parameters):
            size = DIFFERENCE * p.typical
            yield part, k, size if active.values[k] + size <= p.high else -size


def _bins(x: Array, each: bool) -> tuple[NDArray[np.intp], Array, Array]:
    if each:
        return np.arange(len(x), dtype=np.intp), x, np.full(len(x), 1.0 / len(x))
    low, high = np.quantile(x, [0.002, 0.998])
    edges = np.linspace(low, max(high, low + 1e-12), BINS + 1)
    bins = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    counts = np.bincount(bins, minlength=BINS)
    kept = np.flatnonzero(counts > 0)
    index = np.full(BINS, -1)
    index[kept] = np.arange(len(kept))
    centres = np.bincount(bins, x, BINS)[kept] / counts[kept]
    return index[bins], centres, counts[kept] / len(x)


def _binned(y: Array, bins: NDArray[np.intp], count: int) -> Array:
    return np.asarray(np.bincount(bins, y, count) / np.maximum(np.bincount(bins, minlength=count), 1))


@dataclass(frozen=True)
class _Run:
    """Rows of the blamed end, of the other one, and the time between them."""

    one: list[_Row]
    other: list[_Row]
    period: float


def _rows(model: Running, record: Drive, nuisance: Array, active: Sequence[Active], site: str, total: bool) -> _Run:
    states = model.states(record, nuisance, None, active)
    inputs = model.driven(Inputs(record.commands, record.road), record.period, active)[0]
    every = max(1, round(THINNED / record.period))
    index = np.arange(0, min(len(states), len(inputs.commands)) - 1, every)
    end = 1 if site == "rear" else 0
    plant = model.plant(nuisance, active)
    rows = [[_row(model, plant, states[i], inputs, int(i), e, record.period) for i in index] for e in (end, 1 - end)]
    if total:  # a shared term sees what both ends draw
        rows[0] = [
            a._replace(air=a.air._replace(inflow=a.air.inflow + b.air.inflow)) for a, b in zip(*rows, strict=True)
        ]
        rows[1] = [b._replace(air=b.air._replace(inflow=0.0)) for b in rows[1]]
    return _Run(rows[0], rows[1], every * record.period)


def _row(model: Running, plant: Plant, state: Array, inputs: Inputs, i: int, end: int, period: float) -> _Row:
    body, gas = plant.body, (plant.front, plant.rear)[end]
    arm = (body.front_arm, -body.rear_arm)[end]
    top, axle, pressure = state[0] + arm * state[1], state[2 + end], state[8 + end]
    top_rate, axle_rate = state[4] + arm * state[5], state[6 + end]
    scale = (body.area_scale_front, body.area_scale_rear)[end]
    damping = (body.damping_front, body.damping_rear)[end]
    gauge = pressure - gas.ambient_pressure
    strut = strut_of(top, axle, top_rate, axle_rate, gauge, scale, damping, body, model.surface)
    inlet, outlet = inputs.commands[i, end], inputs.commands[i, 2 + end]
    air = air_of(pressure, strut.height, strut.rate, inlet, outlet, gas.supply_pressure, gas.supply_power, gas)
    slope = (inputs.road[i + 1, end] - inputs.road[i, end]) / period
    stiffness = (body.tyre_stiffness_front, body.tyre_stiffness_rear)[end]
    load = tyre_loads(body)[end]
    return _Row(strut, air, tyre_of(top, axle, top_rate, axle_rate, inputs.road[i, end], slope, stiffness, load))


def _along(model: Running, parts: Sequence[Active], run: _Run) -> Array:
    """Output of the parts' terms along the run, summed."""
    return np.sum([_term_along(model, part, run) for part in parts], axis=0)


def _term_along(model: Running, part: Active, run: _Run) -> Array:
    term = model.library[part.effect].term
    values = _values(model, part)
    if term is None or not any(part.values):
        return np.zeros(len(run.one))
    z: Any = (0.0,) * term.states
    out = np.empty(len(run.one))
    for i, (one, other) in enumerate(zip(run.one, run.other, strict=True)):
        seen = (one.air, other.air) if term.shared else (one.strut, one.air, one.tyre)
        if i == 0 and term.start is not None:
            z = term.start(*seen, values)
        elif term.advance is not None:
            z = term.advance(z, *seen, run.period, values)
        out[i] = _output(term, one, z, values)
    return out


def _tied(model: Running, part: Active, run: _Run) -> tuple[Array, Array]:
    """How far what is tied has moved, and its force: on the body, or on the front spring."""
    term, values = model.library[part.effect].term, _values(model, part)
    assert term is not None and term.start is not None
    hook = term.body or term.struts
    assert hook is not None
    ends = [(front.strut, rear.strut) for front, rear in zip(run.one, run.other, strict=True)]
    began = term.start(*ends[0], values)
    moved = [term.start(*both, values)[0] - began[0] for both in ends]
    forces = np.array([hook(*both, began, values) for both in ends])
    return np.array(moved), forces.sum(axis=1) if term.body is not None else forces[:, 0]


def _exchanged(model: Running, part: Active, run: _Run) -> tuple[Array, Array]:
    """Pressure that drives air to the rear spring, and what the front one gains by it."""
    term, values = model.library[part.effect].term, _values(model, part)
    assert term is not None and term.airs is not None
    gained = np.array([term.airs(front.air, rear.air, (), values)[0]
                       for front, rear in zip(run.one, run.other, strict=True)])  # fmt: skip
    over = [front.air.pressure - rear.air.pressure for front, rear in zip(run.one, run.other, strict=True)]
    return np.array(over), _flow(run.one, gained)


def _output(term: PlantTerm, row: _Row, z: Any, values: tuple[float, ...]) -> float:
    if term.force is not None:
        return float(term.force(row.strut, z, values))
    if term.tyre is not None:
        return float(term.tyre(row.tyre, z, values))
    if term.supply is not None:
        return float(term.supply(z, values))
    return float(term.air(row.air, z, values)) if term.air is not None else 0.0


def _values(model: Running, part: Active) -> tuple[float, ...]:
    effect = model.library[part.effect]
    if not effect.columns:
        return tuple(float(v) for v in part.values)
    whole = [0.0] * next(slot.parameters for slot in model.slots if slot.name == effect.place_in_kernel)
    for column, value in zip(effect.columns, part.values, strict=True):
        whole[column] = float(value)
    return tuple(whole)


def _step_response(model: Running, parts: Sequence[Active]) -> tuple[Array, Array]:
    period = STEP_TIME / STEP_ROWS
    u = np.ones((STEP_ROWS + 4, 6))
    u[:4] = 0.0
    for part in parts:
        effect: Effect = model.library[part.effect]
        if effect.outputs is not None:
            u = effect.outputs(u, period, (4,), part.values, None)[0]
        elif effect.inputs is not None:
            given = Inputs(u[:, :4], u[:, 4:])
            acted = effect.inputs(given, period, ends_of("both"), part.values, None)[0]
            u = np.column_stack([acted.commands, acted.road])
    column = 4 if model.library[parts[0].effect].outputs is not None or "exciter" in parts[0].effect else 0
    return np.asarray(np.arange(STEP_ROWS) * period), u[4:, column]


def ringing(part: Active, stiffness: float) -> Array:
    """Size of the answer of :mod:`pneumo_ros.effects.shapes.outside` at SWEPT; ``stiffness`` of a tyre, N/m."""
    size, frequency, damping_ratio, *more = part.values
    s = 1j * SWEPT / frequency
    answer = (1.0 + 2.0 * damping_ratio * s) / (s * s + 2.0 * damping_ratio * s + 1.0)
    if part.effect == "anything.body":
        return np.asarray(size * np.abs(answer))
    # Both tyres press with their stiffness times the road's height where the axles are held.
    return np.asarray(
        np.abs(2.0 * size / (s * s + 2.0 * damping_ratio * s + 1.0) - more[0] / stiffness * (answer - 1.0))
    )


def _openings(model: Running, record: Drive, parts: Sequence[Active]) -> tuple[Array, Array]:
    end = ends_of(parts[0].site).columns[0]
    given = Inputs(record.commands, record.road)
    acted = given
    for part in parts:
        hook = model.library[part.effect].inputs
        if hook is not None:
            acted = hook(acted, record.period, ends_of(part.site), part.values, None)[0]
    return given.commands[:, end].copy(), acted.commands[:, end].copy()


def _errors(model: Running, record: Drive, parts: Sequence[Active], over_time: bool) -> tuple[Array, Array]:
    channels = channels_of(parts[0].site)
    true = record.measured.copy()
    for part in reversed(parts):
        undo = model.library[part.effect].undo
        true = undo(true, channels_of(part.site), part.values) if undo is not None else true
    shown = true.copy()
    for part in parts:
        hook = model.library[part.effect].outputs
        if hook is not None:
            shown = hook(shown, record.period, channels_of(part.site), part.values, None)[0]
    time = np.asarray(record.period * np.arange(len(true)), dtype=float)
    x = time if over_time else true[:, channels[0]].copy()
    return x, (shown - true)[:, channels[0]]
