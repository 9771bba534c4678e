# SPDX-License-Identifier: Apache-2.0
"""The linear problem behind "where": weak residuals of a log, and what each parameter and correction does to them.

Every column is in the unit of its equation; :func:`design_of` divides by what noise and model form explain, so that a
residual of one (dimensionless) is what a rig without a fault leaves.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals import MEASURED, Signals
from pneumo_ros.diagnosis.half_car.where.features import Features, Yardstick, features_of
from pneumo_ros.diagnosis.half_car.where.flexible import Basis, all_bases
from pneumo_ros.diagnosis.half_car.where.weak import EQUATIONS, Inputs, Windows, averaged, make_windows, weak_residuals
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.units import GRAVITY

# Model form: what a rig whose only fault is its tolerances leaves of an equation, relative to the equation's own
# size. On such rigs (other friction, gas and valve laws, none of them faulty) 0.05 % brings every equation to about
# one [calibration: rigs with other friction, gas and valve laws and no fault]
MODEL_FORM: Final = 5e-4
NOISE_DRAWS: Final = 4  # draws of sensor noise that its residuals are estimated from [numerics]
PARAMETER_STEP: Final = 0.5  # prior sigmas, forward difference of a parameter [numerics]
FIRST_SENSOR_STEP: Final = 0.05  # share of a sensor shape's unit, forward difference [numerics]
DENSE: Final = 0.9  # share of a channel's usual samples that a window must have [taste]
# Channels that an equation reads [definition]
FEEDS: Final = {
    "heave": MEASURED,
    "pitch": MEASURED,
    "front_axle": ("sprung_front", "unsprung_front", "front_pressure"),
    "rear_axle": ("sprung_rear", "unsprung_rear", "rear_pressure"),
    "front_air": ("sprung_front", "unsprung_front", "front_pressure"),
    "rear_air": ("sprung_rear", "unsprung_rear", "rear_pressure"),
}


@dataclass(frozen=True)
class Design:
    """Whitened linear problem of one log: residual + columns @ coefficients.

    Attributes
    ----------
    residual : (K, 6) of :data:`~pneumo_ros.diagnosis.half_car.where.weak.EQUATIONS`, nominal parameters, in null
        standard deviations
    parameters : (P, K, 6) change by one standard deviation of each nuisance parameter
    columns : (B, K, 6) change by each basis
    null : (6,) null standard deviation of each equation, in its unit
    weight : (K, 6) 1 where every channel the equation needs has real samples in the window
    bases : the B shapes
    windows : where the K rows lie
    features : local motion of the log
    signals : the log
    nonlinear : place of a sensor -> (K, 6) what its correction changes beyond the linear columns, in null standard
        deviations, see :func:`with_sensor_columns`
    """

    residual: Array
    parameters: Array
    columns: Array
    null: Array
    weight: Array
    bases: list[Basis]
    windows: Windows
    features: Features
    signals: Signals
    nonlinear: dict[str, Array] = field(default_factory=dict)


def inputs_of(signals: Signals) -> Inputs:
    """What the equations are fed with."""
    return Inputs(signals.measured, signals.commands, signals.road, signals.period)


def car_of(model: RigModel, nuisance: Array | None = None) -> HalfCar:
    """The half car of a model with (P,) nuisance values; None is nominal."""
    body, front, rear = model.plant(nuisance)
    return HalfCar(body, front, rear, model.surface)


def design_of(
    model: RigModel,
    signals: Signals,
    yardstick: Yardstick | None = None,
    seed: int = 0,
) -> Design:
    """Residuals and columns of a log about the nominal parameters; logs that share coefficients share a yardstick."""
    car, inputs = car_of(model), inputs_of(signals)
    windows = make_windows(len(signals.measured), signals.period)
    residual = weak_residuals(car, inputs, windows)
    features = features_of(signals, car, yardstick)
    bases = all_bases(features)
    null = np.hypot(sensor_noise(car, inputs, windows, signals.noise, seed), model_form(car, features))
    weight = window_weights(signals, windows)
    columns = np.array([_column(basis, car, inputs, windows, residual, features, FIRST_SENSOR_STEP) for basis in bases])
    whitened = weight / null
    return Design(
        residual * whitened,
        _parameter_columns(model, inputs, windows, residual) * whitened,
        columns * whitened,
        null,
        weight,
        bases,
        windows,
        features,
        signals,
    )


def with_sensor_columns(design: Design, model: RigModel, place: str, coefficients: Array) -> Design:
    """The same design with one sensor's columns taken at its estimated error.

    A spring's force is not linear in its height, and a stop has a corner. So the columns are the derivatives at the
    estimate, and what the estimate changes beyond its linear part is kept in ``nonlinear``.

    Parameters
    ----------
    place : of the sensor, "sensor:<channel>"
    coefficients : its estimated error, one factor for each of the place's bases
    """
    rows = [k for k, basis in enumerate(design.bases) if basis.place == place]
    car, inputs = car_of(model), inputs_of(design.signals)
    there = inputs.measured.copy()
    for k, value in zip(rows, coefficients, strict=True):
        there[:, design.bases[k].column] += value * design.bases[k].series
    moved = inputs._replace(measured=there)
    before = weak_residuals(car, inputs, design.windows)
    after = weak_residuals(car, moved, design.windows)
    whitened = design.weight / design.null
    columns = design.columns.copy()
    for k in rows:
        step = _column(design.bases[k], car, moved, design.windows, after, design.features, FIRST_SENSOR_STEP)
        columns[k] = step * whitened
    rest = (after - before) * whitened - np.tensordot(coefficients, columns[rows], 1)
    return replace(design, columns=columns, nonlinear={**design.nonlinear, place: rest})


def sensor_noise(car: HalfCar, inputs: Inputs, windows: Windows, noise: Array, seed: int = 0) -> Array:
    """(6,) standard deviation that white sensor noise alone gives each residual, found by adding simulated noise."""
    rng = np.random.default_rng(seed)
    base = weak_residuals(car, inputs, windows)
    draws = [
        weak_residuals(car, inputs._replace(measured=_noisy(inputs.measured, noise, rng)), windows) - base
        for _ in range(NOISE_DRAWS)
    ]
    return np.asarray(np.sqrt(np.mean(np.square(draws), axis=(0, 1))))


def _noisy(measured: Array, noise: Array, rng: np.random.Generator) -> Array:
    return np.asarray(measured + rng.normal(size=measured.shape) * noise)


def model_form(car: HalfCar, features: Features) -> Array:
    """(6,) residual of each equation on a rig without a fault whose laws are not quite the model's, in its unit."""
    body = car.body
    weight = body.sprung_mass * GRAVITY
    arm = 0.5 * (body.front_arm + body.rear_arm)
    axles = [
        (body.rear_arm, body.unsprung_mass_front),
        (body.front_arm, body.unsprung_mass_rear),
    ]
    tyres = [weight * share / (2.0 * arm) + mass * GRAVITY for share, mass in axles]
    flows = [float(np.mean(end.per_outlet * end.outlet)) for end in features.ends]
    return MODEL_FORM * np.array([weight, weight * arm, *tyres, *flows])


