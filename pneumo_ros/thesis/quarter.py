# SPDX-License-Identifier: Apache-2.0
"""The quarter-car experiments of Sections 6.3 to 6.6: one run by name, and its figures."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from pneumo_ros.plant.air_spring import effective_area
from pneumo_ros.ride.comfort import mean_personal_rating, rms
from pneumo_ros.rig import load_rig
from pneumo_ros.road import LENGTH_SCALE, make_road
from pneumo_ros.thesis.models.quarter_car import QuarterCar, QuarterTrim, constant_area_surface, quarter_car
from pneumo_ros.thesis.models.quarter_car_control import QuarterRun, coast_quarter, drive_quarter, quarter_law
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.units import GRAVITY, INCH, SQUARE_INCH

CYLINDER_AREA = 5.0 * SQUARE_INCH  # Section 6.3


@dataclass(frozen=True)
class Experiment:
    """A controlled quarter car over the settings' roads.

    Attributes
    ----------
    law : name of a control law, or "passive"
    cylinder : a pneumatic cylinder of 5 in2 instead of the air spring
    options : keyword arguments of :func:`pneumo_ros.thesis.models.quarter_car_control.quarter_law`
    """

    law: str
    cylinder: bool = False
    options: dict[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome:
    """Figures of an experiment over all its roads, full scale where it says so.

    Attributes
    ----------
    rms_g : full-scale rms of the sprung acceleration after the settling time, g
    rating : MPR of it
    rise : time to 90 % of the rise from the start height, s, mean over roads
    overshoot_in : largest heave above the target in the first 3 s, in, mean over roads
    offset_in : mean heave error in the second half, in
    area_error_in2 : rms error of the area estimate after 0.5 s, in2
    saturated : share of time the inlet is fully open or shut
    peak_inlet_in2 : 99.9th percentile of the inlet opening, in2
    least_tyre_force : smallest tyre force after the first second, N
    tyre_variation : standard deviation of the tyre force over its static value
    """

    rms_g: float
    rating: float
    rise: float
    overshoot_in: float
    offset_in: float
    area_error_in2: float
    saturated: float
    peak_inlet_in2: float
    least_tyre_force: float
    tyre_variation: float


@lru_cache(maxsize=4)
def plant(settings: ThesisSettings, cylinder: bool) -> tuple[QuarterCar, QuarterTrim]:
    """The settings' quarter car, on the air spring or on a cylinder."""
    rig = load_rig().with_values(
        bushing_damping=settings.quarter_damping, outlet_area_front=settings.quarter_outlet_in2 * SQUARE_INCH
    )
    if cylinder:
        return quarter_car(rig, settings.quarter_mass, constant_area_surface(CYLINDER_AREA), CYLINDER_AREA)
    return quarter_car(rig, settings.quarter_mass)


@lru_cache(maxsize=32)
def road_of(settings: ThesisSettings, seed: int) -> NDArray[np.float64]:
    """Front road of a seed at the control periods, (N + 1,), m."""
    times = np.arange(settings.periods + 1) * settings.period
    return make_road(settings.road(seed)).sample(times)[0][:, 0]


def at_rest(car: QuarterCar, trim: QuarterTrim, height: float) -> NDArray[np.float64]:
    """State (5,) at rest with the spring at another height, m: the pressure that carries the mass there."""
    load, ambient = car.corner.sprung_mass * GRAVITY, car.gas.ambient_pressure

    def missing(gauge: float) -> float:
        return gauge * float(effective_area(height, gauge, car.surface)) - load

    state = trim.state.copy()
    state[0] = state[1] + height
    state[4] = float(brentq(missing, 1.0, car.gas.supply_pressure - ambient)) + ambient
    return state


def run(settings: ThesisSettings, experiment: Experiment, seed: int) -> QuarterRun:
    """One experiment over one road."""
    car, trim = plant(settings, experiment.cylinder)
    road = road_of(settings, seed)
    if experiment.law == "passive":
        return coast_quarter(car, trim, road, settings.period)
    law = quarter_law(
        car,
        trim,
        experiment.law,
        period=settings.period,
        inlet_max=load_rig().inlet_area_max.value,
        **{"forgetting": settings.estimator_bandwidth, **experiment.options},  # type: ignore[arg-type]
    )
    return drive_quarter(car, at_rest(car, trim, settings.start_height_in * INCH), law, road)


def measure(job: tuple[ThesisSettings, Experiment]) -> Outcome:
    """The figures of an experiment over all roads of the settings; one argument, so that processes can map it."""
    settings, experiment = job
    runs = [run(settings, experiment, seed) for seed in range(1, settings.seeds + 1)]
    car, trim = plant(settings, experiment.cylinder)
    after = settings.settled
    full = rms(np.concatenate([r.acceleration[after:] for r in runs])) * LENGTH_SCALE
    inlets = np.concatenate([r.inlets[after:] for r in runs])
    limit = load_rig().inlet_area_max.value
    force = np.stack([car.corner.tyre_stiffness * (r.road - r.states[:, 1]) for r in runs])
    static = (car.corner.sprung_mass + car.corner.unsprung_mass) * GRAVITY
    half = round(0.5 / settings.period)
    errors = np.concatenate([(r.estimated_areas - r.areas)[half:] for r in runs])
    heave = np.stack([(r.states[:, 0] - trim.state[0]) for r in runs])
    return Outcome(
        rms_g=full / GRAVITY,
        rating=mean_personal_rating(full),
        rise=float(np.mean([_rise_time(h, settings.period) for h in heave])),
        overshoot_in=float(np.mean(heave[:, :after].max(axis=1))) / INCH,
        offset_in=float(heave[:, heave.shape[1] // 2 :].mean()) / INCH,
        area_error_in2=rms(errors) / SQUARE_INCH,
        saturated=float(np.mean((inlets <= 0.0) | (inlets >= limit))),
        peak_inlet_in2=float(np.quantile(inlets, 0.999)) / SQUARE_INCH,
        least_tyre_force=float(force[:, round(1.0 / settings.period) :].min()),
        tyre_variation=float(force[:, after:].std()) / static,
    )


def _rise_time(heave: NDArray[np.float64], period: float) -> float:
    """Time to 90 % of the way from the start to the target, s (the whole run if never)."""
    reached = np.flatnonzero(heave >= 0.1 * heave[0])
    return float(reached[0] if reached.size else len(heave)) * period
