# SPDX-License-Identifier: Apache-2.0
"""Residual of each equation of the half car in weak form: no measured signal is differentiated.

Each equation is multiplied by a smooth window and integrated by parts, so that derivatives fall on the window. With the
window's integral equal to one a residual is a weighted mean over the window of what the equation misses, in the
equation's own unit:

    heave, pitch        force and moment that would have to be added to the body, N and N m
    front/rear_axle     force that would have to be added to the axle, N, upwards
    front/rear_air      mass flow that would have to be added to the spring, kg/s

The air balance is used in conservative form, d(m)/dt = W12 - W23 with m = P V / (R T2) (Eqs. 4.13, 4.17, 4.20): it is
Eq. 4.22 before the chain rule, and holds no derivative but that of the mass.

Kernel arguments
----------------
height, pressure : (N,) of a spring, m, and absolute, Pa
inlet, outlet : (N,) commanded openings, m2
scale, ambient : factor on the effective area, 1, and absolute pressure, Pa
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.arrays import Array
from pneumo_ros.plant.air_spring import AreaSurface, Gas, effective_area, inlet_flow, outlet_flow, pressure_power
from pneumo_ros.plant.equations import Body
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.units import GAS_CONSTANT, GRAVITY

# the equations of motion and of the air, in the order of the residuals' columns [definition]
EQUATIONS: Final = ("heave", "pitch", "front_axle", "rear_axle", "front_air", "rear_air")
UNITS: Final = ("N", "N m", "N", "N", "kg/s", "kg/s")  # of the equations' residuals [definition]
HALF_WIDTH: Final = 0.04  # s: passes what is below about 12 Hz, wheel hop included, at 0.3 N of sensor noise [physics]
# (1 - s^2)^4: three derivatives vanish at the ends, so sums over samples are as good as integrals [numerics]
SMOOTHNESS: Final = 4


class Window(NamedTuple):
    """Window sampled at its centre's grid (K,) and its first and second derivative, times the sampling period.

    ``half`` is the window sampled half a period later, for terms that are constant between samples.
    """

    value: Array
    rate: Array
    curvature: Array
    half: Array


class Inputs(NamedTuple):
    """What the equations are fed with: measured (N, 6), commands (N, 4), road (N, 2), period s."""

    measured: Array
    commands: Array
    road: Array
    period: float


@dataclass(frozen=True)
class Windows:
    """Rows of the windows' centres in the log (K,) and the window itself."""

    centres: NDArray[np.intp]
    window: Window


def make_window(half_width: float, period: float) -> Window:
    """The window (1 - s^2)^4 / integral on -1 < s < 1, s = t / half_width; both arguments in s."""
    count = max(4, round(half_width / period))
    width = count * period
    p = SMOOTHNESS
    s = np.arange(-count, count + 1) / count
    later = np.clip(s + 0.5 / count, -1.0, 1.0)
    shape = (1.0 - s**2) ** p
    rate = -2.0 * p * s * (1.0 - s**2) ** (p - 1) / width
    curvature = (-2.0 * p * (1.0 - s**2) ** (p - 1) + 4.0 * p * (p - 1) * s**2 * (1.0 - s**2) ** (p - 2)) / width**2
    total = shape.sum()
    return Window(shape / total, rate / total, curvature / total, (1.0 - later**2) ** p / total)


def make_windows(rows: int, period: float, half_width: float = HALF_WIDTH) -> Windows:
    """Windows overlapping by half over a log of ``rows`` samples."""
    window = make_window(half_width, period)
    reach = len(window.value) // 2
    return Windows(np.arange(reach, rows - reach - 1, reach), window)


@njit(cache=True, nogil=True)
def averaged(series: Array, kernel: Array, centres: NDArray[np.intp]) -> Array:
    """Sum of ``series`` (N,) under a window's ``kernel`` at each of the ``centres``' rows, (K,)."""
    out = np.empty(len(centres))
    for k in range(len(centres)):
        first, total = centres[k] - len(kernel) // 2, 0.0
        for i in range(len(kernel)):
            total += kernel[i] * series[first + i]
        out[k] = total
    return out


