# SPDX-License-Identifier: Apache-2.0
"""From scores to a verdict with a probability for each effect.

Two questions in turn. How much better does a structure fit than the next, on the logs that were fitted and on their
kept blocks? And of each effect of the best one: does its family close most of what can be closed at its place on the
held-out log, or does something else act there? No share of the misfit decides: a right law may leave more of it than a
wrong one, but whatever may act at the place then closes no more (:mod:`pneumo_ros.diagnosis.judge.closable`). The
held-out log never chooses between names.
The constants are calibrated on simulated cases with known answers (bench/calibrate_verdict.py: the reliability, and
which constants of the credit would have fared best).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Candidate, Part
from pneumo_ros.diagnosis.judge.closable import EffectEvidence
from pneumo_ros.diagnosis.search.screening import SENSOR
from pneumo_ros.diagnosis.search.selection import SHARPNESS, Scored, by_families, log_weight
from pneumo_ros.effects.parameters import family_of

# Times another's share that an effect must hold to be the larger of two: shares are known to about a fifth [numerics]
LARGER: Final = 1.25


@dataclass(frozen=True)
class Calibration:
    """Constants of the probabilities.

    Attributes
    ----------
    first_penalty, second_penalty : of log probability, for a first and a second effect: what chance wins
    closes : share (rms) of what can be closed at an effect's places that its family must close to be as likely as
        "something else acts there"
    leaves : what its family may leave, in what whatever may act there leaves, to be as likely, where a model form is
        stated
    steepness : exponent of these transitions
    real : what the refit leaves of the kept blocks, sigma squared, above which a gap without a name counts as unknown
        rather than none
    least : share of what the refit leaves at which an effect is as likely to be the misfit of another
    slight : share (rms, above the floor) of what the refit leaves that the whole structure must close at that, unless
        the equations miss twice as much without the effect: beside something larger that nobody can predict
    beside : share of what an effect holds that it must still hold beside whatever may act where the rest of the gap
        lies: a wrong name does the work of what is missing, and nobody misses it once that is there
    instead : how many times as much (rms) as the structure whatever may act there must leave in the effect's place for
        that to say nothing: what explains less is no rival
    kept : share of what the refit leaves in the rig's own equations along the held-out log, mean square above noise,
        that the structure must leave to be as likely something else: it moves the run by forces and flows that the rig
        does not have; of an effect whose own equations show a gap no more than there, for others may miss the most,
        and of none that holds more of the run (mean square) than is left of it in all
    unheld : share of what the equations miss without an effect that they may miss with it to say nothing, and to be as
        likely something else, with the same exception
    lost : share (rms) by which the structure closes more of the refit's gap in the fitted logs' kept blocks than in the
        held-out log, at which an effect is as likely something else: a law of the rig explains the next log as well;
        with the same exception, and not of one that has mended its own equations along that log (:attr:`kept`), which
        are as it left them where something else leads the run astray
    varied : share of what an effect's law is a function of that its sign does not explain, at which it is as likely
        something that knows the sign alone: dry friction and damping draw one picture at one speed
    at_bounds : number of an effect's parameters at their bounds at which "unknown" is as likely as the name
    bent : share (rms, above the floor) that a structure leaves of the refit's gap from which on those that bend a shape
        count in full: a law that nobody wrote bends it and leaves little, something else leaves more
    split : times what a sensor's error holds that an effect anywhere must hold for the error to be no likelier than it,
        unless the equations miss twice as much without the error: one unknown motion is split between the two as it
        comes
    rest : times what an effect holds that one at another place must hold for that, with the same exception: a wrong
        name that closes just enough (:attr:`closes`) leaves a quarter in mean square, and others fit that rest
    traces : what the refit leaves beyond the noise floor, in floors, at which it is as likely the work of traces that
        every rig has, and of a floor that is known to a few per cent
    held_real : held-out gap of the refit over the noise floor above which a gap without a name is unknown, not none
    right : share of the effects that these credits hold certain, and that hold most of what the refit leaves, that were
        right on cases by other laws (opened cases 100 to 199 of set 0.7)
    right_if_slight : the same of those that hold next to nothing of it
    slightly : share of what the refit leaves half way between these
    taken_back : told probability of an effect of the best structure that the held-out log takes back entirely, where
        something does act: more were right than wrong, but what is not named is not told as more likely than not
    tied : where no effect is likelier than not, the share of the likeliest one's probability that one must exceed to
        be told beside it
    """

    first_penalty: float = 9.0
    second_penalty: float = 9.0
    closes: float = 0.5
    leaves: float = 1.35
    steepness: float = 4.0
    real: float = 1.5
    varied: float = 0.09
    at_bounds: float = 0.9
    bent: float = 0.25
    least: float = 0.004
    slight: float = 0.12
    beside: float = 0.2
    instead: float = 2.0
    kept: float = 0.8
    unheld: tuple[float, float] = (0.8, 0.95)
    lost: float = 0.4
    split: float = 0.5
    rest: float = 4.0
    traces: float = 0.4
    held_real: float = 3.0
    right: float = 0.96
    right_if_slight: float = 0.9
    slightly: float = 0.1
    taken_back: float = 0.5
    tied: float = 0.75


@dataclass(frozen=True)
class HeldOutGaps:
    """What the held-out log says of the chosen structure.

    Attributes
    ----------
    refit, chosen : free-run gaps of the refit and of the chosen structure over the floor that sensors and the stated
        model form leave
    form : what the maker holds the model form to be worth, over the same floor; 0 where nothing is stated
    kept : share of what the refit leaves in the rig's equations that the chosen structure leaves as well, mean square
        above noise; 0 where nobody looked
    """

    refit: float
    chosen: float
    form: float = 0.0
    kept: float = 0.0

    @property
    def within_form(self) -> bool:
        """Whether a model form is stated or assumed and the refit leaves no more than it: nothing is missed."""
        return self.form > 0.0 and self.refit <= 1.0

    @property
    def closed(self) -> float:
        """Share (rms, above the floor) of the refit's gap that the structure closes, 1 at most."""
        return 1.0 - beyond(self.chosen, 1.0) / max(beyond(self.refit, 1.0), 1e-9)


