# SPDX-License-Identifier: Apache-2.0
"""Which candidates are worth a fit: each one's score is the gain it may bring beside refitted nuisance parameters.

A trial prediction with the effect at a start value moves the outputs by some trajectory (not only infinitesimally: a
deadband or a stop does nothing when small). Projected onto what nuisance parameters and initial state cannot do, and
compared with the residual, it tells the share of the misfit it could explain. Pairs need no further simulation: the
Gram matrix of the projected trajectories holds them, so that two effects that only work together are found as well.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, level, weights
from pneumo_ros.diagnosis.model import Model
from pneumo_ros.diagnosis.traits import IsScreened
from pneumo_ros.effects.parameters import SHAPE, Active, EffectParameter, family_of, is_law

SENSOR: Final = "sensor:"  # how the contract's places of sensors begin [definition]
# Share of the typical size of a second start: an effect may be saturated at its typical size already [taste]
SMALL: Final = 0.15
# Square of the relative difference at which two sensitivities are the same to their accuracy [numerics]
SAME_COLUMN: Final = 1e-7
# Times a trial's size up to which its line is followed: what the base's unknowns answer all but wholly would else
# explain anything, by a size without measure [numerics]
FOLLOWED: Final = 10.0


@dataclass(frozen=True)
class CandidateScore:
    """A candidate extension with the share of the misfit (mean square) that it may explain.

    Attributes
    ----------
    parts : the effects added
    values : their parameter values, SI, scaled by the linear estimate of the size
    share : 0..1
    """

    parts: tuple[Part, ...]
    values: tuple[float, ...]
    share: float


@dataclass(frozen=True)
class Trial:
    """An effect at a site, with or without its family's shape, start values and the change of the residual, (n, C)."""

    parts: tuple[Part, ...]
    values: tuple[float, ...]
    change: Array


def start_values(parameters: Sequence[EffectParameter]) -> list[tuple[float, ...]]:
    """Values worth trying: sizes typical, small and at their further starts; one shape parameter at a time
    elsewhere.
    """
    typical = [p.typical for p in parameters]
    tries = [tuple(typical)]
    tries.append(tuple(p.typical * SMALL if p.size else p.typical for p in parameters))
    for k, p in enumerate(parameters):
        for value in p.starts:
            tries.append(tuple(value if m == k else v for m, v in enumerate(typical)))
    sizes = [k for k, p in enumerate(parameters) if p.size]
    if len(sizes) > 1:  # each size alone, typical and small
        for share in (1.0, SMALL):
            tries += [
                tuple(v * share if m == k else v if m not in sizes else 0.0 for m, v in enumerate(typical))
                for k in sizes
            ]
    return list(dict.fromkeys(tries))


def all_parts(problem: Problem) -> list[Part]:
    """Every law of the library at every site."""
    return [(e.id, site) for e in problem.model.effects.values() if is_law(e.id) for site in e.sites]


def trials(problem: Problem, base: Fit, parts: Iterable[Part]) -> list[Trial]:
    """Each part at each start on top of a fit; what diverges or moves nothing is left out."""
    starts = [start for part in parts for start in _starts(problem, part)]
    return [trial for trial in changes(problem, base, starts) if trial is not None]


def changes(
    problem: Problem, base: Fit, starts: Iterable[tuple[tuple[Part, ...], tuple[float, ...]]], coarsely: bool = True
) -> list[Trial | None]:
    """Parts with start values simulated on top of a fit, ``coarsely`` where that will do; None for what diverges or
    moves nothing.
    """
    own = list(problem.values(base.candidate, base.x))
    coarsely = coarsely and problem.coarse_serves(base.candidate, base.x)
    predict = problem.predict_coarse if coarsely else problem.predict
    here = predict(base.candidate, base.x)

    def tried(what: tuple[tuple[Part, ...], tuple[float, ...]]) -> Trial | None:
        added, values = what
        candidate = Candidate((*base.candidate.parts, *added))
        x = problem.start(candidate, base.x[: problem.fixed], [*own, *values])
        with np.errstate(over="ignore", invalid="ignore"):
            change = (here - predict(candidate, x)) * problem.weight
        if not np.all(np.isfinite(change)) and coarsely:  # what is too stiff for coarse steps
            change = problem.residual(candidate, x) - base.residual
        seen = np.all(np.isfinite(change)) and np.max(np.abs(change)) > 1e-6
        return Trial(added, values, change) if seen else None

    return problem.each(tried, starts)


def _starts(problem: Problem, part: Part) -> list[tuple[tuple[Part, ...], tuple[float, ...]]]:
    """Starts of a law; and of its family's shape beside the law at nothing, one atom each, where that is screened."""
    own = problem.parameters_of[part]
    out: list[tuple[tuple[Part, ...], tuple[float, ...]]] = [((part,), values) for values in start_values(own)]
    shape = (f"{family_of(part[0])}.{SHAPE}", part[1])
    effect = problem.model.effects.get(shape[0])
    scanned = as_scanned(problem, part)
    if isinstance(effect, IsScreened) and is_law(part[0]) and scanned is None:
        still, atoms = [0.0 if p.size else p.typical for p in own], problem.parameters_of[shape]
        for k in effect.screened:
            alone = [p.typical if m == k or not p.size else 0.0 for m, p in enumerate(atoms)]
            out.append(((part, shape), (*still, *alone)))
            for m, p in enumerate(atoms):
                if not p.size:
                    out += [((part, shape), (*still, *alone[:m], value, *alone[m + 1 :])) for value in p.starts]
    return out if scanned is None else [*out, (scanned.parts, scanned.values)]


