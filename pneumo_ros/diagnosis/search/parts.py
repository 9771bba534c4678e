# SPDX-License-Identifier: Apache-2.0
"""A structure with further parts or without some: its families' shapes, an effect less, whatever may act somewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.model import Model
from pneumo_ros.diagnosis.search.fitting import PROBE, of_law, restricted, restricted_sensitivities
from pneumo_ros.diagnosis.search.screening import SMALL, CandidateScore, candidate_scores, trials
from pneumo_ros.diagnosis.search.selection import FORM, score
from pneumo_ros.diagnosis.search.waves import begun_waves
from pneumo_ros.diagnosis.traits import BeginsAlone
from pneumo_ros.effects.parameters import SHAPE, Active, family_of

SHAPE_STEPS: Final = 5  # iterations of a fit with shapes, from its laws' end [numerics]
STEPS: Final = 5  # iterations of a fit without some parts [numerics]
ALL: Final = 2.0  # times a start's amplitude: what is bounded below is a share of something, and not sized [numerics]


def with_shapes(problem: Problem, one: Fit, iterations: int = SHAPE_STEPS) -> Fit:
    """A structure's laws with the shapes of their families beside them; the fit itself where they have none."""
    missing = tuple(p for p in shapes_of(problem.model, one.candidate) if p not in one.candidate.parts)
    if not missing:
        return one
    return with_parts(problem, one, missing, iterations)


def shaped(problem: Problem, found: Sequence[Fit], iterations: int = SHAPE_STEPS) -> list[Fit]:
    """:func:`with_shapes` of each, several at a time."""
    return problem.each(lambda one: with_shapes(problem, one, iterations), found)


def shapes_of(model: Model, candidate: Candidate) -> tuple[Part, ...]:
    """Shapes of the families of a structure, where its laws act."""
    named = ((f"{family_of(effect)}.{SHAPE}", site) for effect, site in candidate.laws)
    there = ((name, site) for name, site in named if name in model.effects and site in model.effects[name].sites)
    return tuple(dict.fromkeys(there))


def with_parts(problem: Problem, one: Fit, parts: Sequence[Part], iterations: int, rows: Mask | None = None) -> Fit:
    """A structure with further parts, which start at nothing; what is no size and has further starts (a frequency)
    starts at the one that promises most, and so do waves. A shape that may do its laws' work alone is also fitted
    from there.
    """
    candidate = Candidate((*one.candidate.parts, *parts))
    values = problem.values(one.candidate, one.x).tolist()
    for part in parts:
        values += (
            begun_waves(problem, one, part) or _most_promising(problem, one, part) or _beginnings(problem, one, part)
        )
    alone = [(part, own) for part in parts for own in _begins(problem, part)]
    starts = [values, *(_sized(problem, one, part, own, parts, values) for part, own in alone)]

    def fitted(values: Sequence[float]) -> Fit:
        start = problem.start(candidate, one.x[: problem.fixed], values)
        return fit(problem, candidate, start, one.jacobian, rows=rows, iterations=iterations, shared=len(one.x))

    found = min(problem.each(fitted, starts), key=lambda other: _left(problem, other))
    return found if found.cost < one.cost else one


def begun(problem: Problem, one: Fit, law: Part, iterations: int) -> Fit:
    """A structure that has a law's shape already, or where it ends when that shape begins by doing all that the law and
    it do: the start that promises most after a few cheap steps is fitted.
    """
    shapes = [part for part in of_law(one.candidate, law) if part != law]
    values = problem.values(one.candidate, one.x).tolist()
    starts = [_sized(problem, one, part, own, (), values) for part in shapes for own in _begins(problem, part)]
    own = (one.candidate.parts.index(part) for part in (law, *shapes))
    before = Candidate(one.candidate.parts[: min(own)])
    shared = problem.fixed + len(problem.effect_parameters(before))  # columns that do not begin elsewhere

    def probe(start: Sequence[float]) -> Fit:
        x = problem.start(one.candidate, one.x[: problem.fixed], start)
        return fit(problem, one.candidate, x, one.jacobian, iterations=PROBE, probe=True, shared=shared)

    probes = [other for other in problem.each(probe, starts) if not other.diverged]
    if not probes:
        return one
    best = min(probes, key=lambda other: other.cost)
    other = fit(problem, one.candidate, best.x, None, iterations=iterations)
    return other if other.cost < one.cost and _left(problem, other) < _left(problem, one) else one


def with_all_shapes(problem: Problem, one: Fit, iterations: int) -> Fit:
    """A structure whose last law has come just now, with the shapes that it lacks, and its own also begun alone."""
    return with_shapes(problem, begun(problem, one, one.candidate.laws[-1], iterations), iterations)


def with_own_shape(problem: Problem, one: CandidateScore) -> CandidateScore:
    """A screened effect with its family's shape at nothing, where that needs no screening of its own."""
    if len(one.parts) > 1:
        return one
    missing = shapes_of(problem.model, Candidate(one.parts))
    if any(p.starts and not p.size for part in missing for p in problem.parameters_of[part]):
        return one
    found = dict(zip((p.name for p in problem.parameters_of[one.parts[0]]), one.values, strict=True))
    more = [value for part in missing for value in beginnings(problem, part, found)]
    return replace(one, parts=(*one.parts, *missing), values=(*one.values, *more))


