# SPDX-License-Identifier: Apache-2.0
"""The diagnosis from end to end: logs in, verdict with places, ranking and held-out gaps out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.experiment import NextExperiment
from pneumo_ros.diagnosis.fit.problem import Part, Problem, stated_form
from pneumo_ros.diagnosis.fit.shooting import Piece
from pneumo_ros.diagnosis.fit.solver import Fit, fit, sensitivities
from pneumo_ros.diagnosis.fit.uncertainty import covariance, nuisance_estimates
from pneumo_ros.diagnosis.judge.ambiguity import ambiguity_group
from pneumo_ros.diagnosis.judge.budget import budget
from pneumo_ros.diagnosis.judge.budgeted import budgeted
from pneumo_ros.diagnosis.judge.closable import Closable, EffectEvidence, closable
from pneumo_ros.diagnosis.judge.effect_shares import effect_shares
from pneumo_ros.diagnosis.judge.equations import Equations
from pneumo_ros.diagnosis.judge.held_out import noise_floor, settle, total_floor, total_gap
from pneumo_ros.diagnosis.judge.held_out_runs import HeldOut, edit_test, held_runs
from pneumo_ros.diagnosis.judge.idle_shapes import with_own_laws
from pneumo_ros.diagnosis.judge.outcome import Outcome, Whereabouts
from pneumo_ros.diagnosis.judge.pruning import harmful
from pneumo_ros.diagnosis.judge.ranking import rank
from pneumo_ros.diagnosis.judge.stated_otherwise import stated_otherwise
from pneumo_ros.diagnosis.judge.verdict import Calibration, HeldOutGaps, Opinion, judge, name_of
from pneumo_ros.diagnosis.model import Model
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.result import Diagnosis, Gap
from pneumo_ros.diagnosis.search.competition import compete
from pneumo_ros.diagnosis.search.fitting import of_law
from pneumo_ros.diagnosis.search.growth import grow
from pneumo_ros.diagnosis.search.intervals import interval_words
from pneumo_ros.diagnosis.search.parts import reduced
from pneumo_ros.diagnosis.search.selection import Scored, Thresholds, null_thresholds, score, select
from pneumo_ros.diagnosis.search.state import Effort, Progress, Search
from pneumo_ros.diagnosis.search.tightened import search_tightened
from pneumo_ros.diagnosis.traits import HasLimits
from pneumo_ros.effects.parameters import Active
from pneumo_ros.errors import InputError

Fitted = tuple[Array, tuple[Active, ...]]  # nuisance values and effects of a structure
# (model, fit logs, held-out log, a structure or None, threads) -> of what the nominal model leaves, and of what it does
Locate = Callable[[Any, Sequence[Any], Any, Fitted | None, int], tuple[Whereabouts, Whereabouts | None]]
# (model, fit logs, held-out log) -> the rig's equations along the held-out one
HoldEquations = Callable[[Any, Sequence[Any], Any], Equations]
# (model, held-out log, tolerances of the refit) -> places at which some input, of any time course, explains what that
# leaves, with the share each closes, the likeliest first
FindInputs = Callable[[Any, Any, Array], Sequence[tuple[str, float]]]
LIKELY: Final = 0.05  # share of a place from which a remainder is looked for there [taste]
SEEN: Final = 0.3  # sigmas, rms: below it the typical size of an effect does not show in a log [taste]
# Share of the library that the excitation cannot show, above which "none" would say nothing [taste]
MOSTLY: Final = 0.5
FEWEST: Final = 16  # rows of a record at least [numerics]
SPLIT: Final = 0.65  # share of a lone log that is fitted; the rest is held out [taste]
RIVALS: Final = 3  # rivals of a verdict that an experiment is looked for, the strongest first [taste]


@dataclass(frozen=True)
class Options:
    """What a diagnosis does.

    Attributes
    ----------
    pairs : look for two effects as well
    effort : how many candidates are fitted
    limits : what counts as evidence
    calibration : constants of the probabilities
    locate : places of what structures leave, see :data:`Locate`
    equations : what structures leave in the rig's equations, see :data:`HoldEquations`
    inputs : where something acts that no shape follows, see :data:`FindInputs`
    experiment : design the experiment that splits an ambiguity group
    threads : simulations at a time
    """

    pairs: bool = True
    effort: Effort = field(default_factory=Effort)
    limits: Thresholds = field(default_factory=null_thresholds)
    calibration: Calibration = field(default_factory=Calibration)
    locate: Locate | None = None
    equations: HoldEquations | None = None
    inputs: FindInputs | None = None
    experiment: Callable[[Problem, Fit, Fit], NextExperiment | None] | None = None
    threads: int = 1


def diagnose(
    model: Model,
    fit_logs: Sequence[Record],
    holdout: Record,
    options: Options | None = None,
    progress: Progress | None = None,
    edit: Record | None = None,
) -> Diagnosis:
    """Diagnose logs with a model.

    Parameters
    ----------
    model : :class:`pneumo_ros.effects.rig_model.RigModel` for the half car
    fit_logs : records to fit, see :class:`pneumo_ros.diagnosis.record.Record`
    holdout : record that nothing is fitted to
    progress : called with the share done and what is being done
    edit : a record of the rig after a known change, predicted without refitting
    """
    _check_records(model, [*fit_logs, holdout])
    options = options or Options()
    tell = progress or (lambda share, what: None)
    search = compete(Problem(model, tuple(fit_logs), threads=options.threads), options.effort, options.pairs, tell)
    grow(search, options.limits, options.pairs)
    if options.pairs:
        search_tightened(search, options.limits)
    tell(0.9, "selecting and checking on the held-out log")
    outcome = _outcome(search, holdout, options, tell)
    held, evidence = _on_held_out(outcome), _weighed(outcome)
    opinion = judge(outcome.refit, outcome.finalists, outcome.chosen, options.calibration, held, evidence)
    if opinion.verdict == "none":  # what nothing speaks for is not told, and not saved
        outcome = _without_effects(outcome)
    return _within_limits(_report(outcome, opinion, options, tell, edit), [*fit_logs, holdout])


def _check_records(model: Model, records: Sequence[Record]) -> None:
    """Refuse records of another shape than the model's, before anything is fitted to them.

    Raises
    ------
    InputError
        naming the record.
    """
    for one in records:
        shape, wanted = np.shape(one.measured), len(model.channels)
        if len(shape) != 2 or shape[1] != wanted or np.shape(one.weight) != shape:
            raise InputError("measured is no table of the model's channels", where=one.name, value=shape,
                             allowed=f"(N, {wanted}), and weight the same")  # fmt: skip
        if shape[0] < FEWEST:
            raise InputError("too few rows", where=one.name, value=shape[0], allowed=f"at least {FEWEST}")
        if not np.all(np.isfinite(one.measured)):
            raise InputError("measured is not everywhere a number", where=one.name,
                             remedy="fill the gaps and give them no weight")  # fmt: skip


def _outcome(search: Search, holdout: Record, options: Options, tell: Progress) -> Outcome:
    problem = search.problem
    refit = score(problem, search.refit)
    finalists = tuple(score(problem, f) for f in search.finalists)
    everything = np.ones(len(problem.measured), dtype=bool)
    base = _final(problem, search.refit, everything)
    equations = None if options.equations is None else options.equations(problem.model, problem.records, holdout)
    while True:
        chosen = select(refit, finalists, options.limits)
        best = base if chosen.size == 0 else _final(problem, chosen.fit, everything)
        runs = held_runs(problem, base, best, holdout)
        if best is base or np.all(np.isfinite(runs["best"].predicted)):
            break
        # What runs away from another start is no model of the rig, however well it fits one log.
        finalists = tuple(one for one in finalists if one is not chosen)
    pruned = _without_harm(problem, chosen, harmful(problem, best, holdout, equations))
    if pruned is not chosen:
        again = _final(problem, pruned.fit, everything)
        left = held_runs(problem, base, again, holdout)
        if np.all(np.isfinite(left["best"].predicted)):
            finalists = (*(one for one in finalists if one is not chosen), pruned)
            chosen, best, runs = pruned, again, left
    tell(0.93, "locating")
    floor = total_floor(holdout)
    shares = budget(problem, best, holdout, floor, runs["nominal"].total, runs["refit"].total)
    found = Outcome(search, refit, finalists, chosen, base, best, holdout, runs, Closable((), ()), shares, None, None)
    before, after = _whereabouts(found, options.locate)
    tell(0.94, "what else could be closed")
    rest = after if after is not None else before
    likely = [] if rest is None else [place for place, share in rest.shares if share > LIKELY]
    beside = closable(problem, base, best, holdout, floor, runs["refit"].total, likely, equations)
    return replace(found, closable=beside, before=before, after=after)


def _without_harm(problem: Problem, chosen: Scored, gone: Sequence[Part]) -> Scored:
    """The chosen structure without some of its laws, scored; itself where none goes."""
    parts = [part for law in gone for part in of_law(chosen.fit.candidate, law)]
    return score(problem, reduced(problem, chosen.fit, parts)) if parts else chosen


def _weighed(outcome: Outcome) -> tuple[EffectEvidence, ...]:
    """The evidence of each effect with what it holds of what the refit leaves, in all orders or as the last one."""
    nominal, refit = (outcome.runs[name].total ** 2 for name in ("nominal", "refit"))
    left = max(refit - total_floor(outcome.holdout) ** 2, 1e-12)
    shares = outcome.budget.effects
    return tuple(
        replace(e, share=max(shares[e.law].value * nominal, e.without - e.own) / left) for e in outcome.closable.effects
    )


def _without_effects(outcome: Outcome) -> Outcome:
    """The outcome as if nothing had been chosen."""
    base, runs, holdout = outcome.base, outcome.runs, outcome.holdout
    gaps = (total_floor(holdout), runs["nominal"].total, runs["refit"].total)
    return replace(outcome, chosen=outcome.refit, best=base, closable=Closable((), ()), after=outcome.before,
                   budget=budget(outcome.problem, base, holdout, *gaps),
                   runs={**runs, "best": runs["refit"]})  # fmt: skip


def _within_limits(found: Diagnosis, records: Sequence[Record]) -> Diagnosis:
    """What the logs' own limitations leave of the verdict."""
    limited = [r for r in records if isinstance(r, HasLimits)]
    limitations = [(r.name, one) for r in limited for one in r.limitations]
    if not limitations:
        return found
    notes = (*found.notes, *dict.fromkeys(f"{name}: {one.text}" for name, one in limitations))
    cap = min(one.cap for _, one in limitations)
    blocked = any(r.blocked for r in limited)
    verdict = "not_testable" if blocked else found.verdict
    cap = 0.0 if blocked else cap
    ranking = tuple(replace(one, probability=min(one.probability, cap)) for one in found.ranking)
    return replace(found, verdict=verdict, probability=min(found.probability, cap), ranking=ranking, notes=notes)


