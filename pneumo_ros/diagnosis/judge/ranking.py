# SPDX-License-Identifier: Apache-2.0
"""The ranking of a diagnosis: the likeliest structures that were fitted to the end, with what speaks for them."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Candidate, Problem
from pneumo_ros.diagnosis.fit.solver import Fit, refreshed
from pneumo_ros.diagnosis.fit.uncertainty import covariance, effect_estimates
from pneumo_ros.diagnosis.judge.held_out import bootstrap_shrink
from pneumo_ros.diagnosis.judge.held_out_runs import HeldOut, held_by
from pneumo_ros.diagnosis.judge.outcome import Outcome
from pneumo_ros.diagnosis.judge.verdict import Opinion
from pneumo_ros.diagnosis.model import Model
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.result import Ranked
from pneumo_ros.diagnosis.search.selection import Scored, log_weight
from pneumo_ros.effects.parameters import Active, family_of

TOLD: Final = 6  # finalists in the ranking: each costs a run of the held-out log and its sensitivities [taste]


def rank(outcome: Outcome, opinion: Opinion) -> list[Ranked]:
    """Nominal structure, unknown, and the likeliest finalists; the most probable first."""
    problem, holdout, base, best = outcome.problem, outcome.holdout, outcome.base, outcome.best
    refit = outcome.runs["refit"]
    fitted = problem.gap(base.residual)
    nominal = _plain(("none",), opinion.named[Candidate()], refit.total, fitted)
    out = [replace(nominal, evidence=_weighed(outcome.refit))]
    if opinion.unknown > 1e-3:
        out.append(_plain(("unknown",), opinion.unknown, refit.total, fitted))

    def ranked(scored: Scored) -> Ranked:
        same = best is not base and scored.fit.candidate == best.candidate
        one = best if same else refreshed(problem, scored.fit)
        run = outcome.runs["best"] if same else held_by(problem, one, holdout)
        told = _ranked(problem, one, opinion.named[one.candidate], run, refit, holdout)
        return replace(told, evidence=_weighed(scored))

    by_weight = sorted(outcome.finalists, key=lambda one: -log_weight(one, outcome.refit))
    by_probability = sorted(by_weight, key=lambda one: -opinion.named[one.fit.candidate])
    out += problem.each(ranked, by_probability[:TOLD])
    return sorted(out, key=lambda r: -r.probability)


def _weighed(one: Scored) -> dict[str, float]:
    return {"level": one.level, "cost": one.fit.cost, "stretch": one.stretch, "samples": one.samples}


def _plain(effects: tuple[str, ...], probability: float, gap: float, fitted: float) -> Ranked:
    return Ranked(effects, (), None, probability, {}, gap, 0.0, (0.0, 0.0), fitted)


def _ranked(problem: Problem, one: Fit, probability: float, run: HeldOut, refit: HeldOut, holdout: Record) -> Ranked:
    laws = one.candidate.laws
    estimates = effect_estimates(problem, one, covariance(problem, one))
    notes = [f"{name} ended at its bound" for name, e in estimates.items() if e.at_bound]
    notes += [f"{name} moves no output" for name, e in estimates.items() if e.moves_nothing]
    if not np.all(np.isfinite(run.predicted)):
        notes.append("unstable on the held-out log")
    return Ranked(
        effects=tuple(family_of(effect) for effect, _ in laws),
        sites=tuple(site for _, site in laws),
        side=side_of(problem.model, one.candidate),
        probability=probability,
        parameters=estimates,
        gap_after=run.total,
        shrink=1.0 - run.total / refit.total,
        shrink_ci90=bootstrap_shrink(holdout, refit.predicted, run.predicted),
        gap_fit=problem.gap(one.residual),
        notes=tuple(notes),
    )


def side_of(model: Model, candidate: Candidate) -> str | None:
    """The side its effects share; both when they are at different ends; None where no effect has one."""
    sides = {model.side(Active(effect, site, ())) for effect, site in candidate.parts} - {None}
    if not sides:
        return None
    return sides.pop() if len(sides) == 1 else "both"
