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
# The rig's numbers that a fit may move within their tolerances.
NUISANCE = (
    "sprung_mass", "pitch_inertia", "unsprung_mass_front", "unsprung_mass_rear", "tyre_stiffness_front",
    "tyre_stiffness_rear", "bushing_damping", "supply_pressure", "outlet_area_front", "outlet_area_rear",
    "effective_area_scale", "volume_scale", "discharge_coefficient",
)  # fmt: skip
# What the rig has one number of for two parts of a kind. Its maker is unsure of the kind, and much less of how the two
# differ: they share what the number is off by, and half their difference, as a share of their mean, has a tolerance of
# its own (``end_difference``). Were each free by itself, a difference that no draw of the number makes would count as
# one: an orifice that is worn at one end, or a load that is not where it should be.
SHARED = ("bushing_damping", "effective_area_scale", "volume_scale", "discharge_coefficient")
# Beside them the slope of V(h): a common factor alone would make V/(dV/dh), the air's stiffness, exact.
SLOPE = "volume_slope"
SPLIT = "_split"
UNLIKE = "where the two ends' parts are not alike, state end_difference: {value: 1, unit: '1'} in the rig file"


@lru_cache(maxsize=32)
def nominal_plant(rig: Rig, step: float) -> HalfCar:
    """The half car at a rig's nominal values; ``step`` is the longest RK4 step, s."""
    own = dict(rig.ends)
    given = [own.get(f"reference_pressure_{end}") for end in ("front", "rear")]
    front, rear = (v if v is not None else trim(rig).pressures[k] for k, v in enumerate(given))
    return half_car(rig, (front, rear), step=step)


def stated(rig: Rig) -> dict[str, float]:
    """What the rig states each nuisance parameter to be, SI, among it what its ends have of their own."""
    own = dict(rig.ends)
    values = {name: own.get(name, getattr(rig, name).value) for name in NUISANCE}
    for name in (*SHARED, SLOPE):
        front, rear = (own.get(f"{name}_{end}", values.get(name, 1.0)) for end in ("front", "rear"))
        values[name] = 0.5 * (front + rear)
        values[name + SPLIT] = (front - rear) / (front + rear) if front + rear else 0.0
    return values


def of_ends(values: Mapping[str, float]) -> dict[str, float]:
    """What each end has of its own, by the names of a rig file's ``ends:``, of nuisance parameters by name."""
    own = {name: value for name, value in values.items() if name.startswith("outlet_area")}
    for name in (*SHARED, SLOPE):
        if name in values:
            split = values.get(name + SPLIT, 0.0)
            own[f"{name}_front"], own[f"{name}_rear"] = values[name] * (1.0 + split), values[name] * (1.0 - split)
    return own


def plant_with(rig: Rig, base: HalfCar, values: Mapping[str, float]) -> Plant:
    """The nominal plant with other values of nuisance parameters, SI by name; the others as the rig states them."""
    v = {**stated(rig), **values}
    own = of_ends(v)
    body = base.body
    body = body._replace(
        **{name: v[name] for name in body._fields if name in v},
        damping_front=own["bushing_damping_front"],
        damping_rear=own["bushing_damping_rear"],
        area_scale_front=own["effective_area_scale_front"],
        area_scale_rear=own["effective_area_scale_rear"],
    )
    supply = v["supply_pressure"]
    return Plant(body, _gas(rig, base.front, own, supply, "front"), _gas(rig, base.rear, own, supply, "rear"))


def _gas(rig: Rig, gas: Gas, own: Mapping[str, float], supply: float, end: str) -> Gas:
    volume = own[f"volume_scale_{end}"]
    slope = volume * own[f"{SLOPE}_{end}"]
    level = VOLUME_OFFSET + MEAN_AREA * rig.design_height.value
    coefficient = own[f"discharge_coefficient_{end}"]
    # The log carries the commanded outlet; the estimate is of the opening that the nominal command really gives.
    nominal = getattr(rig, f"outlet_area_{end}").value
    opening = own[f"outlet_area_{end}"] / nominal if nominal > 0.0 else 1.0
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
    found, centre = [], stated(rig)
    share = rig.end_difference.value
    for name in NUISANCE:
        q = getattr(rig, name)
        if q.std > 0.0:
            found.append(Parameter(name, q.unit, centre[name], q.std))
        if name in SHARED and q.value and share * q.std > 0.0:
            std, known = share * q.std / abs(q.value), share < 1.0
            found.append(Parameter(name + SPLIT, "1", centre[name + SPLIT], std, 1.0 / share if known else 1.0,
                                   UNLIKE if known else ""))  # fmt: skip
    slope = SLOPE_SHARE * rig.volume_scale.std
    if slope > 0.0:  # no number of the rig's: what the springs' curves differ by is as open as what they have in common
        found += [Parameter(name, "1", centre[name], slope) for name in (SLOPE, SLOPE + SPLIT)]
    found.append(Parameter(COMMAND_DELAY, "s", 0.0, COMMAND_DELAY_STD))
    return tuple(found)