def split_by_time(fit_logs: Sequence[Piece]) -> tuple[list[Piece], Piece]:
    """The last log's end becomes the held-out record (with an initial state of its own)."""
    last = fit_logs[-1]
    cut = int(len(last.measured) * SPLIT)
    return [*fit_logs[:-1], last.slice(0, cut)], last.slice(cut, len(last.measured))


def _report(outcome: Outcome, opinion: Opinion, options: Options, tell: Progress, edit: Record | None) -> Diagnosis:
    problem, search, holdout, best = outcome.problem, outcome.search, outcome.holdout, outcome.best
    tell(0.95, "ranking")
    ranking = rank(outcome, opinion)
    group = ambiguity_group(problem, opinion, outcome.refit, outcome.finalists)
    location = _location(outcome, opinion, options.inputs)
    experiment = None
    if options.experiment is not None and opinion.verdict != "unknown" and set(group) - {opinion.verdict}:
        tell(0.97, "designing the next experiment")
        experiment = _next_experiment(outcome, opinion, group, options.experiment)
    refused = () if experiment is None or experiment.tells else (experiment.refusal,)
    cov = covariance(problem, best)
    shares = budgeted(outcome, opinion)
    tell(1.0, "done")
    hidden = _hidden(problem, search)
    blind = opinion.verdict == "none" and len(hidden) > MOSTLY * len(problem.model.effects)
    return Diagnosis(
        verdict="not_testable" if blind else opinion.verdict,
        probability=opinion.probability,
        location=tuple(location),
        ranking=tuple(ranking),
        ambiguity_group=group,
        gap=_gap(problem.model, holdout, outcome.runs),
        nuisance=nuisance_estimates(problem, best, cov),
        active=outcome.active,
        budget=with_own_laws(problem, best, shares.entries),
        refit_share=shares.refit,
        remainder=shares.remainder,
        floor_share=shares.floor,
        not_testable=hidden,
        experiment=None if refused else experiment,
        edit=None if edit is None else edit_test(problem, edit, outcome.base, best),
        notes=(*_notes(search, best, problem), *stated_otherwise(problem, outcome.refit, outcome.chosen), *refused),
        logs={"fit": [r.name for r in problem.records], "holdout": holdout.name},
        tried=tuple((f.candidate.label, problem.gap(f.residual)) for f in [*search.singles, *search.pairs]),
        evidence=_evidence(outcome),
        trajectories=_trajectories(holdout, outcome.runs),
    )


