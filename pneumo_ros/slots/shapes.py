# SPDX-License-Identifier: Apache-2.0
"""The shape of each family (a cone of atoms) and whatever may act at a slot, by kind: columns of its values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pneumo_ros.slots import flow as fl
from pneumo_ros.slots import force as fo
from pneumo_ros.slots import signal as si
from pneumo_ros.slots.laws import Measures, cooling, without_limit


@dataclass(frozen=True)
class Row:
    """Atoms of one sort: their columns, unit and typical amplitude.

    ``signed`` : a family that holds them may use them with either sign; ``most`` : largest value that nature allows it
    """

    name: str
    first: int
    count: int
    unit: str
    typical: Callable[[Measures], float]
    signed: bool = False
    most: Callable[[Measures], float] = without_limit

    def columns(self, start: int = 0, stop: int | None = None) -> tuple[int, ...]:
        """Some or all of its columns."""
        return tuple(range(self.first, self.first + self.count))[start:stop]


def _size(m: Measures) -> float:
    return m.size


def _per_rate(m: Measures) -> float:
    return m.size / m.rate


def _per_square(m: Measures) -> float:
    return m.size / m.rate**2


def _per_travel(m: Measures) -> float:
    return m.size / m.travel


def _share(m: Measures) -> float:
    return m.size / m.load


def _per_pressure(m: Measures) -> float:
    return m.size / m.high


OUT = Row("friction_out", fo.OUT, fo.FEW, "{unit}", _size)
IN = Row("friction_in", fo.IN, fo.FEW, "{unit}", _size)
LINEAR = Row("damping", fo.LINES, 2, "{unit} s/{travel}", _per_rate)
SQUARES = Row("damping squared", fo.LINES + 2, 2, "{unit} s2/{travel}2", _per_square)
LOADED = Row("load_friction", fo.LOAD_RAMP, 1, "{unit}", _size)
SLIDERS = Row("slider", fo.SLID, 5, "{unit}", _size)
BELOW = Row("stop below", fo.BELOW, fo.STEPS, "{unit}/{travel}", lambda m: 5.0 * m.size / m.travel)
ABOVE = Row("stop above", fo.ABOVE, fo.STEPS, "{unit}/{travel}", lambda m: 5.0 * m.size / m.travel)
TOUCH = Row("touch", fo.TOUCH, 2, "{unit} s/{travel}", _per_rate)
POWERS = Row("stiffness", fo.POWERS, 3, "{unit}/{travel}", _per_travel, signed=True)
CENTRE = Row("play", fo.CENTRE, 3, "{unit}/{travel}", _per_travel)
FADING = Row("fading", fo.LAGGED, 3, "{unit}/{travel}", _per_travel)
STEADY = Row("constant", fo.STEADY, 1, "{unit}", _size, signed=True)

HOLE = Row("hole", fl.A_HOLE, 2, "{unit}/{travel}", _per_pressure)
OPENS = Row("hole that opens", fl.OPENS, 4, "{unit}/{travel}", _per_pressure)
FLOWS = Row("share", fl.A_FLOW, 4, "1", _share, signed=True)
RELIEFS = Row("relief", fl.RELIEFS, 4, "{unit}/{travel}", lambda m: 3.0 * m.size / m.travel)
DROOPS = Row("droop", fl.DROOPS, 3, "1", _share)
HEATS = Row("settling", fl.HEATS, 4, "{unit} s", lambda m: 0.1 * m.size * m.whole, signed=True, most=cooling)
CONSTANT_FLOW = Row("constant", fl.STEADY, 1, "{unit}", _size, signed=True)

VALUES = Row("power", si.POWERS, 4, "1", lambda m: 0.03, signed=True)
CORNERS = Row("dead below", si.CORNERS, 3, "1", lambda m: 0.3)
LIMITS = Row("limit", si.LIMITS, 3, "1", lambda m: 0.3)
PLAYS = Row("play", si.PLAYS, 3, "1", lambda m: 0.3)
LAGS = Row("lag", si.LAGS, 4, "1", lambda m: 0.3)
DELAYS = Row("delay", si.DELAYS, 3, "1", lambda m: 0.3)
CREEPS = Row("creep", si.CREEPS, 4, "{unit}", lambda m: 0.1 * m.travel, signed=True)

FORCE_ROWS = (OUT, IN, LINEAR, SQUARES, LOADED, SLIDERS, BELOW, ABOVE, TOUCH, POWERS, FADING, STEADY)
ROWS: dict[str, tuple[Row, ...]] = {
    "force": FORCE_ROWS,
    "contact": (*FORCE_ROWS, CENTRE),
    "flow": (HOLE, OPENS, FLOWS, RELIEFS, DROOPS, HEATS, CONSTANT_FLOW),
    "input": (VALUES, CORNERS, LIMITS, PLAYS, LAGS, DELAYS),
    "sensor": (VALUES, LIMITS, LAGS, DELAYS, CREEPS),
}
_FORCE = {
    "coulomb_friction": (*OUT.columns(0, 4), *IN.columns(0, 4), *LOADED.columns(), *SLIDERS.columns(0, 3)),
    "viscous_damping": (*OUT.columns(4), *IN.columns(4), *LINEAR.columns(), *SQUARES.columns()),
    "hysteresis": SLIDERS.columns(2),
    "stop": (*BELOW.columns(), *ABOVE.columns(), *TOUCH.columns()),
    "spring_error": POWERS.columns(),
    "relaxation": FADING.columns(),
}
_SIGNAL = {
    "lag": (*LAGS.columns(), *DELAYS.columns(0, 1)),
    "saturation": LIMITS.columns(),
    "curvature": VALUES.columns(1),
}
CONES: dict[str, dict[str, tuple[int, ...]]] = {
    "force": _FORCE,
    "contact": {**_FORCE, "backlash": CENTRE.columns()},
    "flow": {
        "leak": (*HOLE.columns(), *OPENS.columns()),
        "flow_coefficient": FLOWS.columns(),
        "relief": RELIEFS.columns(),
        "droop": DROOPS.columns(),
        "heat": HEATS.columns(),
    },
    "input": {
        **_SIGNAL, "gain": VALUES.columns(1), "dead_zone": CORNERS.columns(), "backlash": PLAYS.columns(),
    },
    "sensor": {**_SIGNAL, "scale": VALUES.columns(1), "offset": CREEPS.columns()},
}  # fmt: skip
