# SPDX-License-Identifier: Apache-2.0
"""How large a case's gap is: what the nominal model leaves after a refit inside its tolerances, over the null floor.

The same refit of the contract's plant is made on the case and on the same case without its effect. The ratio of what
the two leave is the case's grade. This is a ruler, not a diagnosis: it knows no effects.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.rig.channels import channels_of_states

OUTPUTS = 6
DECIMATE = 5  # 100 Hz is enough to measure a misfit whose band ends at 25 Hz
NUISANCE: tuple[tuple[str, str, float], ...] = (
    ("body", "sprung_mass", 0.005),
    ("body", "pitch_inertia", 0.03),
    ("body", "unsprung_mass_front", 0.01),
    ("body", "unsprung_mass_rear", 0.01),
    ("body", "tyre_stiffness_front", 0.04),
    ("body", "tyre_stiffness_rear", 0.04),
    ("body", "damping_front", 0.15),
    ("body", "damping_rear", 0.15),
    ("body", "area_scale_front", 0.01),
    ("body", "area_scale_rear", 0.01),
    ("front", "volume", 0.01),
    ("rear", "volume", 0.01),
    ("front", "outlet_scale", 0.03),
    ("rear", "outlet_scale", 0.03),
    ("both", "discharge", 0.02),
    ("both", "supply", 0.005),
)

Solve = Callable[[Array, Array, Array, float], Array]


@dataclass(frozen=True)
class Observation:
    """One log as arrays: N + 1 samples.

    Attributes
    ----------
    measured : (N + 1, 6) m and Pa
    commands : (N, 4) m2
    road : (N + 1, 2) m
    period : s
    noise : (6,) standard deviation of each channel
    """

    measured: Array
    commands: Array
    road: Array
    period: float
    noise: Array


@dataclass(frozen=True)
class Null:
    """The refit of a log without its effect: gap left, parameters' logs, sensitivities per sigma (rows decimated)."""

    gap: float
    logs: Array
    jacobian: Array


def perturbed(car: HalfCar, logs: Array) -> HalfCar:
    """The plant with its 16 uncertain parameters multiplied by exp(logs)."""
    body, gases = car.body._asdict(), {"front": car.front, "rear": car.rear}
    for (part, name, _), log in zip(NUISANCE, logs, strict=True):
        factor = float(np.exp(log))
        if part == "body":
            body[name] *= factor
        elif name == "volume":
            gas = gases[part]
            gases[part] = gas._replace(volume_offset=gas.volume_offset * factor, mean_area=gas.mean_area * factor)
        elif name == "outlet_scale":
            gases[part] = gases[part]._replace(outlet_scale=gases[part].outlet_scale * factor)
        elif name == "discharge":
            gases = {k: g._replace(inlet_scale=g.inlet_scale * factor, outlet_scale=g.outlet_scale * factor)
                     for k, g in gases.items()}  # fmt: skip
        else:
            gases = {k: g._replace(supply_pressure=g.supply_pressure * factor,
                                   supply_power=g.supply_power * factor**-g.k) for k, g in gases.items()}  # fmt: skip
    return HalfCar(type(car.body)(**body), gases["front"], gases["rear"], car.surface, car.step)


def free_run(car: HalfCar, seen: Observation) -> Array:
    """The plant's six outputs, (N + 1, 6), driven by the log's commands and road from its first sample."""
    a, b = car.body.front_arm, car.body.rear_arm
    first = seen.measured[0]
    pitch = (first[0] - first[1]) / (a + b)
    start = np.array([first[0] - a * pitch, pitch, first[2], first[3], 0.0, 0.0, 0.0, 0.0, first[4], first[5]])
    x = car.simulate(start, seen.commands, seen.road, seen.period)
    return np.column_stack(channels_of_states(x, a, b))


def gap(model: Array, seen: Observation) -> float:
    """Contract section 3: RMS over channels of rms(log - model) / std(log)."""
    share = np.sqrt(np.mean((seen.measured - model) ** 2, axis=0)) / np.std(seen.measured, axis=0)
    return float(np.sqrt(np.mean(share**2)))