def as_scanned(problem: Problem, law: Part) -> CandidateScore | None:
    """A law at nothing with its family's shape as the logs were scanned for it; None where they were not."""
    shape = (f"{family_of(law[0])}.{SHAPE}", law[1])
    if shape not in problem.scanned or not is_law(law[0]):
        return None
    still = (0.0 if p.size else p.typical for p in problem.parameters_of[law])
    return CandidateScore((law, shape), (*still, *problem.scanned[shape]), 0.0)


def scanned_laws(problem: Problem, laws: Iterable[Part], scanned: Container[Part]) -> list[CandidateScore]:
    """:func:`as_scanned` of those laws whose shape is one of some that were scanned for."""
    found = [as_scanned(problem, law) for law in laws]
    return [one for one in found if one is not None and one.parts[1] in scanned]


def candidate_scores(problem: Problem, base: Fit, found: Sequence[Trial], pairs: bool = False) -> list[CandidateScore]:
    """Singles (or pairs) of the trials, the best first, one entry for each part (or pair of parts).

    Judged twice, and merged in turn: once with the unknowns that stand at a bound held there, once with them free,
    because the right effect is what lets them come back from it.
    """
    products, (low, high) = _products(problem, base, found), problem.bounds(base.candidate)
    free = (base.x > low + 1e-6) & (base.x < high - 1e-6)
    judged = [_candidate_scores(problem, found, products.projected(one), pairs) for one in _unlike(free)]
    merged: dict[tuple[Part, ...], CandidateScore] = {}
    for couple in zip_longest(*judged):
        for one in couple:
            if one is not None:
                merged.setdefault(one.parts, one)
    return list(merged.values())


def visibility(problem: Problem, base: Fit, found: Sequence[Trial]) -> dict[str, float]:
    """Effect id -> how far its typical size would move the outputs, nuisance parameters answered: rms in sigmas.

    The largest over its sites and starts; 0 where no trial moved anything. What is far below one could not have been
    seen.
    """
    gram, _, _ = projected(problem, base, found)
    count = float(np.count_nonzero(problem.weight[problem.fitted]))
    out = dict.fromkeys(filter(is_law, problem.model.effects), 0.0)
    for trial, square in zip(found, np.diag(gram), strict=True):
        name = trial.parts[0][0]
        out[name] = max(out[name], float(np.sqrt(max(square, 0.0) / count)))
    return out


def _unlike(free: Mask) -> list[Mask]:
    """The unknowns that count as free, those at bounds first held and then free; once where none is at a bound."""
    whole = np.ones_like(free)
    return [whole] if free.all() else [free, whole]


def _candidate_scores(
    problem: Problem, found: Sequence[Trial], products: tuple[Array, Array, float], pairs: bool
) -> list[CandidateScore]:
    gram, with_residual, total = products
    signed = np.array([_signed(problem, trial) for trial in found], dtype=bool)
    explained = _explained_by_pairs if pairs else _explained_alone
    share, sizes, members = explained(gram, -with_residual, signed)
    best: dict[tuple[Part, ...], CandidateScore] = {}
    for k in np.argsort(-share, kind="stable"):
        if share[k] <= 0.0:
            break
        parts = tuple(part for m in members[k] for part in found[m].parts)
        if parts in best or (pairs and not compatible(problem.model, *(found[m].parts[0] for m in members[k]))):
            continue
        values = [_scaled(problem, found[m], s) for m, s in zip(members[k], sizes[k], strict=True)]
        best[parts] = CandidateScore(parts, tuple(v for one in values for v in one), float(min(1.0, share[k] / total)))
    return list(best.values())


def compatible(model: Model, one: Part, other: Part) -> bool:
    """Whether two effects may act together: not two sensors' errors, and not one family at overlapping sites.

    Two sensor errors at once imitate almost anything (an unknown load moves several channels alike, a resonance moves
    all), so a second one is only looked for after the first is part of the structure.
    """
    if all(model.places(Active(*part, ()))[0].startswith(SENSOR) for part in (one, other)):
        return False
    return family_of(one[0]) != family_of(other[0]) or (one[1] != other[1] and "both" not in (one[1], other[1]))


def compatible_parts(problem: Problem, laws: Sequence[Part]) -> list[Part]:
    """Parts of the library that may act beside all of ``laws``, see :func:`compatible`."""
    return [p for p in all_parts(problem) if all(compatible(problem.model, law, p) for law in laws)]


def _signed(problem: Problem, trial: Trial) -> bool:
    """Whether the sizes of a trial may be negative."""
    return all(p.low < 0.0 for p in problem.effect_parameters(Candidate(trial.parts)) if p.size)


