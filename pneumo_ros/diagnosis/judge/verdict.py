# SPDX-License-Identifier: Apache-2.0
"""From scores to a verdict with a probability for each effect.

Two questions in turn. How much better does a structure fit than the next, on the logs that were fitted and on their
kept blocks? And of each effect of the best one: does its family close most of what can be closed at its place on the
held-out log, or does something else act there? No share of the misfit decides: a right law may leave more of it than a
wrong one, but whatever may act at the place then closes no more (:mod:`pneumo_ros.diagnosis.judge.closable`). The
held-out log never chooses between names.
The constants are calibrated on simulated cases with known answers (bench/calibrate_verdict.py makes them again).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Candidate, Part
from pneumo_ros.diagnosis.judge.closable import EffectEvidence
from pneumo_ros.diagnosis.search.screening import SENSOR
from pneumo_ros.diagnosis.search.selection import SHARPNESS, Scored, by_families, log_weight
from pneumo_ros.effects.parameters import family_of


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
    real : mean square of the refit above which a gap without a name counts as unknown rather than none
    least : share of what the refit leaves at which an effect is as likely to be the misfit of another
    slight : share (rms, above the floor) of what the refit leaves that the whole structure must close at that
    beside : share of what an effect holds that it must still hold beside whatever may act where the rest of the gap
        lies: a wrong name does the work of what is missing, and nobody misses it once that is there
    at_bounds : number of an effect's parameters at their bounds at which "unknown" is as likely as the name
    bent : share (rms, above the floor) that a structure leaves of the refit's gap from which on those that bend a shape
        count in full: a law that nobody wrote bends it and leaves little, something else leaves more
    traces : what the refit leaves beyond the noise floor, in floors, at which it is as likely the work of traces that
        every rig has, and of a floor that is known to a few per cent
    held_real : held-out gap of the refit over the noise floor above which a gap without a name is unknown, not none
    """

    first_penalty: float = 9.0
    second_penalty: float = 9.0
    closes: float = 0.5
    leaves: float = 1.35
    steepness: float = 4.0
    real: float = 2.5
    at_bounds: float = 0.9
    bent: float = 0.25
    least: float = 0.002
    slight: float = 0.12
    beside: float = 0.2
    traces: float = 0.4
    held_real: float = 3.0


@dataclass(frozen=True)
class HeldOutGaps:
    """What the held-out log says of the chosen structure.

    Attributes
    ----------
    refit, chosen : free-run gaps of the refit and of the chosen structure over the floor that sensors and the stated
        model form leave
    form : what the maker holds the model form to be worth, over the same floor; 0 where nothing is stated
    """

    refit: float
    chosen: float
    form: float = 0.0


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
    worse = held.chosen >= held.refit or (held.form > 0.0 and held.refit <= 1.0)
    trust = _beside_unnamed({one.law: 0.0 if worse else credit(one, held, calibration) for one in evidence}, evidence)
    trusted = max(trust.values(), default=0.0)
    unknown = (1.0 - trusted) * unexplained(refit.level, held, calibration)
    scaled = {candidate: p * trusted for candidate, p in named.items()}
    scaled[refit.fit.candidate] += 1.0 - trusted - unknown
    effects = {law: value * _in_structure(named, law) for law, value in trust.items()}
    names = sorted({family_of(law[0]) for law, value in trust.items() if value > 0.5})
    nameless = "unknown" if unknown >= scaled[refit.fit.candidate] else "none"
    return Opinion(chosen, "+".join(names) or nameless, scaled, unknown, effects)


def _beside_unnamed(trust: Mapping[Part, float], evidence: Sequence[EffectEvidence]) -> dict[Part, float]:
    """No name stands where something larger acts at the same place that is not what it was called: the smaller one may
    be the rest of it. A sensor's error stands beside no such thing anywhere: what moves the rig looks like one. What
    nobody misses on the held-out log, above noise and form, acts nowhere."""
    out = dict(trust)
    for one in evidence:
        sensor = one.places[0].startswith(SENSOR)
        beside = [e for e in evidence if sensor or e.places[:1] == one.places[:1]]
        larger = [e.law for e in beside if e.share > one.share and e.without > 0.0]
        out[one.law] = min([trust[one.law], *(trust[law] for law in larger)])
    return out


