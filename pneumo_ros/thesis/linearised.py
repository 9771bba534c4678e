# SPDX-License-Identifier: Apache-2.0
"""The quarter car's closed loop linearised about rest: whether a controller can ride well at all, before any road."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.control.linearisation import area_slopes
from pneumo_ros.plant.air_spring import effective_area
from pneumo_ros.thesis.models.quarter_car import QuarterCar, QuarterTrim
from pneumo_ros.thesis.models.quarter_car_control import QuarterLaw, control_quarter, quarter_law
from pneumo_ros.thesis.quarter import Experiment, plant
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.units import INCH, POUND_FORCE

STEPS = np.array([1e-6, 1e-6, 1e-5, 1e-5, 1.0])  # m, m, m/s, m/s, Pa: of the central differences


@dataclass(frozen=True)
class Mode:
    """An oscillation: frequency, Hz, and damping ratio; negative grows."""

    frequency_hz: float
    damping_ratio: float


def body_mode(settings: ThesisSettings, experiment: Experiment) -> Mode:
    """The least damped mode below 8 Hz of a controlled quarter car in continuous time, without valve limits.

    The reference rests at its target; an estimated area counts as known. The axle's own mode, near 14 Hz, is left out.
    """
    car, trim = plant(settings, experiment.cylinder)
    options = {**experiment.options, "area_in2": experiment.options.get("area_in2", 0.0)}
    law = quarter_law(car, trim, experiment.law, period=settings.period, inlet_max=np.inf, **options)  # type: ignore[arg-type]
    matrix = np.empty((5, 5))
    for j, step in enumerate(STEPS):
        moved = np.zeros(5)
        moved[j] = step
        matrix[:, j] = (_rates(trim.state + moved, car, trim, law) - _rates(trim.state - moved, car, trim, law)) / (
            2 * step
        )
    modes = [
        Mode(float(abs(w)) / (2 * np.pi), float(-w.real / abs(w))) for w in np.linalg.eigvals(matrix) if w.imag > 0
    ]
    slow = [mode for mode in modes if mode.frequency_hz < 8.0]
    return min(slow, key=lambda mode: mode.damping_ratio) if slow else Mode(0.0, 1.0)


def _rates(x: NDArray[np.float64], car: QuarterCar, trim: QuarterTrim, law: QuarterLaw) -> NDArray[np.float64]:
    acceleration = car.rates(x, trim.command, 0.0)[2]  # forces do not depend on the command
    known = float(effective_area(x[0] - x[1], x[4] - car.gas.ambient_pressure, car.surface))
    area = law.belief.area or known * law.belief.mass / car.corner.sprung_mass  # Eq. 6.57
    rest = np.array([trim.state[0], 0.0, 0.0, 0.0])
    _, inlet = control_quarter(rest, x, float(acceleration), area, law, car.gas, car.surface)
    return car.rates(x, np.array([inlet, trim.outlet]), 0.0)


def area_stiffness_share(settings: ThesisSettings) -> tuple[float, float]:
    """Spring stiffness at rest, lb/in, and the share of it that is the area's, p dA/dh: what dA/dt = 0 leaves out."""
    car, trim = plant(settings, False)
    gauge, height = float(trim.state[4]) - car.gas.ambient_pressure, float(trim.state[0] - trim.state[1])
    area = float(effective_area(height, gauge, car.surface))
    by_height, by_gauge = area_slopes(height, gauge, car.surface)
    volume = car.gas.volume_offset + car.gas.mean_area * height
    gas = car.gas.exponent * float(trim.state[4]) * car.gas.mean_area / volume * (area + gauge * by_gauge)
    total = gas - gauge * by_height
    return total / (POUND_FORCE / INCH), -gauge * by_height / total
