# SPDX-License-Identifier: Apache-2.0
"""What could be closed: an effect's family against everything at its place, and what nothing in the structure closes.

Three nested models at a place: the law, the family's shape, and whatever may act there. All are fitted to the same logs
and judged on the held-out one. An effect is what its family's shape closes most of what can be closed there by; what
is left, and can be closed by no family of the structure, is the remainder.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import Candidate, Part, Problem, stated_form
from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.fit.uncertainty import at_bounds
from pneumo_ros.diagnosis.judge.equations import Equations, held_up, kept, left_in, mean_in, mended_in
from pneumo_ros.diagnosis.judge.held_out_runs import held_by
from pneumo_ros.diagnosis.model import HasCeilings
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.search.fitting import of_law
from pneumo_ros.diagnosis.search.parts import reduced, with_parts
from pneumo_ros.diagnosis.search.screening import SENSOR
from pneumo_ros.diagnosis.traits import ActsElsewhere, IsFollowed, NeedsVariety
from pneumo_ros.effects.parameters import Active, family_of

STEPS: Final = 4  # iterations of a fit with something added or taken away [numerics]
INSTEAD: Final = 30  # iterations of a fit with something of another kind in an effect's place [numerics]
FAR: Final = 1e3  # gap from which on a run has left the log for good, by how much tells nothing [taste]
SLACK: Final = 0.03  # of what there was to close: what a law of the right kind may leave without a word [taste]
WORTH: Final = 0.3  # share of what is left that a place must close to be called the remainder's [taste]
END: Final = 0.05  # share of a log's samples that is an end of a sensor's range [taste]
ENOUGH: Final = 20  # samples that have a slope [numerics]
TRACE: Final = 0.05  # of the floor's mean square: a structure that leaves less leaves nothing [taste]
# Share (rms) of the refit's gap, both above the floor, from which on a structure leaves much [taste]
LEFT: Final = 0.08
# In the name of what ties two places together, or is another thing at one than what is held against it [definition]
TIED: Final = "-"
TOGETHER: Final = 3  # places at which a remainder is looked for together [taste]


@dataclass(frozen=True)
class EffectEvidence:
    """What speaks for one effect of a structure, mean squares of the held-out gap above floor and form.

    Attributes
    ----------
    law : effect and site
    places : where it acts, first the one it is blamed on
    without : gap left when the effect is taken away and the rest fitted again
    own : gap left by the structure
    ceiling : gap left when whatever may act at its places is added
    share : what it holds of what the refit leaves
    leaves : what the structure leaves over what is left with whatever may act at its places: held-out gaps with nothing
        subtracted, :data:`SLACK` of what there was to close aside; 1 where no model form is stated, and where no more
        is left than that and the sensors leave
    beside : the same beside whatever may act where most of the rest lies, over what it holds without that; 1 where no
        such place is known
    instead : gap left by whatever may act there in place of the effect, over what the structure leaves, rms; 1 where
        no such place is known
    follows : share of what the structure without the effect predicts at either end of a sensor's range that its reading
        follows, in the fitted logs and in the held-out one, over the least that this kind of error leaves; infinite
        where nothing is asked
    missing : what the structure leaves in the equations that the effect acts in, along the held-out log, and what is
        left there without it, mean squares in null variances; None where nobody looked, or the tolerances answer for it
    mended : share of what the refit leaves in the equations that it acts in that the structure leaves as well, mean
        square above noise; infinite where nobody looked, or where they hardly show a gap
    varied : how varied what its law is a function of was along the logs, see
        :class:`~pneumo_ros.diagnosis.traits.NeedsVariety`; infinite where its law needs no variety
    props : whether the structure runs away without it, as it is and fitted again: something else in it drives the rig,
        which nothing passive does
    at_bounds, bent : how many of its parameters stand at a bound that is no natural end of its law; of its shape, those
        that bend it
    """

    law: Part
    places: tuple[str, ...]
    without: float
    own: float
    ceiling: float
    share: float = 1.0
    at_bounds: float = 0.0
    bent: float = 0.0
    leaves: float = 1.0
    beside: float = 1.0
    instead: float = 1.0
    follows: float = np.inf
    missing: tuple[float, float] | None = None
    mended: float = np.inf
    varied: float = np.inf
    props: bool = False

    @property
    def family(self) -> str:
        """The mechanism."""
        return family_of(self.law[0])

    @property
    def closes(self) -> float:
        """Share, rms, of what can be closed at its places that its family closes; 0..1."""
        whole = np.sqrt(self.without) - np.sqrt(min(self.ceiling, self.own))
        return float(np.clip((np.sqrt(self.without) - np.sqrt(self.own)) / whole, 0.0, 1.0)) if whole > 0.0 else 0.0

    @property
    def unheld(self) -> float:
        """Share of what the equations miss without the effect that they miss with it as well; 0 where nobody looked."""
        return 0.0 if self.missing is None else kept(*self.missing)

    @property
    def held_up(self) -> float:
        """How much more the equations miss without the effect, over what they miss with it; 0 where nobody looked."""
        return 0.0 if self.missing is None else held_up(*self.missing)


@dataclass(frozen=True)
class Remainder:
    """What can still be closed beside a structure.

    Attributes
    ----------
    places : of the contract
    parts : what was added there
    fit : the structure with it, on all blocks
    gap : held-out gap left, mean square above floor and form
    total : held-out gap left, as the contract's
    """

    places: tuple[str, ...]
    parts: tuple[Part, ...]
    fit: Fit
    gap: float
    total: float


@dataclass(frozen=True)
class Closable:
    """Evidence for each effect of the best structure, its remainders, the largest first, and what it leaves itself."""

    effects: tuple[EffectEvidence, ...]
    remainders: tuple[Remainder, ...]
    own: float = 0.0

    def in_stead(self, refit: float) -> list[tuple[str, float]]:
        """Places where something in an effect's stead leaves less than the structure does, each with its share of what
        it closes; empty where nothing does.

        ``refit`` : held-out gap that the refit leaves, mean square above the floor
        """
        if not self.remainders or not any(one.instead < 1.0 for one in self.effects):
            return []
        rest = self.remainders[0]
        closed = float(np.clip(1.0 - rest.gap / max(refit, 1e-12), 0.0, 1.0))
        return [(place, closed / len(rest.places)) for place in rest.places]


def closable(
    problem: Problem,
    base: Fit,
    best: Fit,
    holdout: Record,
    floor: float,
    refit: float,
    places: Sequence[str],
    equations: Equations | None = None,
) -> Closable:
    """Judge the best structure's effects against what is closable at their places and elsewhere.

    Parameters
    ----------
    problem, base, best : the refit and the structure, fitted to all blocks
    holdout : the held-out record
    floor : gap that sensors and the model's stated form leave, as the contract's gap
    refit : held-out gap of the refit, as the contract's
    places : further places of the contract where something may be missing, the likeliest first
    equations : the rig's equations along the held-out log
    """
    left = held_by(problem, best, holdout).total
    own = _above(left, floor)
    stated = stated_form(holdout) > 0.0
    at = {law: problem.model.places(Active(*law, ())) for law in best.candidate.laws}
    # Of what is left, together: it may need them all; and alone: one of them may do.
    beyond = [tuple(places[:TOGETHER]), (places[0],)] if places else []
    wheres = list(dict.fromkeys([*at.values(), *beyond]))
    added = problem.each(lambda where: _anything(problem, best, holdout, floor, where, left), wheres)
    remainders = dict(zip(wheres, added, strict=True))
    much = own > LEFT**2 * _above(refit, floor)
    elsewhere = exchanges({law: _elsewhere(problem, law, much) for law in best.candidate.laws})
    instead = problem.each(lambda it: _instead(problem, best, holdout, floor, *it), elsewhere)

    still = None if equations is None else left_in(equations, problem, best)
    before = None if equations is None else left_in(equations, problem, base)

    def judged(law: Part) -> EffectEvidence:
        bare = _fitted(problem, reduced(problem, best, of_law(best.candidate, law), STEPS, _all(problem)))
        missed, ceiling = held_by(problem, bare, holdout), remainders[at[law]]
        without = missed.total
        firm, bent = at_bounds(problem, best, of_law(best.candidate, law))
        # The equations estimate the tolerances anew: where these answer for the effect, they do so there as well.
        answered = problem.strains(bare.x) and not problem.strains(best.x)
        missing, mended = None, np.inf
        if equations is not None and still is not None and before is not None:
            acting = equations.of(at[law])
            mended = mended_in(still, before, acting)
            if not answered:
                missing = (mean_in(still, acting), mean_in(left_in(equations, problem, bare), acting))
        return EffectEvidence(
            law, at[law], _above(without, floor), own, ceiling.gap,
            at_bounds=firm, bent=bent, varied=_varied(problem, law),
            props=refit < FAR <= without and _runs_away_without(problem, best, holdout, law),
            follows=_followed(problem, bare, holdout, missed.predicted, law, at[law]), missing=missing, mended=mended,
            leaves=left / max(min(ceiling.total, left) + SLACK * without, 1e-12) if stated and left > floor else 1.0,
        )  # fmt: skip

    evidence = problem.each(judged, best.candidate.laws)
    found = sorted((r for r in (*remainders.values(), *instead) if r.gap < own), key=lambda r: r.gap)
    if found and worth_asking(found[0].gap, own, floor):
        evidence = problem.each(lambda one: _beside(problem, best, holdout, floor, one, found[0]), evidence)
    return Closable(tuple(evidence), tuple(found), own)


def worth_asking(left: float, own: float, floor: float) -> bool:
    """Whether so much less is left with something else than by the structure that a name may be the work of that.

    ``left`` and ``own`` : mean squares of the held-out gap above the floor; ``floor`` : as the contract's gap
    """
    return left + TRACE * floor**2 < (1.0 - WORTH) * own


def _runs_away_without(problem: Problem, best: Fit, holdout: Record, law: Part) -> bool:
    """Whether the rest of a structure, its numbers as they are, leaves the held-out log for good. A short fit of it may
    end anywhere where the effect held nearly everything.
    """
    bare = reduced(problem, best, of_law(best.candidate, law), iterations=0)
    return held_by(problem, bare, holdout).total >= FAR


def _varied(problem: Problem, law: Part) -> float:
    effect = problem.model.effects[law[0]]
    return effect.varied(law[1]) if isinstance(effect, NeedsVariety) else np.inf


def _followed(
    problem: Problem, bare: Fit, holdout: Record, predicted: Array, law: Part, places: Sequence[str]
) -> float:
    """How far a reading follows, over what is asked of this kind of error; infinite where nothing is.

    In the held-out log and in the fitted ones: a session may hardly come to where the other stays long.

    ``bare`` : the structure without the effect; ``predicted`` : its run of the held-out log
    """
    effect = problem.model.effects[law[0]]
    if not isinstance(effect, IsFollowed) or effect.follows <= 0.0:
        return np.inf
    channels = [problem.model.channels.index(place.removeprefix(SENSOR)) for place in places]
    with np.errstate(divide="ignore", invalid="ignore"):  # where nothing was measured nothing is compared
        fitted = problem.measured - bare.residual / problem.weight
    return (
        min(
            followed(reading[seen[:, k], k], there[seen[:, k], k])
            for reading, there, seen in (
                (problem.measured, fitted, problem.weight > 0.0),
                (holdout.measured, predicted, holdout.weight > 0.0),
            )
            for k in channels
        )
        / effect.follows
    )


def followed(reading: Array, there: Array) -> float:
    """Share of what is there that a reading follows at the end of its range where it follows less: slope of a straight
    line through the :data:`END` of its samples that are largest, and smallest. (N,) each, one unit; 1 for too few.
    """
    count = max(round(END * len(there)), ENOUGH)
    if len(there) < 2 * count or not np.all(np.isfinite(there)):
        return 1.0
    order = np.argsort(there)
    ends = (order[:count], order[-count:])
    return min(float(np.cov(reading[k], there[k])[0, 1] / max(np.var(there[k], ddof=1), 1e-300)) for k in ends)


def _beside(
    problem: Problem, best: Fit, holdout: Record, floor: float, one: EffectEvidence, rest: Remainder
) -> EffectEvidence:
    """The evidence with what is missed of an effect once something acts where the rest lies."""
    if set(_whatever(problem, one.places)) & set(rest.parts) or one.without <= one.own:  # its own ceiling
        return one
    bare = reduced(problem, rest.fit, of_law(best.candidate, one.law), STEPS, _all(problem))
    left = _above(held_by(problem, bare, holdout).total, floor) if not bare.diverged else np.inf
    beside = float(np.clip((left - rest.gap) / (one.without - one.own), 0.0, 1.0))
    return replace(one, beside=beside, instead=float(np.sqrt(left / max(one.own, 1e-12))))


def _above(gap: float, floor: float) -> float:
    """Mean square of a gap above a floor; of a run that has left the log for good that of :data:`FAR`."""
    return max(min(gap, FAR) ** 2 - floor**2, 0.0)


def _anything(
    problem: Problem, best: Fit, holdout: Record, floor: float, where: tuple[str, ...], left: float
) -> Remainder:
    """The structure with whatever may act at some places; ``left`` is its own held-out gap."""
    parts = _whatever(problem, where)
    if not parts:
        return Remainder(where, (), best, _above(left, floor), left)
    found = with_parts(problem, best, parts, STEPS, _all(problem))
    total = held_by(problem, found, holdout).total
    return Remainder(where, parts, found, _above(total, floor), total)


def _elsewhere(problem: Problem, law: Part, much: bool) -> tuple[tuple[str, ...], ...]:
    """Sets of places where the same motion as an effect's may come from.

    ``much`` : the structure leaves much of the gap
    """
    effect = problem.model.effects[law[0]]
    if not isinstance(effect, ActsElsewhere) or not (much or effect.always):
        return ()
    return effect.elsewhere_of(law[1])


def exchanges(
    elsewhere: Mapping[Part, Sequence[tuple[str, ...]]],
) -> list[tuple[tuple[Part, ...], tuple[str, ...]]]:
    """Effects that may be exchanged for what acts at some places: each alone, and all that the same places may stand
    for together, because one unknown thing is often split between two names.
    """
    alone = [((law,), where) for law, wheres in elsewhere.items() for where in wheres]
    places = dict.fromkeys(where for _, where in alone)
    together = [(tuple(law for law, wheres in elsewhere.items() if where in wheres), where) for where in places]
    return [*alone, *(it for it in together if len(it[0]) > 1)]


def _instead(
    problem: Problem, best: Fit, holdout: Record, floor: float, laws: Sequence[Part], where: tuple[str, ...]
) -> Remainder:
    """The structure with whatever may act at some places in place of some of its effects."""
    parts = _whatever(problem, where)
    gone = [part for law in laws for part in of_law(best.candidate, law)]
    bare = _fitted(problem, reduced(problem, best, gone, STEPS, _all(problem)))
    found = with_parts(problem, bare, parts, INSTEAD, _all(problem)) if parts else bare
    total = held_by(problem, found, holdout).total
    own = (place for part in parts for place in problem.model.places(Active(*part, ())))
    places = tuple(dict.fromkeys(own)) if any(TIED in one for one in where) else where
    return Remainder(places, parts, found, _above(total, floor), total)


def _whatever(problem: Problem, where: tuple[str, ...]) -> tuple[Part, ...]:
    """What may act at some places."""
    model = problem.model
    at = [model.anything_at(place) for place in where] if isinstance(model, HasCeilings) else []
    return tuple(dict.fromkeys(part for parts in at for part in parts))


def _fitted(problem: Problem, one: Fit) -> Fit:
    return one if not one.diverged else fit(problem, Candidate(), np.zeros(problem.fixed), rows=_all(problem))


def _all(problem: Problem) -> np.ndarray:
    return np.ones(len(problem.measured), dtype=bool)