@dataclass(frozen=True)
class Opinion:
    """Probabilities of all hypotheses.

    Attributes
    ----------
    chosen : the selected structure (the refit for "none" and "unknown")
    verdict : ids joined by "+", "none" or "unknown"
    named : probability of each finalist and of the refit ("none"), by candidate
    unknown : probability that no effect of the chosen structure is what acts at its place
    effects : probability of each effect of the chosen structure, whatever else is, by law and site
    """

    chosen: Scored
    verdict: str
    named: Mapping[Candidate, float]
    unknown: float
    effects: Mapping[Part, float] = field(default_factory=dict)

    @property
    def probability(self) -> float:
        """Of the verdict: of the least certain effect that it names."""
        if self.verdict == "unknown":
            return self.unknown
        own = [p for part, p in self.effects.items() if family_of(part[0]) in self.verdict.split("+")]
        return min(own) if own else self.of(self.verdict)

    @property
    def names(self) -> dict[str, float]:
        """Probability of each structure's name, wherever its effects sit."""
        found = dict.fromkeys(name_of(c) for c in self.named if c.parts)
        return {name: self.of(name) for name in found}

    def of(self, name: str) -> float:
        """Probability of all candidates of a name."""
        return min(1.0, sum(p for c, p in self.named.items() if name_of(c) == name))


def name_of(candidate: Candidate) -> str:
    """Verdict word of a candidate; one effect at two places is still that effect."""
    return "+".join(sorted({family_of(effect) for effect, _ in candidate.laws})) or "none"


def judge(
    refit: Scored,
    finalists: Sequence[Scored],
    chosen: Scored,
    calibration: Calibration,
    held: HeldOutGaps,
    evidence: Sequence[EffectEvidence] = (),
) -> Opinion:
    """Probabilities of the refit, of every finalist, of each effect of the chosen one, and of "unknown"."""
    named = structures(refit, finalists, chosen, calibration)
    if not chosen.size:
        unknown = unexplained(refit.level, held, calibration)
        scaled = {candidate: p * (1.0 - unknown) for candidate, p in named.items()}
        return Opinion(chosen, "unknown" if unknown > 0.5 else "none", scaled, unknown)
    # What drives the rig and what keeps that from running away cancel out: neither is known to be there.
    driven = any(one.props for one in evidence)
    refused = held.chosen >= held.refit or held.within_form or driven
    fitted = 1.0 - float(np.sqrt(chosen.level / max(refit.level, 1e-12)))
    credits = {one.law: 0.0 if refused else credit(one, held, calibration, fitted) for one in evidence}
    trust = _beside_unnamed(credits, evidence, calibration)
    trusted = max(trust.values(), default=0.0)
    unknown = (1.0 - trusted) * unexplained(refit.level, held, calibration)
    scaled = {candidate: p * trusted for candidate, p in named.items()}
    scaled[refit.fit.candidate] += 1.0 - trusted - unknown
    acts = 1.0 - scaled[refit.fit.candidate]
    # What something elsewhere leaves less of acts as much less likely.
    effects = {one.law: told_probability(trust[one.law] * _in_structure(named, one.law), one.share,
                                         acts * min(1.0, one.instead), calibration) for one in evidence}  # fmt: skip
    stands = {law for law, value in trust.items() if value > 0.5}
    # What is no likelier than not stands only where nothing else does: between names that are as good, one is told.
    least = min(0.5, calibration.tied * max((effects[law] for law in stands), default=0.0))
    names = sorted({family_of(law[0]) for law in stands if effects[law] > least})
    nameless = "unknown" if unknown >= scaled[refit.fit.candidate] else "none"
    return Opinion(chosen, "+".join(names) or nameless, scaled, unknown, effects)


