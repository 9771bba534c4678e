# SPDX-License-Identifier: Apache-2.0
"""How far: the gap on data that nothing was fitted to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.box import bounded_newton
from pneumo_ros.diagnosis.fit.problem import INITIAL_WIDENING, scale_of, stated_form
from pneumo_ros.diagnosis.fit.record_pace import pace_of
from pneumo_ros.diagnosis.model import Model
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.effects.parameters import Active


def free_run(model: Model, record: Record, nuisance: Array, active: Sequence[Active]) -> Array:
    """Prediction of a held-out log from its measured initial state, (N, C).

    The state at the first row is refined on the first moments alone (``settle`` of its pace): sensors have noise.
    Parameters stay.
    """
    return model.predict(record, nuisance, settle(model, record, nuisance, active), active)


def settle(model: Model, record: Record, nuisance: Array, active: Sequence[Active], rounds: int = 2) -> Array:
    """Initial state (S,): measured, refined by least squares over the first moments within its own uncertainty."""
    rows = min(len(record.measured), max(8, round(pace_of(record).settle / record.period)))
    state, std = model.initial(record, active)
    std = INITIAL_WIDENING * std
    centre, sigma = state.copy(), np.maximum(record.noise, 1e-3 * scale_of(record))
    weight = record.weight[:rows] / sigma

    def residual(x: Array) -> Array:
        return ((record.measured[:rows] - model.predict(record, nuisance, x, active, rows)) * weight).ravel()

    for _ in range(rounds):
        r = residual(state)
        if not np.all(np.isfinite(r)):
            return centre
        J = np.empty((r.size, len(state)))
        for m in range(len(state)):
            moved = state.copy()
            moved[m] += 0.1 * std[m]
            J[:, m] = (residual(moved) - r) / 0.1
        J[~np.isfinite(J)] = 0.0
        # A wrong model misses the first moments as well: its misfit must not be blamed on the initial state.
        strength = 1.0 / max(1.0, float(np.mean(r * r)))
        prior = (state - centre) / std
        move = bounded_newton(
            strength * J.T @ J + np.eye(len(state)), strength * J.T @ r + prior, -9.0 - prior, 9.0 - prior
        )
        state = state + std * move
    return state


def channel_gaps(record: Record, predicted: Array) -> Array:
    """(C,) rms of log - prediction over the std of the log's channel; 1e3 where it diverged, NaN without a sample."""
    there = record.weight > 0.0
    error = np.where(there, record.measured - predicted, 0.0)
    rms = np.sqrt(np.sum(error**2, axis=0) / np.maximum(there.sum(axis=0), 1))
    return np.where(there.any(axis=0), np.where(np.isfinite(rms), rms / scale_of(record), 1e3), np.nan)


def total_gap(per_channel: Array) -> float:
    """Contract section 3: root mean square over the channels that were measured."""
    return float(np.sqrt(np.nanmean(np.square(per_channel))))


def bootstrap_shrink(record: Record, refit: Array, best: Array, draws: int = 400, seed: int = 1) -> tuple[float, float]:
    """90 % interval of 1 - gap(best)/gap(refit) by moving blocks of time, both errors drawn together.

    Blocks wrap around the end (Politis and Romano 1992), so that no part of the log is drawn less often than another.
    """
    there = record.weight > 0.0
    scale = scale_of(record) * np.sqrt(np.maximum(there.sum(axis=0), 1))
    squares = [np.sum(np.where(there, (record.measured - y) / scale, 0.0) ** 2, axis=1) for y in (refit, best)]
    if not all(np.all(np.isfinite(s)) for s in squares):
        return (-np.inf, 0.0)
    length = max(1, round(pace_of(record).wander / record.period))
    sums = [np.convolve(np.concatenate([s, s[: length - 1]]), np.ones(length), mode="valid") for s in squares]
    rng = np.random.default_rng(seed)
    count = max(1, len(squares[0]) // length)
    starts = rng.integers(0, len(sums[0]), size=(draws, count))
    ratio = np.sqrt(sums[1][starts].sum(axis=1) / np.maximum(sums[0][starts].sum(axis=1), 1e-300))
    low, high = np.quantile(1.0 - ratio, [0.05, 0.95])
    return float(low), float(high)


def total_floor(record: Record) -> float:
    """Gap that sensors' noise and the model's stated form leave together."""
    return float(np.hypot(total_gap(noise_floor(record)), stated_form(record)))


def noise_floor(record: Record) -> Array:
    """(C,) gap that the sensors' white noise alone leaves; NaN for a channel without a sample."""
    return np.where((record.weight > 0.0).any(axis=0), record.noise / scale_of(record), np.nan)
