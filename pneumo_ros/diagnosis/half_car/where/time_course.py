# SPDX-License-Identifier: Apache-2.0
"""Where a gap lives when no shape follows it: which place's equations it moves together, whatever its time course.

A force that no function of the motion describes (a rotating imbalance, something that strikes, a law met outside what
was fitted) defeats every shape of :mod:`pneumo_ros.diagnosis.half_car.where.flexible`. What gives its place away is the
pattern across the equations in one window: a spring's force pushes the body up, turns it and pushes its axle down; a
tyre's moves one axle only; air moves one balance. So a place may add *any* time course, one value a window, and the
price is what that many values take of noise. A sensor's error is a time course of the channel, carried through the
equations.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import cho_factor, cho_solve

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.box import box_minimum
from pneumo_ros.diagnosis.fit.problem import REACH
from pneumo_ros.diagnosis.half_car.signals import MEASURED
from pneumo_ros.diagnosis.half_car.where.design import Design, car_of, inlet_gain, inputs_of
from pneumo_ros.diagnosis.half_car.where.weak import EQUATIONS, averaged, weak_residuals
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.half_car import HalfCar

# Windows on each side that a bump of a sensor's time course moves: two of the bump, one of the window [numerics]
REACHED: Final = 3
# Share of a channel's standard deviation, forward difference that carries a time course through the equations
# [numerics]
STEP: Final = 0.05
PRICE: Final = 1.0  # mean square, null standard deviations squared, that one free value takes of noise [definition]
RIDGE: Final = 1e-6  # relative, keeps the Gram matrix of time courses regular [numerics]


@dataclass
class TimeCourses:
    """Free time courses on one log, as a problem over sets of places.

    Attributes
    ----------
    residual : (K, 6) what the model leaves of each window, null standard deviations
    parameters : (P, K, 6) change by one standard deviation of each uncertain parameter
    offset : (P,) standard deviations that the parameters already are from nominal
    directions : place -> (D, K, 6) what its D free values of a window do to the equations of that window
    spread : place -> (M, K, 6) what M values of a time course do that reach further than their window (sensors)
    """

    residual: Array
    parameters: Array
    offset: Array
    directions: dict[str, Array]
    spread: dict[str, Array]
    cache: dict[frozenset[str], float] = field(default_factory=dict)

    def candidates(self) -> list[str]:
        """Places that move an equation of this log; of the sensors the best alone: two could fit any residual."""
        sensors = sorted(self.spread, key=lambda place: self.value([place]))
        return [*self.directions, *sensors[:1]]

    @property
    def rows(self) -> float:
        """Number of residuals."""
        return max(float(np.count_nonzero(self.residual)), 1.0)

    def value(self, places: Iterable[str]) -> float:
        """Mean square that is left with these places free, each free value counted as noise (null: about one)."""
        chosen = frozenset(place for place in places if place in self.directions or place in self.spread)
        if chosen not in self.cache:
            self.cache[chosen] = self._left(chosen)
        return self.cache[chosen]

    def _left(self, chosen: frozenset[str]) -> float:
        local = [self.directions[p] for p in sorted(chosen) if p in self.directions]
        far = [self.spread[p] for p in sorted(chosen) if p in self.spread]
        keep, used = _complement(local, self.residual.shape)
        shape = (-1, self.residual.size)
        r = np.einsum("kij,kj->ki", keep, self.residual).ravel()
        columns = np.einsum("kij,pkj->pki", keep, self.parameters).reshape(shape)
        if far:
            courses = np.einsum("kij,pkj->pki", keep, np.concatenate(far)).reshape(shape)
            r, columns, rank = _without(courses, r, columns)
            used += rank
        gram = columns @ columns.T + np.eye(len(columns))
        z = box_minimum(gram, -columns @ r - self.offset, -REACH - self.offset, REACH - self.offset)
        left = r + z @ columns
        return float((left @ left + PRICE * used) / self.rows)


def time_courses_of(design: Design, model: RigModel, offset: Array) -> TimeCourses:
    """The problem of one log; places whose equations the log cannot test are left out."""
    car = car_of(model)
    whitened = design.weight / design.null
    directions = {place: moved * whitened for place, moved in _directions(design, car).items()}
    spread = {f"sensor:{name}": _course(design, car, c) * whitened for c, name in enumerate(MEASURED)}
    return TimeCourses(
        design.residual,
        design.parameters,
        offset,
        {place: moved for place, moved in directions.items() if np.any(moved)},
        {place: moved for place, moved in spread.items() if np.any(moved)},
    )


def _directions(design: Design, car: HalfCar) -> dict[str, Array]:
    """(D, K, 6) what a unit of force, moment, flow, pressure or force of the road does in the window where it acts."""
    count, body = len(design.residual), car.body

    def unit(**factors: float) -> Array:
        out = np.zeros((1, count, len(EQUATIONS)))
        for equation, factor in factors.items():
            out[0, :, EQUATIONS.index(equation)] = factor
        return out

    out = {
        "front_force": unit(heave=-1.0, pitch=-body.front_arm, front_axle=1.0),
        "rear_force": unit(heave=-1.0, pitch=body.rear_arm, rear_axle=1.0),
        "body_heave": unit(heave=-1.0),
        "body_pitch": unit(pitch=-1.0),
        "road_input": np.concatenate([unit(front_axle=-1.0), unit(rear_axle=-1.0)]),
        "supply": unit(),
    }
    for k, end in enumerate(("front", "rear")):
        out[f"{end}_tyre"] = unit(**{f"{end}_axle": -1.0})
        out[f"{end}_air"] = unit(**{f"{end}_air": -1.0})
        motion, windows = design.features.ends[k], design.windows
        gain = motion.inlet * inlet_gain(motion.pressure, motion.per_inlet, car, k)
        out["supply"][0, :, 4 + k] = -averaged(gain, windows.window.value, windows.centres)
    return out


def _course(design: Design, car: HalfCar, channel: int) -> Array:
    """(M, K, 6) change of the residuals by each bump of one channel's time course, null weights not applied.

    Bumps (cubic B-splines, one a window) that lie too far apart to meet are carried through the equations together.
    """
    inputs, windows = inputs_of(design.signals), design.windows
    centres = windows.centres
    count, apart = len(centres), 2 * REACHED + 1
    size = STEP * float(design.features.yardstick.channel_scale[channel])
    spacing = int(centres[1] - centres[0])
    bump = BSpline.basis_element(np.arange(-2.0, 2.5), extrapolate=False)
    shape = np.nan_to_num(bump(np.arange(-2 * spacing, 2 * spacing + 1) / spacing))
    base = weak_residuals(car, inputs, windows)
    out = np.zeros((count, count, len(EQUATIONS)))
    for first in range(apart):
        own = np.arange(first, count, apart)
        comb = np.zeros(len(inputs.measured))
        comb[centres[own]] = 1.0
        moved = inputs.measured.copy()
        moved[:, channel] += size * np.convolve(comb, shape, mode="same")
        change = (weak_residuals(car, inputs._replace(measured=moved), windows) - base) / STEP
        for k in own:
            near = slice(max(0, k - REACHED), k + REACHED + 1)
            out[k, near] = change[near]
    return out


def _complement(local: list[Array], shape: tuple[int, ...]) -> tuple[Array, float]:
    """(K, 6, 6) projectors of each window onto what the free values of these places cannot reach, and their number."""
    count, equations = shape
    keep = np.broadcast_to(np.eye(equations), (count, equations, equations))
    if not local:
        return np.asarray(keep), 0.0
    span = np.moveaxis(np.concatenate(local), 0, 2)  # (K, 6, D)
    left, singular, _ = np.linalg.svd(span, full_matrices=False)
    real = singular > 1e-9 * max(float(singular.max()), 1e-300)
    own = left * real[:, None, :]
    return keep - own @ np.swapaxes(own, 1, 2), float(real.sum())


def _without(courses: Array, residual: Array, columns: Array) -> tuple[Array, Array, float]:
    """Residual and parameter columns with what time courses (M, n) can follow taken off; the rank of the courses."""
    gram = courses @ courses.T
    size = float(np.trace(gram)) / len(gram)
    factor = cho_factor(gram + RIDGE * size * np.eye(len(gram)), check_finite=False)
    both = np.vstack([residual, columns])
    both = both - cho_solve(factor, courses @ both.T, check_finite=False).T @ courses
    return both[0], both[1:], float(np.count_nonzero(np.diag(gram) > RIDGE * size))