def _scaled(problem: Problem, trial: Trial, factor: float) -> tuple[float, ...]:
    """The trial's values, SI, with its sizes multiplied by ``factor``.

    The factor is kept from 0.2 to 3: the estimate it comes from is linear, and holds near the trial only."""
    factor = float(np.sign(factor) * np.clip(abs(factor), 0.2, 3.0))
    parameters = problem.effect_parameters(Candidate(trial.parts))
    return tuple(
        float(np.clip(v * factor, p.low, p.high)) if p.size else v
        for v, p in zip(trial.values, parameters, strict=True)
    )


@dataclass(frozen=True)
class _Products:
    """Products of the trials' changes, the residual and the base's sensitivities, on the fitted rows.

    Attributes
    ----------
    gram : (T, T) of the changes
    with_residual : (T,)
    with_base : (T, m) with the sensitivities, each of these of length one
    curvature : (m, m) of the sensitivities, with the prior
    asked : (m,) what the residual and the prior ask of the unknowns; at a converged fit the two cancel
    total : square of the residual
    """

    gram: Array
    with_residual: Array
    with_base: Array
    curvature: Array
    asked: Array
    total: float

    def projected(self, free: Mask) -> tuple[Array, Array, float]:
        """:func:`projected` with those unknowns (m,) that are free."""
        others = self.with_base[:, free]
        answers = np.linalg.solve(self.curvature[np.ix_(free, free)], np.column_stack([others.T, self.asked[free]]))
        return self.gram - others @ answers[:, :-1], self.with_residual - others @ answers[:, -1], self.total


def projected(problem: Problem, base: Fit, found: Sequence[Trial]) -> tuple[Array, Array, float]:
    """Gram matrix of the trials' changes and their products with the residual, both free of what the base can do, and
    the square of the residual.

    What a base strains for is counted with what it leaves: a load that masses and areas answer for, far from their
    nominal values, leaves little to explain, and lets them come back.
    """
    return _products(problem, base, found).projected(np.ones(len(base.x), dtype=bool))


def _products(problem: Problem, base: Fit, found: Sequence[Trial]) -> _Products:
    assert base.jacobian is not None
    rows, count = problem.fitted, len(base.x)
    r = base.residual[rows]
    whole = level(r)
    root = np.sqrt(weights(r) * whole)
    weighted = (r * root).ravel()
    strength = 1.0 / (problem.pace.correlation * whole)
    if not found:
        return _Products(np.zeros((0, 0)), np.zeros(0), np.zeros((0, count)), np.eye(count), np.zeros(count), 1.0)
    D = np.stack([(t.change[rows] * root).ravel() for t in found])
    # A law and an atom of its shape may be the same column: scaled, with a floor, that is no division by nothing.
    J = (base.jacobian[rows] * root[:, :, None]).reshape(weighted.size, -1)
    size = np.maximum(np.linalg.norm(J, axis=0), 1e-12)
    J, prior = J / size, problem.prior(base.candidate)
    curvature = J.T @ J + np.diag(prior / (strength * size**2) + SAME_COLUMN)
    asked = J.T @ weighted + prior * base.x / (strength * size)
    return _Products(D @ D.T, D @ weighted, D @ J, curvature, asked, float(weighted @ weighted))


def _explained_alone(gram: Array, b: Array, signed: Mask) -> tuple[Array, Array, NDArray[np.intp]]:
    """What a multiple of each trial explains (zero where it would have to be negative and must not), the multiples
    (T, 1), and the trials' numbers (T, 1).
    """
    own = np.maximum(np.diag(gram), 1e-12)
    size = np.clip(b / own, -FOLLOWED, FOLLOWED)
    share = np.where((size > 0.0) | signed, size * (2.0 * b - size * own), 0.0)
    return share, size[:, None], np.arange(len(b))[:, None]


def _explained_by_pairs(gram: Array, b: Array, signed: Mask) -> tuple[Array, Array, NDArray[np.intp]]:
    """The same for all pairs of trials, (P,), (P, 2), (P, 2); pairs that no log could tell apart explain nothing."""
    one, two = np.triu_indices(len(b), 1)
    first, second = (np.maximum(np.diag(gram), 1e-12)[k] * (1.0 + 1e-9) for k in (one, two))
    cross = gram[one, two]
    alike = cross**2 > 0.995**2 * first * second
    determinant = np.where(alike, 1.0, first * second - cross**2)
    sizes = np.column_stack([second * b[one] - cross * b[two], first * b[two] - cross * b[one]]) / determinant[:, None]
    sizes = np.clip(sizes, -FOLLOWED, FOLLOWED)
    members = np.column_stack([one, two])
    allowed = ~alike & ((sizes > 0.0) | signed[members]).all(axis=1)
    u, v = sizes.T
    curved = first * u * u + 2.0 * cross * u * v + second * v * v
    share = np.where(allowed, 2.0 * (b[one] * u + b[two] * v) - curved, 0.0)
    return share, sizes, members