def _final(problem: Problem, one: Fit, rows: Mask) -> Fit:
    """Fitted once more on all blocks, with fresh sensitivities."""
    again = fit(problem, one.candidate, one.x, one.jacobian, rows=rows, iterations=4)
    return sensitivities(problem, again)


def _on_held_out(outcome: Outcome) -> HeldOutGaps:
    floor, runs = total_floor(outcome.holdout), outcome.runs
    form = stated_form(outcome.holdout)
    kept = 0.0 if outcome.after is None or outcome.after.kept is None else outcome.after.kept
    return HeldOutGaps(runs["refit"].total / floor, runs["best"].total / floor, form / floor, kept)


def _gap(model: Model, holdout: Record, runs: Mapping[str, HeldOut]) -> Gap:
    floor = noise_floor(holdout)
    table = {name: run.channels for name, run in runs.items()} | {"noise_floor": floor}
    per_channel = {c: {name: float(v[k]) for name, v in table.items()} for k, c in enumerate(model.channels)}
    totals = {name: run.total for name, run in runs.items()}
    return Gap(totals["nominal"], totals["refit"], totals["best"], total_gap(floor), per_channel)


def _whereabouts(outcome: Outcome, locate: Locate | None) -> tuple[Whereabouts | None, Whereabouts | None]:
    """Of what the nominal structure leaves, and of what the best named one leaves.

    The first starts at the nominal values: the search answers the tolerances itself, while those of the free-run refit
    have absorbed part of the gap already.
    """
    if locate is None:
        return None, None
    problem = outcome.problem
    fitted = None if outcome.best is outcome.base else (outcome.nuisance, tuple(outcome.active))
    before, after = locate(problem.model, problem.records, outcome.holdout, fitted, problem.threads)
    return before, before if fitted is None else after


