# SPDX-License-Identifier: Apache-2.0
"""The half car's nuisance parameters: which of the rig's numbers have a tolerance, and the plant that they give."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from pneumo_ros.effects.contract import Plant
from pneumo_ros.effects.parameters import Parameter
from pneumo_ros.plant.air_spring import MEAN_AREA, VOLUME_OFFSET, Gas
from pneumo_ros.plant.half_car import HalfCar, half_car
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import Rig

# The log stamps commands no finer than a sample and says nothing of the bus: a shift of all commands within a sample
# is no effect.
COMMAND_DELAY = "command_delay"
COMMAND_DELAY_STD = 1.5e-4  # s; rigs without a fault show up to 0.12 ms
SLOPE_SHARE = 0.5  # of the volume scale's tolerance, for the slope of V(h) about the design height
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


@lru_cache(maxsize=32)
def nominal_plant(rig: Rig, step: float) -> HalfCar:
    """The half car at a rig's nominal values; ``step`` is the longest RK4 step, s."""
    own = dict(rig.ends)
    given = [own.get(f"reference_pressure_{end}") for end in ("front", "rear")]
    front, rear = (v if v is not None else trim(rig).pressures[k] for k, v in enumerate(given))
    return half_car(rig, (front, rear), step=step)


def plant_with(rig: Rig, base: HalfCar, v: Mapping[str, float]) -> Plant:
    """The nominal plant with other values ``v`` of nuisance parameters, SI by name."""
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


def nuisance_parameters(rig: Rig) -> tuple[Parameter, ...]:
    """Nuisance parameters of a rig; a quantity without tolerance is exact and stays."""
    found, own = [], dict(rig.ends)
    for name, source in NUISANCE.items():
        q = getattr(rig, source)
        if q.std > 0.0:
            found.append(Parameter(name, q.unit, own.get(name, q.value), q.std))
    slope = SLOPE_SHARE * rig.volume_scale.std
    slopes = [f"volume_slope_{end}" for end in ("front", "rear")] if slope > 0.0 else []
    found += [Parameter(name, "1", own.get(name, 1.0), slope) for name in slopes]
    found.append(Parameter(COMMAND_DELAY, "s", 0.0, COMMAND_DELAY_STD))
    return tuple(found)
