# SPDX-License-Identifier: Apache-2.0
"""The half-car experiments of Section 6.7 and beyond: one run by name, and how its ride is judged."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.control.half_car import build_controller
from pneumo_ros.control.loop import Run, close_loop
from pneumo_ros.control.presets import PRESETS
from pneumo_ros.estimation.half_car import build_estimator
from pneumo_ros.parameters import Value
from pneumo_ros.plant.air_spring import effective_area
from pneumo_ros.plant.half_car import HalfCar, half_car
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.ride.comfort import Ride, judge, rms
from pneumo_ros.rig import Rig, load_rig
from pneumo_ros.rig.channels import spring_heights
from pneumo_ros.road import LENGTH_SCALE, make_road
from pneumo_ros.thesis.comfort_limits import healey, janeway_use, permitted_hours, third_octaves, weighted_rms
from pneumo_ros.thesis.models.conventional import Conventional, conventional_rates, simulate_conventional
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.units import GRAVITY, INCH, SQUARE_INCH

CONVENTIONAL = ("conventional passive", "conventional skyhook")
CIVIC_STIFFNESS = (117.51e3 / 12.0, 137.124e3 / 12.0)  # N/m, Table 3.3 over C_k = 12 (Eq. 3.51)
DAMPING_RATIO = 0.25  # of each corner; Table 3.3 gives no dampers


@dataclass(frozen=True)
class HalfExperiment:
    """A half car over the settings' roads.

    Attributes
    ----------
    preset : of :data:`pneumo_ros.control.presets.PRESETS`, or one of :data:`CONVENTIONAL`
    estimator, controller : values over the preset's
    exact : true rates and accelerations, no noise: the thesis's simulation; False is the rig's sensors
    height_error_in : what both height sensors read too much, in (Section 6.7.5: 0.2)
    delay : periods between sample and valve
    off : rig values that the plant has and the controller does not know of
    """

    preset: str
    estimator: dict[str, Value] = field(default_factory=dict)
    controller: dict[str, Value] = field(default_factory=dict)
    exact: bool = False
    height_error_in: float = 0.0
    delay: int = 0
    off: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class HalfOutcome:
    """Figures of an experiment: per road where named so, else over all roads.

    Attributes
    ----------
    rides : one a road
    heave_rms, pitch_rms : over all roads, m/s2 and rad/s2 of the rig
    rating, weighted, hours, janeway, healey : of the full-scale heave; weighted in m/s2 (Wk), hours of the 1972 limit
    inlet_rms_in2, inlet_peak_in2 : front and rear, in2
    saturated, shut : share of time an inlet is fully open, and shut
    area_error_in2 : rms error of the area estimates after 1 s, in2
    tyre_mean : mean tyre forces front and rear, N
    """

    rides: tuple[Ride, ...]
    heave_rms: float
    pitch_rms: float
    rating: float
    weighted: float
    hours: float
    janeway: float
    healey: str
    inlet_rms_in2: tuple[float, float]
    inlet_peak_in2: tuple[float, float]
    saturated: float
    shut: float
    area_error_in2: float
    tyre_mean: tuple[float, float]

    @property
    def tyre_variation(self) -> float:
        """Tyre load variation, mean over axles and roads."""
        return float(np.mean([ride.tyre_load_variation for ride in self.rides]))

    @property
    def workspace_in(self) -> float:
        """Suspension travel, largest of axles and roads, in."""
        return max(max(ride.workspace) for ride in self.rides) / INCH


@lru_cache(maxsize=1)
def nominal() -> tuple[Rig, HalfCar]:
    """The nominal rig and its half car."""
    rig = load_rig()
    return rig, nominal_half_car(rig)[0]


@lru_cache(maxsize=32)
def road_of(settings: ThesisSettings, seed: int) -> NDArray[np.float64]:
    """Front and rear road of a seed at the control periods, (N + 1, 2), m."""
    times = np.arange(settings.periods + 1) * settings.period
    return make_road(settings.road(seed)).sample(times)[0]


def run(settings: ThesisSettings, experiment: HalfExperiment, seed: int) -> Run:
    """A pneumatic experiment over one road."""
    rig, car = nominal()
    if experiment.off:
        car = half_car(rig.with_values(**experiment.off), (car.front.reference_pressure, car.rear.reference_pressure))
    preset = PRESETS[experiment.preset]
    estimator = build_estimator(rig, settings.period, {**preset.estimator, **experiment.estimator})
    controller = build_controller(rig, settings.period, {**preset.controller, **experiment.controller})
    sensors = rig.with_values(displacement_noise=0.0, pressure_noise=0.0) if experiment.exact else rig
    error = -experiment.height_error_in * INCH  # an axle read too low is a spring read too high
    return close_loop(
        car,
        sensors,
        estimator,
        controller,
        road_of(settings, seed),
        seed=seed,
        delay=experiment.delay,
        exact=experiment.exact,
        offsets=(0.0, 0.0, error, error, 0.0, 0.0),
    )


def measure(job: tuple[ThesisSettings, HalfExperiment]) -> HalfOutcome:
    """The figures of an experiment over all roads of the settings; one argument, so that processes can map it."""
    settings, experiment = job
    seeds = range(1, settings.seeds + 1)
    if experiment.preset in CONVENTIONAL:
        motions = [_conventional(settings, experiment.preset, seed) for seed in seeds]
        return _outcome(settings, motions, [], [])
    runs = [run(settings, experiment, seed) for seed in seeds]
    return _outcome(settings, [_motion(r, settings) for r in runs], runs, [_area_error(r, settings) for r in runs])


def heave_of(settings: ThesisSettings, experiment: HalfExperiment) -> NDArray[np.float64]:
    """Heave acceleration of the rig over the first road, after the settling time, m/s2."""
    if experiment.preset in CONVENTIONAL:
        return _conventional(settings, experiment.preset, 1).heave
    return _motion(run(settings, experiment, 1), settings).heave


@dataclass(frozen=True)
class _Motion:
    """What a ride is judged by, after the settling time."""

    heave: NDArray[np.float64]
    pitch: NDArray[np.float64]
    tyres: NDArray[np.float64]
    heights: NDArray[np.float64]
    static: tuple[float, float]


def _motion(r: Run, settings: ThesisSettings) -> _Motion:
    _, car = nominal()
    body, after = car.body, settings.settled
    x = r.states[after:]
    heights = np.column_stack(spring_heights(x, body.front_arm, body.rear_arm))
    tyres = np.array([body.tyre_stiffness_front, body.tyre_stiffness_rear]) * (r.road[after:] - x[:, 2:4])
    acceleration = np.gradient(r.states[:, 4:6], settings.period, axis=0)[after:]
    return _Motion(acceleration[:, 0], acceleration[:, 1], tyres, heights, _static_loads())


def _static_loads() -> tuple[float, float]:
    body = nominal()[1].body
    share = body.sprung_mass / (body.front_arm + body.rear_arm)
    return (
        (share * body.rear_arm + body.unsprung_mass_front) * GRAVITY,
        (share * body.front_arm + body.unsprung_mass_rear) * GRAVITY,
    )


def conventional_car(skyhook: bool) -> Conventional:
    """The scaled Honda Civic on its own springs (Table 3.3 / 12), dampers of ratio 0.25, or skyhook ones.

    The sky's damper has ratio 0.7; the controllable ones give from 0.05 to 1.
    """
    rig, car = nominal()
    body = car.body
    front, rear = (load / GRAVITY for load in _static_loads())
    unit = [2.0 * np.sqrt(k * m) for k, m in zip(CIVIC_STIFFNESS, (front - 4.54, rear - 4.54), strict=True)]
    ratio = 0.05 if skyhook else DAMPING_RATIO
    return Conventional(
        body.sprung_mass,
        body.pitch_inertia,
        body.front_arm,
        body.rear_arm,
        body.unsprung_mass_front,
        body.unsprung_mass_rear,
        *CIVIC_STIFFNESS,
        ratio * unit[0],
        ratio * unit[1],
        rig.tyre_stiffness_front.value,
        rig.tyre_stiffness_rear.value,
        skyhook=0.7 * float(np.mean(unit)) if skyhook else 0.0,
        damping_max=float(np.mean(unit)) if skyhook else 0.0,
    )


def _conventional(settings: ThesisSettings, name: str, seed: int) -> _Motion:
    car, road = conventional_car(name == "conventional skyhook"), road_of(settings, seed)
    x = simulate_conventional(np.zeros(8), road, settings.period, 4, car)
    after = settings.settled
    rates = np.array([
        conventional_rates(tuple(row), *heights, car)[4:6] for row, heights in zip(x[after:], road[after:], strict=True)
    ])  # fmt: skip
    x, road = x[after:], road[after:]
    heights = np.column_stack(spring_heights(x, car.front_arm, car.rear_arm))
    static = _static_loads()
    tyres = np.array([car.tyre_stiffness_front, car.tyre_stiffness_rear]) * (road - x[:, 2:4]) + np.array(static)
    return _Motion(rates[:, 0], rates[:, 1], tyres, heights, static)


def _area_error(r: Run, settings: ThesisSettings) -> float:
    """rms error of both area estimates after 1 s, m2."""
    _, car = nominal()
    first = round(1.0 / settings.period)
    x, estimated = r.states[first:-1], r.estimates[first:, 14:]
    heights = spring_heights(x, car.body.front_arm, car.body.rear_arm)
    ambient = car.front.ambient_pressure
    true = np.column_stack([
        [effective_area(h, p - ambient, car.surface) for h, p in zip(height, x[:, 8 + i], strict=True)]
        for i, height in enumerate(heights)
    ])  # fmt: skip
    return rms(estimated - true)


def _outcome(
    settings: ThesisSettings, motions: list[_Motion], runs: list[Run], area_errors: list[float]
) -> HalfOutcome:
    heave = np.concatenate([m.heave for m in motions])
    full, rate = heave * LENGTH_SCALE, 1.0 / settings.period
    bands = third_octaves(full, rate)
    rides = tuple(judge(m.heave, m.pitch, m.tyres, m.static, m.heights) for m in motions)
    whole = judge(heave, np.concatenate([m.pitch for m in motions]), np.concatenate([m.tyres for m in motions]),
                  motions[0].static, np.concatenate([m.heights for m in motions]))  # fmt: skip
    inlets = np.concatenate([r.commands[settings.settled :, :2] for r in runs]) if runs else np.zeros((1, 2))
    mean = np.concatenate([m.tyres for m in motions]).mean(axis=0)
    limit = nominal()[0].inlet_area_max.value
    return HalfOutcome(
        rides=rides,
        heave_rms=whole.heave_rms,
        pitch_rms=whole.pitch_rms,
        rating=whole.rating,
        weighted=weighted_rms(full, rate),
        hours=permitted_hours(bands),
        janeway=janeway_use(bands),
        healey=healey(whole.full_scale_heave_rms)[1],
        inlet_rms_in2=_pair(np.sqrt(np.mean(inlets**2, axis=0)) / SQUARE_INCH),
        inlet_peak_in2=_pair(np.quantile(inlets, 0.999, axis=0) / SQUARE_INCH),
        saturated=float(np.mean(inlets >= limit)),
        shut=float(np.mean(inlets <= 0.0)),
        area_error_in2=float(np.sqrt(np.mean(np.square(area_errors)))) / SQUARE_INCH if area_errors else 0.0,
        tyre_mean=_pair(mean),
    )


def _pair(values: NDArray[np.float64]) -> tuple[float, float]:
    return float(values[0]), float(values[1])