def _location(outcome: Outcome, opinion: Opinion, inputs: FindInputs | None) -> list[tuple[str, float]]:
    """A named effect's own places. Else the places of inputs that explain what the refit leaves; of two effects and
    more these would be one that does the work of all, and then those where something in a name's stead left less come
    first, before the places where a flexible correction of the nominal model helps.

    Not of the best named structure: a wrong name has changed the model where it acts.
    """
    model, holdout, runs = outcome.problem.model, outcome.holdout, outcome.runs
    if opinion.verdict != "unknown" and outcome.active:
        initial = settle(model, holdout, outcome.nuisance, outcome.active)
        closed = max(0.0, 1.0 - runs["best"].total / runs["refit"].total)
        return effect_shares(model, holdout, outcome.nuisance, initial, outcome.active, closed)
    if inputs is not None and outcome.chosen.size < 2 and opinion.verdict == "unknown":
        found = inputs(model, holdout, outcome.problem.nuisance(outcome.base.x))
        if found:
            return list(found)
    before = () if outcome.before is None else outcome.before.shares
    floor = total_floor(holdout)
    first = outcome.closable.in_stead(runs["refit"].total ** 2 - floor**2)
    left = 1.0 - sum(share for _, share in first)
    known = dict(first)
    return [*first, *((p, left * float(np.clip(share, 0.0, 1.0))) for p, share in before if p not in known)]


