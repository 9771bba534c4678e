# SPDX-License-Identifier: Apache-2.0
"""Numbers to expect at the checks by hand that are no parameter of an effect, for the nominal rig.

One spring at design height, 72 cm3, holds air at 3 bar absolute and at the room's temperature; the supply is at 100
psig. Flow through an opening that chokes: 0.685 A P / sqrt(R T) (ISO 6358).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from pneumo_ros.effects.guide import Expected
from pneumo_ros.plant.air_spring import spring_volume
from pneumo_ros.units import GAS_CONSTANT, psig_to_pa_absolute

RATIO: Final = 1.4  # of air's specific heats [definition]
CHOKED: Final = math.sqrt(RATIO) * (2.0 / (RATIO + 1.0)) ** ((RATIO + 1.0) / (2.0 * (RATIO - 1.0)))  # [definition]
ROOM: Final = 293.15  # K; 20 degC [display]
CHECKED: Final = 3e5  # Pa absolute, pressure of the spring at the check [display]
HEIGHT: Final = 0.04572  # m, design height; Table 4.2
SUPPLY: Final = psig_to_pa_absolute(100.0)  # Pa; section 6.3
OPENED: Final = 2e-6  # m2, both inlets together at the check of the supply [display]
LEAST: Final = 1e-9  # of a parameter that divides [numerics]


def settling(p: Mapping[str, float]) -> float:
    """Time constant, s, in which the air of a spring that nothing moves takes its wall's temperature."""
    conductance = max(p["wall_conductance"], LEAST)
    return CHECKED * spring_volume(HEIGHT) / (ROOM * (RATIO - 1.0) * conductance)


def falling(p: Mapping[str, float]) -> float:
    """Rate, Pa/s, at which the pressure of a spring that nothing moves begins to fall."""
    flow = choked(p["leak_area"], CHECKED)
    return RATIO * GAS_CONSTANT * ROOM * flow / spring_volume(HEIGHT)


def sagged(p: Mapping[str, float]) -> float:
    """Pa by which the supply has sagged while both inlets stand open; the sagging takes from the flow."""
    share = p["supply_resistance"] * choked(OPENED, 1.0)
    return SUPPLY * share / (1.0 + share)


def choked(area: float, pressure: float) -> float:
    """Flow, kg/s, through an opening, m2, from a pressure, Pa absolute, to less than half of it."""
    return CHOKED * area * pressure / math.sqrt(GAS_CONSTANT * ROOM)


SETTLING, FALL, SAG = Expected(settling, "s"), Expected(falling, "Pa/s"), Expected(sagged, "Pa")
