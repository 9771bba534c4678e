# SPDX-License-Identifier: Apache-2.0
"""What each parameter of the rig means, its unit and its allowed range."""

from __future__ import annotations

from dataclasses import dataclass

from pneumo_ros.documents import LARGEST
from pneumo_ros.errors import InputError


@dataclass(frozen=True)
class Limit:
    """Unit and allowed range (inclusive) of a rig parameter, with what it means."""

    unit: str
    low: float
    high: float
    meaning: str


LIMITS: dict[str, Limit] = {
    "design_height": Limit("m", 0.0305, 0.0558, "air spring height both ends are levelled to"),
    "sprung_mass": Limit("kg", 1.0, 1000.0, "body with payload"),
    "pitch_inertia": Limit("kg m2", 0.01, 1000.0, "body's moment of inertia about its centre of mass"),
    "front_arm": Limit("m", 0.01, 5.0, "centre of mass to front axle"),
    "rear_arm": Limit("m", 0.01, 5.0, "centre of mass to rear axle"),
    "unsprung_mass_front": Limit("kg", 0.05, 200.0, "front axle with wheel"),
    "unsprung_mass_rear": Limit("kg", 0.05, 200.0, "rear axle with wheel"),
    "tyre_stiffness_front": Limit("N/m", 100.0, 1e7, "front tyre, linear"),
    "tyre_stiffness_rear": Limit("N/m", 100.0, 1e7, "rear tyre, linear"),
    "bushing_damping": Limit("N s/m", 0.0, 1e5, "viscous damping between body and axle, each end"),
    "polytropic_exponent": Limit("1", 1.0, 1.67, "of the air in spring and orifices"),
    "supply_temperature": Limit("K", 200.0, 400.0, "stagnation temperature of the supply"),
    "supply_pressure": Limit("Pa", 110e3, 3e6, "absolute"),
    "ambient_pressure": Limit("Pa", 50e3, 110e3, "absolute"),
    "outlet_area_front": Limit("m2", 0.0, 1e-4, "constant opening to the atmosphere"),
    "outlet_area_rear": Limit("m2", 0.0, 1e-4, "constant opening to the atmosphere"),
    "inlet_area_max": Limit("m2", 1e-8, 1e-3, "fully open inlet valve"),
    "effective_area_scale": Limit("1", 0.2, 5.0, "factor on the effective area surface"),
    "volume_scale": Limit("1", 0.2, 5.0, "factor on the air spring volume"),
    "discharge_coefficient": Limit("1", 0.05, 2.0, "factor on every orifice area"),
    "displacement_noise": Limit("m", 0.0, 0.01, "standard deviation of white LVDT noise"),
    "pressure_noise": Limit("Pa", 0.0, 1e5, "standard deviation of white pressure noise"),
    "length_scale": Limit("1", 0.01, 100.0, "full-scale vehicle over the rig, in length; time scale 1"),
    "model_form": Limit(
        "1", 0.0, 0.5, "share of each channel's std below which a difference is no effect to its maker"
    ),
    "end_difference": Limit(
        "1", 0.0, 3.0, "half the difference of both ends where they share a number, as a share of that number's std"
    ),
}

OPTIONAL = {"length_scale": 5.0, "model_form": 0.0, "end_difference": 0.2}
"""Numbers that a text may leave out, and what that means: the first is the thesis's Honda Civic over its rig, the last
two parts of a kind, which differ by less than their maker knows the kind."""

# What an end may have of its own where the rig has one number for both, or where the command is not what happens.
END_LIMITS: dict[str, Limit] = {
    f"{name}_{end}": limit
    for end in ("front", "rear")
    for name, limit in {
        **{name: LIMITS[name] for name in
           ("bushing_damping", "effective_area_scale", "volume_scale", "discharge_coefficient")},
        "outlet_area": Limit("m2", 0.0, 1e-4, "opening that the commanded outlet area of ``rig:`` really gives"),
        "volume_slope": Limit("1", 0.2, 5.0, "factor on dV/dh about the design height"),
        "reference_pressure": Limit("Pa", 50e3, 3e6, "absolute; where the air has the supply's temperature (Eq. 4.17)"),
    }.items()
}  # fmt: skip


def limit_of(name: str, where: str) -> Limit:
    """Limit of a parameter; InputError for a name that is none."""
    if name not in LIMITS:
        raise InputError(
            "unknown rig parameter",
            where=where,
            key=name,
            allowed=", ".join(LIMITS),
            remedy="correct the name or remove it",
        )
    return LIMITS[name]


def checked(name: str, raw: object, where: str) -> float:
    """The value of a parameter, finite and in its range; else InputError."""
    limit = limit_of(name, where)
    value = number(name, raw, where)
    if not limit.low <= value <= limit.high:
        raise InputError(
            "value out of range",
            where=where,
            key=name,
            value=value,
            allowed=f"{limit.low:g} to {limit.high:g} {limit.unit}",
            remedy="check value and unit",
        )
    return value


def number(key: str, raw: object, where: str) -> float:
    """A finite number; else InputError."""
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not abs(raw) <= LARGEST:
        raise InputError(
            "not a finite number",
            where=where,
            key=key,
            value=raw,
            allowed="a finite number",
            remedy="write it like 1.4 or 1.0e-05",
        )
    return float(raw)