def credit(one: EffectEvidence, held: HeldOutGaps, calibration: Calibration) -> float:
    """Probability that an effect of the structure is what acts at its place, 0..1."""
    c = calibration
    closed = 1.0 - beyond(held.chosen, 1.0) / max(beyond(held.refit, 1.0), 1e-9)
    stuck = one.at_bounds + one.bent * min(1.0, (1.0 - closed) / c.bent)
    against = [(1.0 - one.closes) / (1.0 - c.closes), max(0.0, one.leaves - 1.0) / (c.leaves - 1.0),
               stuck / c.at_bounds, c.least / max(one.share, 1e-9),
               c.slight / max(closed, 1e-9), c.beside / max(one.beside, 1e-9),
               c.traces / max(beyond(held.refit, 1.0), 1e-9)]  # fmt: skip
    if one.places[0].startswith(
        SENSOR
    ):  # what moves the rig looks like a sensor's error as well: no less than it is left
        against.append(one.own / max(one.without - one.own, 1e-12))
    share = max(against) ** c.steepness
    return float(1.0 / (1.0 + share))


def _in_structure(named: Mapping[Candidate, float], law: Part) -> float:
    """Probability that a structure holds a law's family, the refit and all finalists together."""
    return min(1.0, sum(p for c, p in named.items() if any(family_of(e) == family_of(law[0]) for e, _ in c.laws)))


def structures(
    refit: Scored, finalists: Sequence[Scored], chosen: Scored, calibration: Calibration
) -> dict[Candidate, float]:
    """Probability of the refit and of every finalist, 0..1, one in sum; the selection has the last word twice.

    Whether anything acts is judged by the training costs, each parameter and effect paying its price; which structure
    it is, by what laws of the right kind may leave (:func:`~pneumo_ros.diagnosis.search.selection.log_weight`).
    """
    c = calibration
    some = [one for one in finalists if one.size]
    if not some:
        return {refit.fit.candidate: 1.0}

    def plain(one: Scored) -> float:
        return -SHARPNESS * one.price / one.samples - c.first_penalty * min(one.size, 1)

    odds = max(map(plain, some)) - plain(refit)
    # What the selection chose is at least as probable as any other.
    odds = max(odds, 0.0) if chosen.size else min(odds, 0.0)
    acts = 1.0 / (1.0 + float(np.exp(-np.clip(odds, -700.0, 700.0))))
    logs: dict[Candidate, float] = {}
    for group in by_families(some).values():
        leader = log_weight(group[0], refit) - c.second_penalty * (group[0].size - 1)
        prices = [-SHARPNESS * (one.price - group[0].price) / one.samples for one in group]
        share = leader - float(np.log(np.sum(np.exp(prices))))
        logs |= {one.fit.candidate: share + price for one, price in zip(group, prices, strict=True)}
    top = max(logs.values())
    if chosen.size:
        logs[chosen.fit.candidate] = top
    weights = {candidate: float(np.exp(value - top)) for candidate, value in logs.items()}
    total = sum(weights.values())
    return {refit.fit.candidate: 1.0 - acts} | {one: acts * w / total for one, w in weights.items()}


def unexplained(level_refit: float, held: HeldOutGaps, calibration: Calibration) -> float:
    """Probability that what the refit leaves is the work of something without a name, where no effect was chosen.

    ``level_refit`` : mean square on the selection blocks, sigmas
    """
    c = calibration
    share = (level_refit / c.real) ** (0.5 * c.steepness)
    share += (beyond(held.refit, 1.0) / beyond(c.held_real, 1.0)) ** c.steepness
    return float(share / (1.0 + share))


def beyond(gap: float, floor: float) -> float:
    """What a gap holds beside a floor, both in noise floors."""
    return float(np.sqrt(max(0.0, gap**2 - floor**2)))
