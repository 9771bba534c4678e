# SPDX-License-Identifier: Apache-2.0
"""Local motion and flow at every instant of a log, smoothed: what a correction may depend on.

Velocities and accelerations here only shape corrections; no equation is tested with them.

Kernel arguments
----------------
pressure : (N,) absolute, Pa
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numba import njit
from scipy.linalg import expm
from scipy.signal import lfilter, savgol_filter, ss2tf

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.plant.air_spring import Gas, inlet_flow, outlet_flow, pressure_power
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.units import GAS_CONSTANT

SMOOTHING: Final = 0.03  # s, cubic: keeps wheel hop to 1 %, rates to 1 mm/s [physics]
ACCELERATION_SMOOTHING: Final = 0.042  # s, quartic: the same for accelerations [physics]


@dataclass(frozen=True)
class End:
    """One end of the rig over a log, all (N,), SI.

    ``travel`` is the spring's height above design height, ``squeeze`` the tyre's compression (road minus axle),
    ``per_inlet`` and ``per_outlet`` mass flow per m2 of opening, kg/(s m2), ``warmth`` T2/T1 - 1.
    """

    travel: Array
    travel_rate: Array
    pressure: Array
    pressure_rate: Array
    other_pressure: Array
    gauge: Array
    squeeze: Array
    squeeze_rate: Array
    inlet: Array
    outlet: Array
    per_inlet: Array
    per_outlet: Array
    mass: Array
    warmth: Array
    gas: Gas


@dataclass(frozen=True)
class Yardstick:
    """Sizes by which shapes are centred and scaled: the same numbers for every log that shares coefficients.

    Attributes
    ----------
    channel_mean, channel_scale : (6,) mean and standard deviation of each channel
    gauge, pressure, squeeze : (2,) means at both ends, Pa, Pa, m
    flow, per_inlet, per_outlet : (2,) mean inflow, kg/s, and mean flow per opening, kg/(s m2)
    openings : (2, 3) 10, 50 and 90 % quantiles of the inlet opening, m2
    road : (2,) standard deviation of the road, m
    heave, pitch : means, m and rad
    """

    channel_mean: Array
    channel_scale: Array
    gauge: Array
    pressure: Array
    squeeze: Array
    flow: Array
    per_inlet: Array
    per_outlet: Array
    openings: Array
    road: Array
    heave: float
    pitch: float


@dataclass(frozen=True)
class Features:
    """Both ends, the body, the road and the channels of a log, with its sampling period in s."""

    ends: tuple[End, End]
    heave: Array
    heave_rate: Array
    heave_acceleration: Array
    pitch: Array
    pitch_rate: Array
    pitch_acceleration: Array
    road: Array
    road_rate: Array
    smooth: Array
    period: float
    yardstick: Yardstick

    @property
    def time(self) -> Array:
        """(N,) s from the log's start."""
        return np.asarray(np.arange(len(self.heave)) * self.period, dtype=float)


def features_of(signals: Signals, car: HalfCar, yardstick: Yardstick | None = None) -> Features:
    """Smooth a log and evaluate the flows that its pressures and openings give in ``car``.

    Without a ``yardstick`` the log is its own.
    """
    dt, y = signals.period, signals.measured
    smooth = _savgol(y, SMOOTHING, 3, 0, dt)
    rate = _savgol(y, SMOOTHING, 3, 1, dt)
    acceleration = _savgol(y[:, :2], ACCELERATION_SMOOTHING, 4, 2, dt)
    road_rate = np.gradient(signals.road, dt, axis=0)
    height = signals.rig.design_height.value
    ends = tuple(
        _end(i, gas, smooth, rate, signals.road[:, i], road_rate[:, i], signals.commands, height)
        for i, gas in enumerate((car.front, car.rear))
    )
    a, b = car.body.front_arm, car.body.rear_arm

    def heave(ends_of_body: Array) -> Array:
        return np.asarray((b * ends_of_body[:, 0] + a * ends_of_body[:, 1]) / (a + b))

    def pitch(ends_of_body: Array) -> Array:
        return np.asarray((ends_of_body[:, 0] - ends_of_body[:, 1]) / (a + b))

    front, rear = ends
    body = (heave(smooth), pitch(smooth))
    return Features(
        (front, rear),
        body[0], heave(rate), heave(acceleration), body[1], pitch(rate), pitch(acceleration),
        signals.road, road_rate, smooth, dt,
        yardstick or _yardstick(signals, (front, rear), body),
    )  # fmt: skip


