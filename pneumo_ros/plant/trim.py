# SPDX-License-Identifier: Apache-2.0
"""Static equilibrium: the pressures that carry the body at design height and the inlet openings that hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.errors import InputError
from pneumo_ros.plant.air_spring import AreaSurface, Gas, effective_area, inlet_flow, load_surface, outlet_flow
from pneumo_ros.plant.half_car import HalfCar, gas_of, half_car
from pneumo_ros.rig import Rig
from pneumo_ros.units import GRAVITY, PSI


@dataclass(frozen=True)
class Trim:
    """A rig at rest on a flat road at design height.

    Attributes
    ----------
    state : (10,) of :mod:`pneumo_ros.plant.equations`
    inlets : front and rear inlet openings that balance the outlets, m2
    outlets : front and rear outlet openings, m2
    pressures : front and rear, Pa absolute
    """

    state: NDArray[np.float64]
    inlets: tuple[float, float]
    outlets: tuple[float, float]
    pressures: tuple[float, float]

    @property
    def command(self) -> NDArray[np.float64]:
        """(4,) front inlet, rear inlet, front outlet, rear outlet, m2."""
        return np.array([*self.inlets, *self.outlets])


def trim(rig: Rig, surface: AreaSurface | None = None) -> Trim:
    """Static state of a rig, each spring its own reference temperature (T2 = T1 at rest).

    Raises
    ------
    InputError
        if no pressure below the supply carries the load, or the inlet would have to open beyond its maximum.
    """
    surface = surface or load_surface()
    a, b, weight = rig.front_arm.value, rig.rear_arm.value, rig.sprung_mass.value * GRAVITY
    loads = (weight * b / (a + b), weight * a / (a + b))
    pressures = tuple(
        _pressure_for(load, rig, surface, side) for load, side in zip(loads, ("front", "rear"), strict=True)
    )
    outlets = (rig.outlet_area_front.value, rig.outlet_area_rear.value)
    inlets = tuple(
        _inlet_for(outlet, pressure, gas_of(rig, pressure), rig, side)
        for outlet, pressure, side in zip(outlets, pressures, ("front", "rear"), strict=True)
    )
    axles = (
        -(loads[0] + rig.unsprung_mass_front.value * GRAVITY) / rig.tyre_stiffness_front.value,
        -(loads[1] + rig.unsprung_mass_rear.value * GRAVITY) / rig.tyre_stiffness_rear.value,
    )
    tops = [axle + rig.design_height.value for axle in axles]
    pitch = (tops[0] - tops[1]) / (a + b)
    heave = tops[0] - a * pitch
    state = np.array([heave, pitch, *axles, 0.0, 0.0, 0.0, 0.0, *pressures])
    return Trim(state, (inlets[0], inlets[1]), outlets, (pressures[0], pressures[1]))


def nominal_half_car(rig: Rig, surface: AreaSurface | None = None) -> tuple[HalfCar, Trim]:
    """The half car of a rig and its trim, the reference pressures taken from that trim."""
    at_rest = trim(rig, surface)
    return half_car(rig, at_rest.pressures, surface), at_rest


def _pressure_for(load: float, rig: Rig, surface: AreaSurface, side: str) -> float:
    height, scale, ambient = rig.design_height.value, rig.effective_area_scale.value, rig.ambient_pressure.value

    def missing(gauge: float) -> float:
        return gauge * scale * float(effective_area(height, gauge, surface)) - load

    top = rig.supply_pressure.value - ambient
    if missing(top) <= 0.0 or missing(0.1 * PSI) >= 0.0:
        raise InputError(
            f"impossible trim: the {side} spring cannot carry {load:.4g} N at {height:.4g} m",
            where=rig.name,
            key="supply_pressure",
            value=rig.supply_pressure.value,
            allowed=f"a gauge pressure between {0.1 * PSI:.4g} Pa and the supply's {top:.4g} Pa that balances the load",
            remedy="raise supply_pressure or lower sprung_mass or design_height",
        )
    from scipy.optimize import brentq  # here: slow to import, and wanted once a rig

    return float(brentq(missing, 0.1 * PSI, top, xtol=1e-7, rtol=1e-14)) + ambient


def _inlet_for(outlet: float, pressure: float, gas: Gas, rig: Rig, side: str) -> float:
    out = float(outlet_flow(outlet, pressure, 1.0, gas))
    per_area = float(inlet_flow(1.0, pressure, 1.0, gas))
    limit = rig.inlet_area_max.value
    if per_area <= 0.0 or out / per_area > limit:
        need = float("inf") if per_area <= 0.0 else out / per_area
        raise InputError(
            f"impossible trim: the {side} inlet would have to open {need:.4g} m2",
            where=rig.name,
            key="inlet_area_max",
            value=limit,
            allowed=f">= {need:.4g} m2",
            remedy=f"reduce outlet_area_{side} or raise supply_pressure",
        )
    return out / per_area
