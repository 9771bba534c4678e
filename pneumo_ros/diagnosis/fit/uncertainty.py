# SPDX-License-Identifier: Apache-2.0
"""Standard deviations of a fit's parameters, and what is wrong with the parameters themselves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, mean_squares
from pneumo_ros.diagnosis.model import parameters_at
from pneumo_ros.diagnosis.result import Estimate
from pneumo_ros.diagnosis.traits import HasDerived
from pneumo_ros.effects.parameters import EffectParameter, family_of, is_law

FAINTEST: Final = 1e-14  # curvature of the scaled unknowns below which rounding decides [numerics]
LONGEST: Final = 60  # fit samples over which the residual's correlation is summed [numerics]
TRUE_TO: Final = 2e-3  # relative accuracy of the sensitivities [numerics]
# Share of an effect's value that is added to its std: another law of the same kind puts its parameter that far off
# [taste]
LAW: Final = 0.015
NEAR: Final = 0.05  # of a border to another family: a value so near to it stands at it [taste]
UNUSED: Final = 1e-3  # share of a typical size below which an effect or an atom counts as absent [numerics]
NOTHING: Final = 1e-3  # sigmas, rms over all samples, that one typical size must move the outputs by [numerics]


def covariance(problem: Problem, fit: Fit, absent: bool = False) -> Array:
    """Covariance of the scaled unknowns: curvature of the data over what each channel leaves, correlation, and prior.

    An unknown at its bound does not vary; with ``absent`` sizes do that ended at none: for a curve, whose atoms might
    as well be there. Sensitivities are true to :data:`TRUE_TO` of themselves: a direction that moves the outputs by
    less than that tells nothing, and only the prior holds it.
    """
    assert fit.jacobian is not None
    free = _free(problem, fit)
    prior = np.where(np.arange(len(fit.x)) < problem.fixed, 1.0, 1e-9)
    if absent:
        sizes = [False] * problem.fixed + [p.size for p in problem.effect_parameters(fit.candidate)]
        free = free | (np.array(sizes, dtype=bool) & (np.abs(fit.x) < UNUSED))
        prior = np.maximum(problem.prior(fit.candidate), 1e-9)
    left = np.sqrt(mean_squares(fit.residual))  # as the cost weighs the channels
    J = (fit.jacobian[:, :, free] / left[:, None]).reshape(fit.residual.size, int(free.sum()))
    strength = 1.0 / correlation_time(fit.residual)
    size = np.sqrt(np.sum(J**2, axis=0) + prior[free])
    values, vectors = np.linalg.eigh((J / size).T @ (J / size))
    known = (vectors * np.maximum(values - len(size) * TRUE_TO**2, 0.0)) @ vectors.T
    # By its own directions: an inverse of what neither data nor prior hold may have variances below zero.
    values, vectors = np.linalg.eigh(strength * known + np.diag(prior[free] / size**2))
    out = np.zeros((len(fit.x), len(fit.x)))
    out[np.ix_(free, free)] = (vectors / np.maximum(values, FAINTEST)) @ vectors.T / np.outer(size, size)
    return out


def correlation_time(residual: Array) -> float:
    """Samples that count as one, 1 + 2 sum of autocorrelation up to its first zero; median of the channels."""
    times = []
    for column in (residual - residual.mean(axis=0)).T:
        power = float(column @ column)
        if power <= 0.0:
            continue
        total = 1.0
        for lag in range(1, min(LONGEST, len(column) - 1)):
            rho = float(column[lag:] @ column[:-lag]) / power
            if rho <= 0.0:
                break
            total += 2.0 * rho
        times.append(total)
    return float(np.median(times)) if times else 1.0


def effect_estimates(problem: Problem, fit: Fit, cov: Array) -> dict[str, Estimate]:
    """Effect parameters, SI; a name that two effects share is prefixed with the effect's id."""
    assert fit.jacobian is not None
    parameters = problem.effect_parameters(fit.candidate)
    owners = [
        effect for effect, site in fit.candidate.parts for _ in parameters_at(problem.model.effects[effect], site)
    ]
    names = [p.name for p in parameters]
    free = _free(problem, fit)
    out = {}
    for k, (p, owner) in enumerate(zip(parameters, owners, strict=True)):
        m = problem.fixed + k
        value = float(fit.x[m] * p.typical)
        moved = float(np.sqrt(np.mean(fit.jacobian[:, :, m] ** 2)))
        name = p.name if names.count(p.name) == 1 else f"{owner}.{p.name}"
        while name in out:
            name += "_2"
        at_bound = not free[m] and not _stands_at(p, value, p.ends)
        out[name] = Estimate(
            value, float(np.hypot(np.sqrt(cov[m, m]) * p.typical, LAW * value)), p.unit, at_bound, moved < NOTHING
        )
    return out | _derived(problem, fit, cov)