def _beside_unnamed(
    trust: Mapping[Part, float], evidence: Sequence[EffectEvidence], calibration: Calibration
) -> dict[Part, float]:
    """Probability of each effect, at most that of every one that it may be a remainder or a part of.

    Effects that the held-out log does not miss, above noise and model form, bound nothing."""
    missed = [one for one in evidence if one.without > 0.0]
    out = dict(trust)
    for one in evidence:
        bounds = (trust[other.law] for other in missed if _bounds(other, one, calibration))
        out[one.law] = min([trust[one.law], *bounds])
    return out


def _bounds(other: EffectEvidence, one: EffectEvidence, calibration: Calibration) -> bool:
    """Whether the one is no more probable than the other, by what they hold of what the refit leaves.

    Where the larger one at a place is probably misnamed, the smaller one may be a remainder of it; of two that hold as
    much neither is. What moves the rig can look like a sensor's error, so that is bounded from any place, and by what
    is comparable, for one unknown motion is split between the two as it comes. Beside what holds nearly everything and
    cannot be named nothing is, wherever it acts. The rig's equations tell place from place, and sensors from forces:
    what they hold up is bounded by larger ones at its place alone, a sensor's error from any."""
    sensor, held_up = one.places[0].startswith(SENSOR), one.held_up > 1.0
    if sensor and not held_up:
        return other.share > calibration.split * one.share
    if sensor or other.places[:1] == one.places[:1]:
        return other.share > LARGER * one.share
    return not held_up and min(other.share, 1.0) > calibration.rest * one.share


def credit(one: EffectEvidence, held: HeldOutGaps, calibration: Calibration, fitted: float = 0.0) -> float:
    """Probability that an effect of the structure is what acts at its place, 0..1.

    ``fitted`` : share (rms) of what the refit leaves of the fitted logs' kept blocks that the structure closes; 0 where
    nobody looked
    """
    c = calibration
    stuck = one.at_bounds + one.bent * min(1.0, (1.0 - held.closed) / c.bent)
    left_over_held = one.own / max(one.without - one.own, 1e-12)
    against = [(1.0 - one.closes) / (1.0 - c.closes), max(0.0, one.leaves - 1.0) / (c.leaves - 1.0),
               stuck / c.at_bounds, c.varied / max(one.varied, 1e-9), c.least / max(one.share, 1e-9),
               min(c.slight / max(held.closed, 1e-9), 1.0 / max(one.held_up, 1e-9)),
               min(c.beside / max(one.beside, 1e-9), (c.instead - 1.0) / max(one.instead - 1.0, 1e-9)),
               c.traces / max(beyond(held.refit, 1.0), 1e-9),
               min(held.kept / c.kept, one.mended / c.kept, left_over_held),
               min(max(0.0, one.unheld - c.unheld[0]) / (c.unheld[1] - c.unheld[0]), left_over_held),
               min(max(0.0, fitted - held.closed) / c.lost, one.mended / c.kept, left_over_held)]  # fmt: skip
    # What moves the rig looks like a sensor's error as well: such a name must hold no less than is left beside it, in
    # the run or, where that is led astray by what is left, in the rig's equations.
    if one.places[0].startswith(SENSOR):
        against += [min(left_over_held, 1.0 / max(one.held_up, 1e-9)), 1.0 / max(one.follows, 1e-9)]
    share = max(against) ** c.steepness
    return float(1.0 / (1.0 + share))