def refit(car: HalfCar, seen: Observation, start: Array | None = None, rounds: int = 25) -> tuple[float, Array]:
    """Gap that a Levenberg-Marquardt refit of the tolerance parameters leaves, and the parameters' logs.

    ``start`` are logs to begin at (those of the same rig without its effect save most of the rounds). Parameters stop
    at three sigma. The prior weighs one sigma of a parameter like the noise of the whole log in one
    sample: it only keeps apart what the log cannot tell.
    """
    sigma = np.array([s for _, _, s in NUISANCE])
    scale = np.std(seen.measured, axis=0)
    prior = float(np.mean(seen.noise / scale))
    at, damping = np.zeros(len(sigma)) if start is None else start / sigma, 1e-2
    model = free_run(perturbed(car, at * sigma), seen)
    best = gap(model, seen)
    fresh = True
    for _ in range(rounds):
        if fresh:
            jacobian = _jacobian(car, at * sigma, model, seen, sigma) / np.tile(scale, len(model[::DECIMATE]))[:, None]
            error = ((seen.measured - model)[::DECIMATE] / scale).ravel()
        moved = np.clip(at + _damped_step(jacobian, error, at, prior, damping), -3.0, 3.0)
        trial = free_run(perturbed(car, moved * sigma), seen)
        value = gap(trial, seen) if np.isfinite(trial).all() else np.inf
        fresh = value < best
        if not fresh:
            damping *= 8.0
            if damping > 1e7:
                break
            continue
        done = value > 0.998 * best
        at, model, best, damping = moved, trial, value, max(damping / 8.0, 1e-9)
        if done:
            break
    return best, at * sigma


def quick_gap(car: HalfCar, seen: Observation, null: Null, solve: Solve | None = None) -> float:
    """About what :func:`refit` would leave: the linear refit with the sensitivities of the log without its effect.

    One simulation instead of some sixty, and smooth in the size of an effect: good enough to search from.

    Parameters
    ----------
    car : nominal half car
    seen : the log with its effect
    null : refit of the same log without it
    solve : (sensitivities per sigma, error, parameters, sigmas, weight of the prior) -> step, sigmas;
        :func:`_damped_step` without damping where none is given
    """
    sigma = np.array([s for _, _, s in NUISANCE])
    scale = np.std(seen.measured, axis=0)
    model = free_run(perturbed(car, null.logs), seen)
    if not np.isfinite(model).all():
        return np.inf
    jacobian = null.jacobian / np.tile(scale, len(model[::DECIMATE]))[:, None]
    error = ((seen.measured - model)[::DECIMATE] / scale).ravel()
    step = (solve or _undamped)(jacobian, error, null.logs / sigma, float(np.mean(seen.noise / scale)))
    return float(np.sqrt(np.mean((error - jacobian @ step) ** 2)))


def null_of(car: HalfCar, seen: Observation) -> Null:
    """Refit of a log without effect, kept as the start and the sensitivities of the same log with one."""
    left, logs = refit(car, seen)
    sigma = np.array([s for _, _, s in NUISANCE])
    return Null(left, logs, _jacobian(car, logs, free_run(perturbed(car, logs), seen), seen, sigma))


def _undamped(jacobian: Array, error: Array, at: Array, prior: float) -> Array:
    return _damped_step(jacobian, error, at, prior, 0.0)


def _damped_step(jacobian: Array, error: Array, at: Array, prior: float, damping: float) -> Array:
    """Step in sigmas; a parameter that would leave +-3 sigma is put on that bound and the others are solved again."""
    normal, slope = jacobian.T @ jacobian, jacobian.T @ error
    normal = normal + prior**2 * np.eye(len(at)) + damping * np.diag(np.diag(normal))
    slope = slope - prior**2 * at
    free, step = np.ones(len(at), dtype=bool), np.zeros(len(at))
    while free.any():
        rest = slope[free] - normal[np.ix_(free, ~free)] @ step[~free]
        step[free] = np.linalg.solve(normal[np.ix_(free, free)], rest)
        beyond = free & (np.abs(at + step) > 3.0 + 1e-9)
        if not beyond.any():
            break
        step[beyond] = np.clip(at[beyond] + step[beyond], -3.0, 3.0) - at[beyond]
        free &= ~beyond
    return step


def _jacobian(car: HalfCar, logs: Array, model: Array, seen: Observation, sigma: Array) -> Array:
    columns = []
    for i, width in enumerate(sigma):
        moved = logs.copy()
        moved[i] += 0.02 * width
        columns.append(((free_run(perturbed(car, moved), seen) - model)[::DECIMATE] / 0.02).ravel())
    return np.column_stack(columns)
