# SPDX-License-Identifier: Apache-2.0
"""One session of a case: which road, which controller, which valve excitation, what is known to be changed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.casemaker.controller import ACTIVE, LEVELLING
from pneumo_ros.casemaker.excitation import road, valve_steps, valve_waves
from pneumo_ros.casemaker.gap_size import Observation
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.simulate import STEP, Run, simulate
from pneumo_ros.casemaker.trim import prepared, rest_of
from pneumo_ros.plant.air_spring import AreaSurface
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.rig import Rig

PERIOD = 0.002  # s, 500 Hz
SAMPLES = 7500
STEPS = {"displacement": 3.0e-6, "pressure": 15.0}  # m, Pa: one count of 16 bit over 0.2 m and 1 MPa


@dataclass(frozen=True)
class Scene:
    """What is done to the rig in one log.

    Attributes
    ----------
    road : kind of :mod:`pneumo_ros.casemaker.excitation`
    gain : factor on its heights
    controller : levelling or active
    valves : steps or waves
    valve_size : their relative size
    seed : of road, valves and noise
    added_mass : kg that are known to lie on the centre of mass (the log's config says so)
    supply_change : Pa by which the supply is known to differ (the log's config says so)
    jitter : s, standard deviation of the sampling instants; the stamps tell them
    missing : share of samples that are lost, half of them in bursts
    pressure_every : pressures are sampled every so many periods
    """

    road: str
    gain: float
    controller: str
    valves: str
    valve_size: float
    seed: int
    added_mass: float = 0.0
    supply_change: float = 0.0
    jitter: float = 0.0
    missing: float = 0.0
    pressure_every: int = 1


@dataclass(frozen=True)
class Session:
    """A simulated log before it is written.

    Attributes
    ----------
    time : (SAMPLES,) s
    run : what the rig did
    road : (SAMPLES, 2) m
    outlets : m2
    scene : what was done to it
    stamps : (SAMPLES, 2) sampling instants of displacement and pressure, s
    sensors : (SAMPLES, 6) what the sensors said at those instants
    kept : (SAMPLES, 2) which samples of displacement and pressure arrived
    """

    time: NDArray[np.float64]
    run: Run
    road: NDArray[np.float64]
    outlets: tuple[float, float]
    scene: Scene
    stamps: NDArray[np.float64]
    sensors: NDArray[np.float64]
    kept: NDArray[np.bool_]


def play(
    rig: RicherRig, nominal: Rig, scene: Scene, surface: AreaSurface, road_gain: float = 1.0, step: float = STEP
) -> Session:
    """Simulate one log of a rig.

    Parameters
    ----------
    rig : the rig with its faults
    nominal : the rig file the log carries: outlets and noise
    road_gain : extra factor that an effect needs
    step : of the integrator, s
    """
    time = _time()
    changed = rig._replace(
        frame=rig.frame._replace(
            sprung_mass=rig.frame.sprung_mass + scene.added_mass,
            supply_pressure=rig.frame.supply_pressure + scene.supply_change,
        )
    )
    outlets = (nominal.outlet_area_front.value, nominal.outlet_area_rear.value)
    rest = rest_of(changed, outlets, surface)
    ground = scene.gain * road_gain * _unit_road(scene.road, nominal.wheelbase, scene.seed)
    excite = valve_steps if scene.valves == "steps" else valve_waves
    gains = ACTIVE if scene.controller == "active" else LEVELLING
    sigma = np.array([nominal.displacement_noise.value] * 4 + [nominal.pressure_noise.value] * 2)
    noise = sigma * np.random.default_rng([scene.seed, 1]).normal(size=(SAMPLES, 6))
    shake = excite(time, scene.valve_size, scene.seed + 1)
    done = simulate(prepared(changed, rest), rest, ground, shake, noise, surface, gains, PERIOD, step=step)
    return _sampled(time, done, noise, ground, outlets, scene)


def _time() -> NDArray[np.float64]:
    return PERIOD * np.arange(SAMPLES, dtype=np.float64)


@lru_cache(maxsize=8)
def _unit_road(kind: str, wheelbase: float, seed: int) -> NDArray[np.float64]:
    """The same road is run at many sizes of an effect."""
    return road(kind, _time(), wheelbase, 1.0, seed)


def observation(session: Session, nominal: Rig) -> Observation:
    """The log as the ruler reads it, on its own grid."""
    noise = np.array([nominal.displacement_noise.value] * 4 + [nominal.pressure_noise.value] * 2)
    constant = np.tile(session.outlets, (SAMPLES - 1, 1))
    commands = np.ascontiguousarray(np.hstack([session.run.inlets[:-1], constant]))
    return Observation(session.run.measured, commands, session.road, PERIOD, noise)


def inside_bounds(car: HalfCar, session: Session) -> bool:
    """Whether the tyres stay loaded and the springs inside their table with some margin: a road the rig can take."""
    measured = session.run.measured
    height = measured[:, :2] - measured[:, 2:4]
    gaps = measured[:, 2:4] - session.road
    low, high = car.surface.heights[0], car.surface.heights[-1]
    return bool(gaps.max() < -1.5e-3 and height.min() > low + 1.5e-3 and height.max() < high + 1e-3)


def _sampled(
    time: NDArray[np.float64], done: Run, noise: NDArray[np.float64], ground: NDArray[np.float64],
    outlets: tuple[float, float], scene: Scene,
) -> Session:  # fmt: skip
    rng = np.random.default_rng([scene.seed, 2])
    shift = np.clip(scene.jitter * rng.normal(size=(SAMPLES, 2)), -0.4 * PERIOD, 0.4 * PERIOD)
    shift[0] = 0.0
    stamps = time[:, None] + shift
    sensors = done.measured
    if scene.jitter > 0.0 and np.isfinite(sensors).all():  # a rig that ran away is told by what it leaves
        from scipy.interpolate import CubicSpline  # here: slow to import

        clean = CubicSpline(time, done.measured - noise)
        moved = np.hstack([clean(np.minimum(stamps[:, 0], time[-1]))[:, :4],
                           clean(np.minimum(stamps[:, 1], time[-1]))[:, 4:]])  # fmt: skip
        sensors = moved + noise
    count = np.array([STEPS["displacement"]] * 4 + [STEPS["pressure"]] * 2)
    sensors = np.round(sensors / count) * count
    kept = np.column_stack([_arrived(scene.missing, rng), _arrived(scene.missing, rng)])
    kept[:, 1] &= np.arange(SAMPLES) % scene.pressure_every == 0
    return Session(time, done, ground, outlets, scene, stamps, sensors, kept)


def _arrived(missing: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    kept = rng.uniform(size=SAMPLES) >= 0.5 * missing
    lost = 0
    while lost < 0.5 * missing * SAMPLES:
        start, length = int(rng.integers(500, SAMPLES - 100)), int(rng.integers(5, 25))
        kept[start : start + length] = False
        lost += length
    kept[0] = True
    return kept