def _evidence(outcome: Outcome) -> dict[str, float]:
    """Numbers the verdict rests on."""
    chosen = outcome.chosen
    out = {"level_refit": outcome.refit.level, "level_chosen": chosen.level, "effects": float(chosen.size)}
    for name, one in (("refit", outcome.before), ("chosen", outcome.after)):
        if one is not None:
            out |= {f"equations_{name}": one.residual, f"mendable_{name}": one.mendable}
            out |= {} if one.kept is None else {f"kept_{name}": one.kept}
    out |= {f"closes:{effect.family}": effect.closes for effect in outcome.closable.effects}
    out |= {f"at_bounds:{effect.family}": effect.at_bounds for effect in outcome.closable.effects}
    out |= {f"instead:{one.family}": one.instead for one in outcome.closable.effects if one.instead < 1.0}
    out |= {f"unheld:{effect.family}": effect.unheld for effect in outcome.closable.effects}
    out |= {f"follows:{one.family}": one.follows for one in outcome.closable.effects if np.isfinite(one.follows)}
    out |= {f"varied:{one.family}": one.varied for one in outcome.closable.effects if np.isfinite(one.varied)}
    return out | {f"gap_{name}": run.total for name, run in outcome.runs.items()}


def _next_experiment(
    outcome: Outcome,
    opinion: Opinion,
    group: Sequence[str],
    design: Callable[[Problem, Fit, Fit], NextExperiment | None],
) -> NextExperiment | None:
    """Split the verdict from its strongest rival; where nothing tells these two apart, from the next one.

    A group of three is worth an experiment that rids it of one. What is refused is refused for the strongest.
    """
    rivals: dict[str, Fit] = {}
    for one in sorted(outcome.finalists, key=lambda s: s.level):
        name = name_of(one.fit.candidate)
        if name in group and name != opinion.verdict:
            rivals.setdefault(name, one.fit)
    first: NextExperiment | None = None
    for name, rival in list(rivals.items())[:RIVALS]:
        found = design(outcome.problem, outcome.best, rival)
        found = None if found is None else replace(found, splits=(opinion.verdict, name))
        if found is not None and found.tells:
            return found
        first = first or found
    return first


def _notes(search: Search, best: Fit, problem: Problem) -> list[str]:
    notes = [*interval_words(problem, best), *(f"{one}: the fit diverged, the candidate lost" for one in search.lost)]
    low, high = problem.bounds(best.candidate)
    for m, p in enumerate(problem.model.parameters):
        if best.x[m] in (low[m], high[m]):
            notes.append(f"{p.name} stands at the edge of its tolerance")
    return notes


def _hidden(problem: Problem, search: Search) -> dict[str, str]:
    """Effects that this excitation could not have shown, with how little their typical size would have moved."""
    out = {}
    for name, moved in search.visible.items():
        if moved < SEEN:
            sizes = [f"{p.name} {p.typical:.3g} {p.unit}" for p in problem.model.effects[name].parameters if p.size]
            out[name] = f"{' or '.join(sizes)} would have moved the outputs by {moved:.2g} sigma only"
    return out


def _trajectories(holdout: Record, runs: Mapping[str, HeldOut]) -> dict[str, Array]:
    time = np.arange(len(holdout.measured), dtype=np.float64) * holdout.period
    return {"time": time, "log": np.asarray(holdout.measured), **{name: run.predicted for name, run in runs.items()}}