def window_weights(signals: Signals, windows: Windows) -> Array:
    """(K, 6) 1 for a window in which each channel that the equation needs is sampled as densely as it is overall.

    Under the window and its derivatives alike: these weigh a gap at the window's edge, where it is small itself.
    """
    out = np.ones((len(windows.centres), len(EQUATIONS)))
    kernels = [np.abs(kernel) / np.sum(np.abs(kernel)) for kernel in windows.window[:3]]
    for kernel in kernels:
        present = np.column_stack([averaged(signals.weight[:, c], kernel, windows.centres) for c in range(6)])
        usual = np.maximum(np.median(present, axis=0), 1e-9)
        for e, equation in enumerate(EQUATIONS):
            for channel in FEEDS[equation]:
                c = MEASURED.index(channel)
                out[:, e] *= present[:, c] > DENSE * usual[c]
    return out


def _parameter_columns(model: RigModel, inputs: Inputs, windows: Windows, residual: Array) -> Array:
    nominal = np.array([p.nominal for p in model.parameters])
    out = []
    for k, parameter in enumerate(model.parameters):
        moved = nominal.copy()
        moved[k] += PARAMETER_STEP * parameter.std
        out.append((weak_residuals(car_of(model, moved), inputs, windows) - residual) / PARAMETER_STEP)
    return np.array(out).reshape(len(out), *residual.shape)


def _column(
    basis: Basis, car: HalfCar, inputs: Inputs, windows: Windows, residual: Array, features: Features, step: float
) -> Array:
    """Change of the residuals (K, 6) by one unit of a basis."""
    i, body = basis.column, car.body
    if basis.kind == "sensor":
        moved = inputs.measured.copy()
        moved[:, i] += step * basis.series
        return (weak_residuals(car, inputs._replace(measured=moved), windows) - residual) / step
    out = np.zeros_like(residual)
    if basis.kind == "road":
        stiffness = (body.tyre_stiffness_front, body.tyre_stiffness_rear)[i]
        out[:, 2 + i] = -stiffness * averaged(basis.series, windows.window.value, windows.centres)
    elif basis.kind == "supply":
        for k, end in enumerate(features.ends):
            flow = end.inlet * inlet_gain(end.pressure, end.per_inlet, car, k) * basis.series
            out[:, 4 + k] = -averaged(flow, windows.window.value, windows.centres)
    else:
        mean = averaged(basis.series, windows.window.value, windows.centres)
        arm = (body.front_arm, -body.rear_arm)[i]
        for equation, factor in {
            "force": ((0, -1.0), (1, -arm), (2 + i, 1.0)),
            "air": ((4 + i, -1.0),),
            "axle": ((2 + i, -1.0),),
            "heave": ((0, -1.0),),
            "pitch": ((1, -1.0),),
        }[basis.kind]:
            out[:, equation] = factor * mean
    return out


def inlet_gain(pressure: Array, per_inlet: Array, car: HalfCar, i: int) -> Array:
    """(N,) change of the inlet's mass flow per m2 with supply pressure, kg/(s m2 Pa).

    In choked flow it is flow over pressure; near balance it is steeper, by the slope of Eq. 4.7.
    """
    gas = (car.front, car.rear)[i]
    ratio = np.clip(pressure / gas.supply_pressure, gas.critical, 1.0 - 1e-6)
    n = gas.exponent
    bracket = ratio ** (2.0 / n) - ratio ** ((n + 1.0) / n)
    slope = (2.0 / n * ratio ** (2.0 / n) - (n + 1.0) / n * ratio ** ((n + 1.0) / n)) / (2.0 * bracket)
    return np.asarray(per_inlet / gas.supply_pressure * (1.0 - np.where(ratio > gas.critical, slope, 0.0)))


def pressure_rates(flow: Array, features: Features, i: int) -> Array:
    """dP/dt, Pa/s, that a mass flow (N,) into the spring gives: n P / m times the flow."""
    end = features.ends[i]
    return np.asarray(end.gas.exponent * end.pressure / end.mass * flow)