def told_probability(credited: float, share: float, acts: float, calibration: Calibration) -> float:
    """Probability of an effect as it is told: how often effects with such a credit were right, 0..1.

    The credits lie too far apart on rigs with laws of their own (docs/blind-results.md). What is as likely as not stays
    so: the mapping is linear on either side of one half.

    Parameters
    ----------
    credited : probability by fit and held-out log
    share : of what the refit leaves, that the effect holds
    acts : probability that anything acts at all, and here
    """
    c = calibration
    slight = 1.0 / (1.0 + (max(share, 0.0) / c.slightly) ** 2)
    most = c.right + (c.right_if_slight - c.right) * slight
    if credited > 0.5:
        return 0.5 + (most - 0.5) * (2.0 * credited - 1.0)
    least = c.taken_back * acts
    return least + (0.5 - least) * 2.0 * credited


def _in_structure(named: Mapping[Candidate, float], law: Part) -> float:
    """Probability that a structure holds a law's family, the refit and all finalists together."""
    return min(1.0, sum(p for c, p in named.items() if any(family_of(e) == family_of(law[0]) for e, _ in c.laws)))


def structures(
    refit: Scored, finalists: Sequence[Scored], chosen: Scored, calibration: Calibration
) -> dict[Candidate, float]:
    """Probability of the refit and of every finalist, 0..1, one in sum; the selection has the last word twice.

    Whether anything acts, and how many effects, is judged by the training costs, each parameter and effect paying its
    price; which of as many, by what laws of the right kind may leave
    (:func:`~pneumo_ros.diagnosis.search.selection.log_weight`).
    """
    c = calibration
    some = [one for one in finalists if one.size]
    if not some:
        return {refit.fit.candidate: 1.0}
    odds = max(_plain(one, c) for one in some) - _plain(refit, c)
    # What the selection chose is at least as probable as any other.
    odds = max(odds, 0.0) if chosen.size else min(odds, 0.0)
    acts = 1.0 / (1.0 + float(np.exp(-np.clip(odds, -700.0, 700.0))))
    logs: dict[Candidate, float] = {}
    for size in {one.size for one in some}:
        logs |= _of_one_size(refit, [one for one in some if one.size == size], c)
    top = max(logs.values())
    if chosen.size:
        logs[chosen.fit.candidate] = top
    weights = {candidate: float(np.exp(value - top)) for candidate, value in logs.items()}
    total = sum(weights.values())
    return {refit.fit.candidate: 1.0 - acts} | {one: acts * w / total for one, w in weights.items()}


def _plain(one: Scored, calibration: Calibration) -> float:
    """Log weight of a structure against the refit."""
    pays = calibration.first_penalty * min(one.size, 1) + calibration.second_penalty * max(one.size - 1, 0)
    return -SHARPNESS * one.price / one.samples - pays


def _of_any_size(one: Scored, calibration: Calibration) -> float:
    """Log weight of a structure among those with other numbers of effects: the tolerances count in full, as in
    :func:`~pneumo_ros.diagnosis.search.selection.log_weight`, for an effect that is missing strains them.
    """
    return _plain(one, calibration) + (SHARPNESS / one.samples - 0.5) * one.stretch


def _of_one_size(refit: Scored, some: Sequence[Scored], calibration: Calibration) -> dict[Candidate, float]:
    """Log weights of structures with as many effects, the likeliest one's its :func:`_of_any_size`; those of one family
    share by their prices.
    """
    groups = by_families(some).values()
    leading = max((group[0] for group in groups), key=lambda one: log_weight(one, refit))
    found: dict[Candidate, float] = {}
    for group in groups:
        leader = _of_any_size(leading, calibration) + log_weight(group[0], refit) - log_weight(leading, refit)
        prices = [-SHARPNESS * (one.price - group[0].price) / one.samples for one in group]
        share = leader - float(np.log(np.sum(np.exp(prices))))
        found |= {one.fit.candidate: share + price for one, price in zip(group, prices, strict=True)}
    return found


def unexplained(level_refit: float, held: HeldOutGaps, calibration: Calibration) -> float:
    """Probability, 0..1, that something without a name makes what the refit leaves, where no effect was chosen.

    Zero where the refit leaves no more on the held-out log than the model form that is stated or assumed.

    ``level_refit`` : mean square on the selection blocks, sigma squared"""
    if held.within_form:
        return 0.0
    c = calibration
    share = (level_refit / c.real) ** (0.5 * c.steepness)
    share += (beyond(held.refit, 1.0) / beyond(c.held_real, 1.0)) ** c.steepness
    return float(share / (1.0 + share))


def beyond(gap: float, floor: float) -> float:
    """Root of the difference of the squares of a gap and a floor, both in noise floors; 0 below the floor."""
    return float(np.sqrt(max(0.0, gap**2 - floor**2)))