def _yardstick(signals: Signals, ends: tuple[End, End], body: tuple[Array, Array]) -> Yardstick:
    def means(name: str) -> Array:
        return np.array([float(np.mean(getattr(end, name))) for end in ends])

    inflow = [float(np.mean(end.inlet * end.per_inlet)) or float(np.mean(end.outlet * end.per_outlet)) for end in ends]
    return Yardstick(
        channel_mean=signals.measured.mean(axis=0),
        channel_scale=signals.scale,
        gauge=means("gauge"),
        pressure=means("pressure"),
        squeeze=means("squeeze"),
        flow=np.maximum(inflow, 1e-6),
        per_inlet=means("per_inlet"),
        per_outlet=means("per_outlet"),
        openings=np.array([np.quantile(end.inlet, (0.1, 0.5, 0.9)) for end in ends]),
        road=np.maximum(signals.road.std(axis=0), 1e-3),
        heave=float(body[0].mean()),
        pitch=float(body[1].mean()),
    )


def _savgol(values: Array, span: float, order: int, derivative: int, period: float) -> Array:
    count = max(order + 2, round(span / period))
    count += 1 - count % 2
    return np.asarray(savgol_filter(values, count, order, deriv=derivative, delta=period, axis=0), dtype=float)


def _end(
    i: int, gas: Gas, smooth: Array, rate: Array, road: Array, road_rate: Array, commands: Array, height: float
) -> End:
    pressure = smooth[:, 4 + i]
    per_inlet, per_outlet, power = _flows(pressure, gas)
    travel = smooth[:, i] - smooth[:, 2 + i] - height
    volume = gas.volume_offset + gas.mean_area * (travel + height)
    return End(
        travel=travel,
        travel_rate=rate[:, i] - rate[:, 2 + i],
        pressure=pressure,
        pressure_rate=rate[:, 4 + i],
        other_pressure=smooth[:, 5 - i],
        gauge=pressure - gas.ambient_pressure,
        squeeze=road - smooth[:, 2 + i],
        squeeze_rate=road_rate - rate[:, 2 + i],
        inlet=commands[:, i],
        outlet=commands[:, 2 + i],
        per_inlet=per_inlet,
        per_outlet=per_outlet,
        mass=pressure * volume / (GAS_CONSTANT * gas.supply_temperature * power),
        warmth=power - 1.0,
        gas=gas,
    )


@njit(cache=True, error_model="numpy", nogil=True)
def _flows(pressure: Array, gas: Gas) -> tuple[Array, Array, Array]:
    count = len(pressure)
    into, out, power = np.empty(count), np.empty(count), np.empty(count)
    for i in range(count):
        power[i] = pressure_power(pressure[i], gas)
        into[i] = inlet_flow(1.0, pressure[i], power[i], gas)
        out[i] = outlet_flow(1.0, pressure[i], power[i], gas)
    return into, out, power


def lagged(series: Array, tau: float, period: float) -> Array:
    """First order lag of time constant ``tau``, s, started at rest."""
    share = 1.0 - np.exp(-period / tau)
    return np.asarray(lfilter([share], [1.0, share - 1.0], series - series[0]) + series[0])


def resonated(series: Array, frequency: float, damping: float, period: float) -> Array:
    """Second order lag of ``frequency``, rad/s, input held over each period, started at rest."""
    w = frequency
    system = np.array([[0.0, 1.0, 0.0], [-w * w, -2.0 * damping * w, w * w], [0.0, 0.0, 0.0]])
    step = expm(system * period)
    numerator, denominator = ss2tf(step[:2, :2], step[:2, 2:], np.array([[1.0, 0.0]]), np.zeros((1, 1)))
    return np.asarray(lfilter(numerator[0], denominator, series - series[0]) + series[0])


@njit(cache=True, nogil=True)
def dragged(series: Array, slack: float) -> Array:
    """Elastic-plastic (stop) element: follows ``series`` until ``slack``, then slips; output in -1..1."""
    out = np.empty(len(series))
    stretch = 0.0
    out[0] = 0.0
    for i in range(1, len(series)):
        stretch = min(max(stretch + series[i] - series[i - 1], -slack), slack)
        out[i] = stretch / slack
    return out