def _left(problem: Problem, one: Fit) -> float:
    """Log mean square of fitted and of kept samples, with the priors: a start that serves the fitted ones alone is no
    better.
    """
    if one.diverged:
        return float("inf")
    scored = score(problem, one)
    return one.cost / scored.samples + float(np.log(FORM + scored.level))


def _begins(problem: Problem, part: Part) -> list[tuple[float, ...]]:
    """Values from which a shape is fitted without its family's laws: its own, and what the logs were scanned for."""
    effect = problem.model.effects[part[0]]
    own = effect.begins if isinstance(effect, BeginsAlone) else ()
    scanned = problem.scanned.get(part)
    return [*own, *([] if scanned is None else [tuple(scanned)])]


def shape_alone(problem: Problem, one: Fit, shape: Part, own: Sequence[float], parts: Sequence[Part],
                values: Sequence[float]) -> list[float]:  # fmt: skip
    """Start values of a structure with further parts, one of which is a shape that does what its family's laws did;
    these start at nothing.
    """
    out, first = list(values), 0
    for part in (*one.candidate.parts, *parts):
        count = len(problem.parameters_of[part])
        if part == shape:
            out[first : first + count] = own
        elif part[1] == shape[1] and family_of(part[0]) == family_of(shape[0]):
            before = zip(problem.parameters_of[part], out[first : first + count], strict=True)
            out[first : first + count] = [0.0 if p.size else v for p, v in before]
        first += count
    return out


def _sized(problem: Problem, one: Fit, shape: Part, own: Sequence[float], parts: Sequence[Part],
           values: Sequence[float]) -> list[float]:  # fmt: skip
    """:func:`shape_alone` with the shape's amplitudes such that it does as much as what it stands for: a leak may be of
    any size. A share that one is all of stays.
    """
    parameters = problem.parameters_of[shape]
    if not any(p.size and 0.0 < ALL * value < p.high for p, value in zip(parameters, own, strict=True)):
        return shape_alone(problem, one, shape, own, parts, values)

    def times(size: float) -> list[float]:
        scaled = [v * size if p.size else v for p, v in zip(parameters, own, strict=True)]
        return shape_alone(problem, one, shape, scaled, parts, values)

    def left(size: float) -> Array:
        candidate = Candidate((*one.candidate.parts, *parts))
        x = problem.start(candidate, one.x[: problem.fixed], times(size))
        return problem.residual(candidate, x)[problem.fitted]

    without, full = left(0.0), left(1.0)
    if not (np.all(np.isfinite(without)) and np.all(np.isfinite(full))) or np.array_equal(without, full):
        return times(1.0)
    change = without - full
    return times(max(float(np.sum(without * change) / np.sum(change**2)), SMALL))


def _most_promising(problem: Problem, one: Fit, part: Part) -> list[float]:
    """Start values of a part that is not linear in all its parameters, the best of the screening; empty for others."""
    if all(p.size or not p.starts for p in problem.parameters_of[part]):
        return []
    found = candidate_scores(problem, one, trials(problem, one, [part]))
    return list(found[0].values) if found else []


def _beginnings(problem: Problem, one: Fit, part: Part) -> list[float]:
    """:func:`beginnings` of a part beside a fit, whose laws of the same family at the same site count."""
    own = iter(problem.values(one.candidate, one.x).tolist())
    found = {
        (family_of(other[0]), other[1], p.name): next(own)
        for other in one.candidate.parts
        for p in problem.effect_parameters(Candidate((other,)))
    }
    here = (family_of(part[0]), part[1])
    return beginnings(problem, part, {name: value for (*place, name), value in found.items() if tuple(place) == here})


def beginnings(problem: Problem, part: Part, found: Mapping[str, float]) -> list[float]:
    """Start values, SI, of a part that has no effect yet.

    Sizes are zero; a shape parameter starts where a law of the same family at the same site has found it (``found``, by
    name), else at its typical value."""
    return [0.0 if p.size else found.get(p.name, p.typical) for p in problem.parameters_of[part]]


def reduced(
    problem: Problem,
    one: Fit,
    parts: Sequence[Part],
    iterations: int = STEPS,
    rows: Mask | None = None,
    borrowed: bool = False,
) -> Fit:
    """A structure without some of its parts, fitted from what is left of it; with ``borrowed`` sensitivities, its own,
    for the first step.
    """
    kept = tuple(part for part in one.candidate.parts if part not in parts)
    candidate = Candidate(kept)
    start = restricted(problem, one, candidate)
    columns, shared = (restricted_sensitivities(problem, one, candidate), len(start)) if borrowed else (None, None)
    return fit(problem, candidate, start, columns, rows=rows, iterations=iterations, shared=shared)


def rival(problem: Problem, law: Part, other: Part) -> bool:
    """Whether two effects of unlike families act at one site and are blamed on the same place, or on the same ones in
    another order: a load and a shifted centre both move heave and pitch.
    """
    if family_of(law[0]) == family_of(other[0]) or law[1] != other[1]:
        return False
    one, two = (problem.model.places(Active(*p, ())) for p in (law, other))
    return one[:1] == two[:1] or set(one) == set(two)
