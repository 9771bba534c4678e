# SPDX-License-Identifier: Apache-2.0
"""Differentiator and least squares: exactness, robustness to noise, and that no gain can blow them up."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as fast
from hypothesis import strategies as st

from pneumo_ros.errors import InputError
from pneumo_ros.estimation.differentiator import Differentiator, scaled_gains
from pneumo_ros.estimation.least_squares import (
    BOUNDED,
    EXPONENTIAL,
    GRADIENT,
    LEAST_SQUARES,
    forgetting_factor,
    initial_gain,
    norm,
    update,
)

PERIOD = 0.002


def run_bank(bank: Differentiator, samples: np.ndarray) -> np.ndarray:
    state = bank.init(samples[0])
    out = []
    for row in samples:
        state, derivatives = bank.step(state, row)
        out.append(derivatives)
    return np.array(out)


def test_gains_are_levants_published_ones() -> None:
    np.testing.assert_allclose(scaled_gains(2, 1.0), [1.1, 2.12, 2.0], atol=5e-3)
    np.testing.assert_allclose(scaled_gains(3, 1.0), [1.1, 3.06, 4.16, 3.0], atol=5e-3)
    np.testing.assert_allclose(scaled_gains(5, 1.0), [1.1, 6.75, 20.26, 32.24, 23.72, 7.0], atol=5e-3)


@pytest.mark.parametrize(("order", "filtering"), [(2, 0), (3, 0), (2, 1)])
def test_derivatives_of_a_slow_sine_converge(order: int, filtering: int) -> None:
    t = np.arange(2000) * PERIOD
    w = 3.0
    bank = Differentiator(order, filtering, np.array([1.5 * w ** (order + 1)]), PERIOD)
    out = run_bank(bank, np.sin(w * t)[:, None])[1000:, 0]
    assert np.max(np.abs(out[:, 1] - w * np.cos(w * t[1000:]))) < 0.01
    assert np.max(np.abs(out[:, 2] + w**2 * np.sin(w * t[1000:]))) < 0.5


def test_error_of_the_rate_falls_with_the_period_as_the_theory_says() -> None:
    """Rate error of order 2 without noise is O(T^2) (proper discretisation): halving T divides it by about 4."""
    errors = []
    for period in (0.004, 0.002):
        t = np.arange(int(4.0 / period)) * period
        out = run_bank(Differentiator(2, 0, np.array([40.0]), period), np.sin(3.0 * t)[:, None])
        errors.append(np.max(np.abs(out[len(t) // 2 :, 0, 1] - 3.0 * np.cos(3.0 * t[len(t) // 2 :]))))
    assert 2.8 < errors[0] / errors[1] < 5.7


def test_bad_order_is_refused() -> None:
    with pytest.raises(InputError, match="order"):
        Differentiator(0, 0, np.ones(1), PERIOD)
    with pytest.raises(InputError, match="order"):
        Differentiator(5, 5, np.ones(1), PERIOD)


def estimate(method: int, forgetting: float, bound: float, truth: np.ndarray, noise: float = 0.0) -> np.ndarray:
    """Estimates of parameters (N, 2) seen through a regressor like the rig's."""
    rng = np.random.default_rng(2)
    W = np.array([[5.0, 10.0], [6.0, -8.0]])
    a, P = np.array([0.3, 2.0]), 10.0 * np.eye(2)
    out = []
    for row in truth:
        y = W @ row + noise * rng.standard_normal(2)
        a, P = update(method, a, P, W, y - W @ a, forgetting, bound, PERIOD)
        out.append(a)
    return np.array(out)


def test_every_method_finds_constant_parameters() -> None:
    truth = np.tile([1.0, 0.6], (1000, 1))
    for method in (GRADIENT, EXPONENTIAL, BOUNDED, LEAST_SQUARES):
        last = estimate(method, 50.0, 20.0, truth)[-1]
        np.testing.assert_allclose(last, truth[-1], rtol=2e-3 if method == LEAST_SQUARES else 1e-6)


def test_exponential_forgetting_follows_with_time_constant_one_over_lambda() -> None:
    """A unit step is followed as 1 - exp(-lambda t), exactly, whatever the regressor: the exact discrete solution."""
    truth = np.tile([1.0, 0.6], (1500, 1))
    truth[1000:] += 1.0
    out = estimate(EXPONENTIAL, 50.0, 1.0, truth)
    t = (np.arange(500) + 1) * PERIOD
    np.testing.assert_allclose(out[1000:, 0], 2.0 - np.exp(-50.0 * t), atol=2e-4)


