# SPDX-License-Identifier: Apache-2.0
"""Where something acts that no shape follows: at which place a free time course explains what the free run leaves.

The equations along the measured motion (:mod:`pneumo_ros.diagnosis.half_car.where.time_course`) show a force only where
it is larger than their noise in one window; a free run adds up what a newton of wind does in seconds. So each place
may add any smooth time course to the refit's free run along the held-out log, linearised about it, and the places are
compared by the evidence for such an input: a Gaussian process whose variance is chosen by maximum marginal likelihood
(latent force models: Alvarez, Luengo, Lawrence 2013, IEEE TPAMI 35, 2693-2705; Rogers and Friis, arXiv 2109.10681).
A sensor's error is such a time course of its own channel. The tolerances and the first state answer first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.interpolate import BSpline

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import INITIAL_WIDENING, stated_form
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.diagnosis.judge.held_out import settle
from pneumo_ros.diagnosis.search.screening import SENSOR
from pneumo_ros.effects.composition import CORRECTIONS
from pneumo_ros.effects.rig_model import RigModel

KNOTS: Final = 0.05  # s between knots of the cubic splines: they follow what moves at up to some 9 Hz [numerics]
ROWS: Final = 0.02  # s between rows that are compared [numerics]
LONGEST: Final = 20.0  # s of a log that are looked at: time and memory grow with the square [numerics]
# Prior variances of a time course that are tried, its response's mean square over that of the noise [numerics]
VARIANCES: Final = tuple(float(v) for v in np.geomspace(1e-2, 1e6, 33))
# Forward differences: m, m/s and Pa of the state, N, Pa/s, N m and Pa of the corrections [numerics]
STATE_STEPS: Final = (*[1e-6] * 4, *[1e-5] * 4, 10.0, 10.0)
STATES: Final = len(STATE_STEPS)  # positions, speeds and pressures of a run [definition]
# As the steps of the state, one for each of CORRECTIONS [numerics]
INPUT_STEPS: Final = (1.0, 1.0, 1e4, 1e4, 1.0, 1.0, 1.0, 0.1, 100.0)
PARAMETER_STEP: Final = 0.1  # standard deviations [numerics]
# Share of the whole, and of what is left, that a further place must close to be told [taste]
FURTHER: Final = (0.1, 0.5)
MOST: Final = 3  # places, two that one thing moves as one [taste]
CLOSED: Final = 0.5  # share of the whole that they must close: what is quicker than the splines is not seen [numerics]
BODY: Final = ("body_heave", "body_pitch")  # a force on the body, wherever it acts [definition]
STRUTS: Final = ("front_force", "rear_force")  # what acts along both struts [definition]
AIRS: Final = ("front_air", "rear_air")  # what acts on the air of both springs [definition]
# A place of the contract, or several that one thing moves -> the inputs that it drives [definition]
INPUTS: Final[Mapping[tuple[str, ...], tuple[str, ...]]] = {
    **{(name,): (name,) for name in CORRECTIONS},
    BODY: BODY,
    STRUTS: STRUTS,
    AIRS: AIRS,
    ("road_input",): ("front_tyre", "rear_tyre"),  # a road that is off pushes both axles
}


@dataclass(frozen=True)
class Courses:
    """Time courses of every input as a least-squares problem, freed from what tolerances and the first state can do.

    Attributes
    ----------
    parts : input, or place of a sensor, -> its columns
    columns : (n, M) what the splines of all inputs do to the outputs, in sigmas, each input's rms about one
    residual : (n,) what the run leaves, in sigmas
    answered : (A, M + 1) of columns and residual what tolerances and first state answer: products are those of the
        columns less those of these
    """

    parts: Mapping[str, slice]
    columns: Array
    residual: Array
    answered: Array

    @property
    def whole(self) -> float:
        """Sum of squares of the residual, sigma squared."""
        own = self.answered[:, -1]
        return float(self.residual @ self.residual - own @ own)

    def evidence(self, inputs: Sequence[str]) -> tuple[float, float]:
        """Gain of the log marginal likelihood over no input, at the best variance, and the share of the residual's
        squares that is left there.
        """
        D, A = (np.concatenate([of[:, self.parts[name]] for name in inputs], axis=1)
                for of in (self.columns, self.answered))  # fmt: skip
        values, vectors = np.linalg.eigh(D.T @ D - A.T @ A)
        product = D.T @ self.residual - A.T @ self.answered[:, -1]
        values, seen = np.maximum(values, 0.0), vectors.T @ product
        best = (-np.inf, 1.0)
        for v in VARIANCES:
            shrunk = v / (1.0 + v * values)
            gain = 0.5 * float(np.sum(shrunk * seen**2) - np.sum(np.log1p(v * values)))
            closed = float(np.sum(shrunk * (2.0 - values * shrunk) * seen**2))
            best = max(best, (gain, 1.0 - closed / max(self.whole, 1e-300)))
        return best


def latent_places(model: RigModel, record: Signals, nuisance: Array) -> tuple[tuple[str, float], ...]:
    """Places whose free time courses explain what the free run leaves of a log, with the share of its squares that each
    closes, in the order found; empty where they close less than :data:`CLOSED`, where the run has no end, or where the
    rig's configuration holds effects.

    The first is the one of largest evidence; the body's heave and pitch, both struts, or the air of both springs count
    as one. A further one is told where it closes :data:`FURTHER`.

    Parameters
    ----------
    model : the rig
    record : the held-out log
    nuisance : (P,) tolerances of the refit
    """
    if model.configured:  # the linearised step would begin their memories anew
        return ()
    record = _loudest(model, record, nuisance)
    states = model.states(record, nuisance, settle(model, record, nuisance, ()))
    if not np.all(np.isfinite(states)):
        return ()
    found = _courses(model, record, nuisance, states)
    places = dict(INPUTS)
    places |= {(name,): (name,) for name in found.parts if name not in CORRECTIONS}
    out: list[tuple[str, float]] = []
    inputs: tuple[str, ...] = ()
    left = 1.0
    for number in range(MOST):
        tried = {told: found.evidence((*inputs, *own)) for told, own in places.items() if not set(own) & set(inputs)}
        told = max(tried, key=lambda place: tried[place][0])
        closed = left - tried[told][1]
        if number and (closed < FURTHER[0] or closed < FURTHER[1] * left):
            break
        out += _shared(told, left, {place: share for place, (_, share) in tried.items()})
        inputs, left = (*inputs, *places[told]), tried[told][1]
    return tuple(out) if left < 1.0 - CLOSED else ()


def _loudest(model: RigModel, record: Signals, nuisance: Array) -> Signals:
    """The :data:`LONGEST` part of a log of which the free run leaves most, a log of its own; a shorter log whole."""
    count, every = round(LONGEST / record.period), round(1.0 / record.period)
    if len(record.measured) <= count:
        return record
    left = record.measured - model.predict(record, nuisance, settle(model, record, nuisance, ()))
    squares = np.nansum((left * record.weight / record.noise) ** 2, axis=1)
    starts = range(0, len(squares) - count + 1, every)
    first = max(starts, key=lambda start: float(squares[start : start + count].sum()))
    return record.slice(first, first + count)


def _shared(told: tuple[str, ...], left: float, tried: Mapping[tuple[str, ...], float]) -> list[tuple[str, float]]:
    """What a place closes of the share that was left; of two that count as one each one's part, averaged over both
    orders, the larger first.

    ``tried`` : place -> share that is left with it"""
    closed = left - tried[told]
    if len(told) == 1:
        return [(told[0], closed)]
    one, other = (left - tried[place,] for place in told)
    parts = [(told[0], 0.5 * (one + closed - other)), (told[1], 0.5 * (other + closed - one))]
    return sorted(((place, max(part, 0.0)) for place, part in parts), key=lambda item: -item[1])


def _courses(model: RigModel, record: Signals, nuisance: Array, states: Array) -> Courses:
    """The problem of a log about a run with states (N, 10)."""
    every = max(1, round(ROWS / record.period))
    rows = np.arange(0, len(states), every)
    weight = record.weight[rows] / np.hypot(record.noise, stated_form(record) * record.scale)
    predicted = model.simulate(record, nuisance, states[0])
    residual = ((record.measured - predicted)[rows] * weight).ravel()

    def weighed(change: Array) -> Array:
        """(rows, 6, M) as columns, in sigmas."""
        return np.asarray((change * weight[:, :, None]).reshape(len(residual), -1))

    splines = _splines(len(rows), every * record.period)
    step, held = _linearised(model, record, nuisance, states[rows], every)
    shows, none = _shown(model, states[0]), np.zeros(STATES)
    names = (*CORRECTIONS, *(f"{SENSOR}{name}" for name in model.channels))
    count = splines.shape[1]
    parts = {name: slice(k * count, (k + 1) * count) for k, name in enumerate(names)}
    columns = np.empty((len(residual), count * len(names)))  # filled one by one: together they are what memory holds
    for k, name in enumerate(CORRECTIONS):
        columns[:, parts[name]] = weighed(shows @ _responses(step, held[:, :, k, None] * splines[:-1, None, :], none))
    for k, channel in enumerate(model.channels):
        own = np.eye(len(model.channels))[k][None, :, None] * splines[:, None, :]
        columns[:, parts[f"{SENSOR}{channel}"]] = weighed(own)
    for part in parts.values():
        columns[:, part] /= max(float(np.sqrt(np.mean(np.sum(columns[:, part] ** 2, axis=0)))), 1e-300)
    free = INITIAL_WIDENING * np.diag(model.initial(record, ())[1])
    first = shows @ _responses(step, np.zeros((len(step), STATES, STATES)), free)
    answers = weighed(np.concatenate([first, _by_tolerances(model, record, nuisance, states[0])[rows]], axis=2))
    # Their prior is the unit normal: the residual's covariance without an input is I + A A', inverted by Woodbury.
    root = np.linalg.cholesky(np.eye(answers.shape[1]) + answers.T @ answers)
    products = np.column_stack([answers.T @ columns, answers.T @ residual])
    return Courses(parts, columns, residual, np.linalg.solve(root, products))


def _splines(count: int, period: float) -> Array:
    """Cubic splines over ``count`` rows, (count, M)."""
    time = np.arange(count) * period
    knots = KNOTS * np.arange(-3, int(time[-1] / KNOTS) + 5)
    return np.asarray(BSpline.design_matrix(time, knots, 3).toarray())


def _linearised(model: RigModel, record: Signals, nuisance: Array, states: Array, every: int) -> tuple[Array, Array]:
    """What ``every`` rows make of a state and of corrections held over them, about a run (K, 10) of every so many rows:
    (K-1, 10, 10) and (K-1, 10, 9).
    """
    count = len(states) - 1
    step, held = np.empty((count, STATES, STATES)), np.empty((count, STATES, len(CORRECTIONS)))
    none = np.zeros((every, len(CORRECTIONS)))
    for i in range(count):
        part = slice(i * every, (i + 1) * every + 1)
        piece = replace(record, measured=record.measured[part], commands=record.commands[part], road=record.road[part])

        def end(x: Array, correction: Array, piece: Signals = piece) -> Array:
            return model.states(piece, nuisance, x, (), correction)[-1]

        base = end(states[i], none)
        for k, size in enumerate(STATE_STEPS):
            step[i, :, k] = (end(states[i] + size * np.eye(STATES)[k], none) - base) / size
        for k, size in enumerate(INPUT_STEPS):
            correction = none.copy()
            correction[:, k] = size
            held[i, :, k] = (end(states[i], correction) - base) / size
    return step, held


def _responses(step: Array, forcing: Array, start: Array) -> Array:
    """(K, 10, M) of x[i+1] = step[i] x[i] + forcing[i], (K-1, 10, M), from ``start``: (10,) or (10, M)."""
    out = np.empty((len(step) + 1, *forcing.shape[1:]))
    out[0] = start if start.ndim == 2 else start[:, None]
    for i in range(len(step)):
        out[i + 1] = step[i] @ out[i] + forcing[i]
    return out


def _shown(model: RigModel, state: Array) -> Array:
    """What the channels show of a change of the state, (6, 10)."""

    def moved(k: int, size: float) -> Array:
        change = size * np.eye(STATES)[k]
        return (model.simulate_channels(state + change) - model.simulate_channels(state - change)) / (2.0 * size)

    return np.stack([moved(k, size) for k, size in enumerate(STATE_STEPS)], axis=1)


def _by_tolerances(model: RigModel, record: Signals, nuisance: Array, initial: Array) -> Array:
    """Change of the channels by one standard deviation of each tolerance, (N, 6, P)."""
    base = model.simulate(record, nuisance, initial)

    def moved(k: int) -> Array:
        other = nuisance.copy()
        other[k] += PARAMETER_STEP * model.parameters[k].std
        return (model.simulate(record, other, initial) - base) / PARAMETER_STEP

    return np.stack([moved(k) for k in range(len(nuisance))], axis=2)