def _derived(problem: Problem, fit: Fit, cov: Array) -> dict[str, Estimate]:
    """What an effect's parameters give together, its variance by linear propagation."""
    out: dict[str, Estimate] = {}
    first = problem.fixed
    for effect, site in fit.candidate.parts:
        parameters = parameters_at(problem.model.effects[effect], site)
        scale = np.array([p.typical for p in parameters])
        block = slice(first, first + len(parameters))
        values, own = fit.x[block] * scale, cov[block, block] * np.outer(scale, scale)
        first += len(parameters)
        known = problem.model.effects[effect]
        for one in known.derived if isinstance(known, HasDerived) else ():
            value = one.of(tuple(values))
            steps = 1e-6 * np.maximum(np.abs(values), 1e-6 * scale)
            slope = np.array([(one.of(tuple(values + s * e)) - value) / s for s, e in zip(steps, np.eye(len(steps)),
                                                                                        strict=True)])  # fmt: skip
            name = one.name if one.name not in out else f"{effect}.{one.name}_2"
            out[name] = Estimate(value, float(np.hypot(np.sqrt(max(slope @ own @ slope, 0.0)), LAW * value)), one.unit)
    return out


def nuisance_estimates(problem: Problem, fit: Fit, cov: Array) -> dict[str, Estimate]:
    """Nuisance parameters, SI."""
    values = problem.nuisance(fit.x)
    free = _free(problem, fit)
    return {
        p.name: Estimate(float(values[m]), float(np.sqrt(cov[m, m]) * p.std), p.unit, not free[m])
        for m, p in enumerate(problem.model.parameters)
    }


def at_bounds(problem: Problem, fit: Fit, parts: Sequence[Part] | None = None) -> tuple[float, float]:
    """Number of effect parameters that ended at a bound of their range, in two sums, each with the weights below.

    The first sum is of sizes and of shape parameters of laws. A size at its bound counts 1 (nothing real is so large),
    and so does a shape parameter at a bound where another family begins; all other shape parameters of a law count
    0.5 together, because another law of the family may need them there. Where the family's flexible shape stands
    beside the law, a size of either counts 0.5 and the law's shape parameters nothing, for the law and the shape's
    other atoms can do the same; but not what lies beyond the border to another family, so that one at such a border
    counts as without it. The second sum is of the parameters of flexible shapes that are no sizes, 0.5 each.

    Parameters
    ----------
    problem, fit : the fitted structure
    parts : count these parts only; all by default"""
    free, values = _free(problem, fit)[problem.fixed :], problem.values(fit.candidate, fit.x)
    first, firm, bent = 0, 0.0, 0.0
    for part in fit.candidate.parts:
        own = problem.effect_parameters(Candidate((part,)))
        at = [(p, values[k]) for k, p in enumerate(own, first) if not free[k] or _crosses(p, values[k])]
        stuck = [(p, value) for p, value in at if not _stands_at(p, value, p.ends)]
        first += len(own)
        if parts is not None and part not in parts:
            continue
        law = is_law(part[0])
        beside = law and any(family_of(s[0]) == family_of(part[0]) for s in fit.candidate.shapes)
        crossed = sum(_crosses(p, value) for p, value in stuck)
        sizes = sum(p.size and not _crosses(p, value) for p, value in stuck)
        shaping = len(stuck) - crossed - sizes
        firm += crossed + sizes * (0.5 if beside or not law else 1.0) + (0.5 if law and not beside and shaping else 0.0)
        bent += 0.0 if law else 0.5 * shaping
    return firm, bent


def _stands_at(parameter: EffectParameter, value: float, ends: Sequence[float]) -> bool:
    """Whether the bound that a value stands at is one of these."""
    bound = min(parameter.low, parameter.high, key=lambda one: abs(value - one))
    return any(abs(bound - end) <= 1e-9 * abs(parameter.typical) for end in ends)


def _crosses(parameter: EffectParameter, value: float) -> bool:
    """Whether a value stands where another family begins, as nearly as a fit can tell."""
    least = 1e-9 * abs(parameter.typical)
    return any(abs(value - border) <= max(NEAR * abs(border), least) for border in parameter.borders)


def _free(problem: Problem, fit: Fit) -> Mask:
    low, high = problem.bounds(fit.candidate)
    width = np.where(np.isfinite(high - low), high - low, 1.0)
    return np.asarray((fit.x > low + 1e-6 * width) & (fit.x < high - 1e-6 * width))