def test_forgetting_trades_noise_for_speed() -> None:
    truth = np.tile([1.0, 0.6], (4000, 1))
    spread = [estimate(BOUNDED, f, 1e3, truth, noise=1.0)[2000:, 0].std() for f in (10.0, 100.0)]
    assert spread[1] > 2.0 * spread[0]


def test_bounded_forgetting_keeps_the_gain_bounded_without_excitation() -> None:
    a, P = np.ones(2), 10.0 * np.eye(2)
    grown = P
    for _ in range(1000):
        a, P = update(BOUNDED, a, P, np.zeros((2, 2)), np.zeros(2), 50.0, 20.0, PERIOD)
        _, grown = update(EXPONENTIAL, a, grown, np.zeros((2, 2)), np.zeros(2), 50.0, 20.0, PERIOD)
    assert norm(P) <= 20.0 + 1e-9
    assert norm(grown) > 1e9


@fast(max_examples=60, deadline=None)
@given(
    st.sampled_from([GRADIENT, LEAST_SQUARES, EXPONENTIAL, BOUNDED]),
    st.floats(0.0, 500.0),
    st.floats(-3.0, 6.0),
    st.floats(-2.0, 4.0),
)
def test_no_gain_makes_the_parameter_error_grow(method: int, forgetting: float, gain: float, size: float) -> None:
    """The prediction error never grows in a step with exact data, for any forgetting, gain and regressor size."""
    W = 10.0**size * np.array([[1.0, 2.0], [1.2, -1.6]])
    a, P, truth = np.zeros(2), 10.0**gain * np.eye(2), np.array([1.0, 0.5])
    last = np.inf
    for _ in range(50):
        a, P = update(method, a, P, W, W @ (truth - a), forgetting, 1e9, PERIOD)
        error = float(np.linalg.norm(W @ (truth - a)))
        assert np.isfinite(error) and error <= last * (1.0 + 1e-6) + 1e-6 * 10.0**size
        assert P[0, 0] > 0.0 and P[0, 0] * P[1, 1] - P[0, 1] ** 2 > -1e-9 * P[0, 0] * P[1, 1]
        last = error


@pytest.mark.parametrize("P", [[[3.0, 1.2], [1.2, 0.7]], [[0.5, -0.4], [-0.4, 4.0]], [[2.0, 0.0], [0.0, 2.0]], [[1.7]]])
def test_the_norm_of_a_gain_is_its_largest_eigenvalue(P: list[list[float]]) -> None:
    gain = np.array(P)
    largest = float(np.linalg.eigvalsh(gain)[-1])
    assert norm(gain) == pytest.approx(largest, rel=1e-14)
    assert forgetting_factor(BOUNDED, gain, 3.0, 5.0) == pytest.approx(3.0 * (1.0 - largest / 5.0))
    assert forgetting_factor(BOUNDED, gain, 3.0, 0.5 * largest) == 0.0, "a gain beyond the bound is not made larger"
    assert forgetting_factor(EXPONENTIAL, gain, 3.0, 5.0) == 3.0
    assert forgetting_factor(LEAST_SQUARES, gain, 3.0, 5.0) == forgetting_factor(GRADIENT, gain, 3.0, 5.0) == 0.0


@pytest.mark.parametrize("size", [1, 2])
@pytest.mark.parametrize("forgetting", [4.0, 0.5])
def test_one_step_is_that_of_numpys_inverses(size: int, forgetting: float) -> None:
    """The discrete form by matrices: information fades and grows by the regressor; the gain moves the parameters."""
    rng = np.random.default_rng(size)
    W, residual, a = rng.normal(size=(2, size)), rng.normal(size=2), rng.normal(size=size)
    root = rng.normal(size=(size, size))
    P = initial_gain(size, 2.0) + root @ root.T
    period = 0.01
    new, gain = update(EXPONENTIAL, a, P, W, residual, forgetting, 1e9, period)
    fade = np.exp(-forgetting * period)
    weight = (1.0 - fade) / forgetting
    expected = np.linalg.inv(fade * np.linalg.inv(P) + weight * W.T @ W)
    np.testing.assert_allclose(gain, expected, rtol=1e-12)
    np.testing.assert_allclose(new, a + weight * expected @ W.T @ residual, rtol=1e-12)
    np.testing.assert_array_equal(initial_gain(size, 2.0), 2.0 * np.eye(size))