@njit(cache=True, error_model="numpy", nogil=True)
def _forces(height: Array, pressure: Array, scale: float, ambient: float, body: Body, surface: AreaSurface) -> Array:
    out = np.empty(len(height))
    for i in range(len(height)):
        gauge = pressure[i] - ambient
        stop = body.stop_stiffness * max(0.0, body.stop_height - height[i])
        out[i] = gauge * scale * effective_area(height[i], gauge, surface) + stop
    return out


@njit(cache=True, error_model="numpy", nogil=True)
def _mass_and_flow(height: Array, pressure: Array, inlet: Array, outlet: Array, gas: Gas) -> tuple[Array, Array]:
    """Air mass (N,) and net inflow (N,), the latter the mean over each interval with its command held."""
    count = len(height)
    mass, per_inlet, per_outlet = np.empty(count), np.empty(count), np.empty(count)
    for i in range(count):
        power = pressure_power(pressure[i], gas)
        volume = gas.volume_offset + gas.mean_area * height[i]
        mass[i] = pressure[i] * volume / (GAS_CONSTANT * gas.supply_temperature * power)
        per_inlet[i] = inlet_flow(1.0, pressure[i], power, gas)
        per_outlet[i] = outlet_flow(1.0, pressure[i], power, gas)
    flow = np.empty(count)
    for i in range(count):
        j = min(i + 1, count - 1)
        flow[i] = 0.5 * (inlet[i] * (per_inlet[i] + per_inlet[j]) - outlet[i] * (per_outlet[i] + per_outlet[j]))
    return mass, flow


def weak_residuals(car: HalfCar, inputs: Inputs, windows: Windows) -> Array:
    """Residuals (K, 6) of :data:`EQUATIONS`, what would have to be added to the model; units as in the module's text.

    Parameters
    ----------
    car : the half car whose equations are tested
    inputs : measured and commanded signals on a uniform base
    windows : where to look
    """
    body, z, p = car.body, inputs.measured[:, :4], inputs.measured[:, 4:]
    value, rate, curvature, half = windows.window
    at = windows.centres
    a, b = body.front_arm, body.rear_arm
    base = a + b

    def mean(series: Array, kernel: Array = value) -> Array:
        return averaged(series, kernel, at)

    heights = [z[:, i] - z[:, 2 + i] for i in (0, 1)]
    dampings, gases = (body.damping_front, body.damping_rear), (car.front, car.rear)
    scales = (body.area_scale_front, body.area_scale_rear)
    # -c dh/dt under the window is +c h under the window's derivative.
    forces = [
        mean(_forces(h, p[:, i], scales[i], gases[i].ambient_pressure, body, car.surface)) + dampings[i] * mean(h, rate)
        for i, h in enumerate(heights)
    ]
    heave = (b * z[:, 0] + a * z[:, 1]) / base
    pitch = (z[:, 0] - z[:, 1]) / base
    out = [
        body.sprung_mass * (mean(heave, curvature) + GRAVITY) - forces[0] - forces[1],
        body.pitch_inertia * mean(pitch, curvature) - a * forces[0] + b * forces[1],
    ]
    masses = (body.unsprung_mass_front, body.unsprung_mass_rear)
    stiffnesses = (body.tyre_stiffness_front, body.tyre_stiffness_rear)
    for i in (0, 1):
        tyre = stiffnesses[i] * mean(inputs.road[:, i] - z[:, 2 + i])
        out.append(masses[i] * (mean(z[:, 2 + i], curvature) + GRAVITY) - tyre + forces[i])
    for i in (0, 1):
        mass, flow = _mass_and_flow(heights[i], p[:, i], inputs.commands[:, i], inputs.commands[:, 2 + i], gases[i])
        out.append(-mean(mass, rate) - mean(flow, half))
    return np.column_stack(out)
