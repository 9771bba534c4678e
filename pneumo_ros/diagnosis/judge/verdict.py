# SPDX-License-Identifier: Apache-2.0
"""From scores to a verdict with a probability.

Two questions in turn. Is what the best named structure leaves small enough for a law of the right kind, on the blocks
kept from the fit and on the held-out log alike? If not, the effect is not in the library ("unknown"): a wrong effect
often mimics the fitted log and seldom another excitation. And among the named: how much better does one fit than the
next? The held-out log never chooses between names.
The constants are calibrated on simulated cases with known answers (bench/calibrate_verdict.py makes them again).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Candidate
from pneumo_ros.diagnosis.search.selection import Scored


@dataclass(frozen=True)
class Calibration:
    """Constants of the probabilities.

    Attributes
    ----------
    sharpness : fall of log probability per unit of log mean square of the fitted data: as many samples' worth of
        evidence, however long the log, because laws differ by more than chance does
    first_toll, second_toll : of log probability, for a first and a second effect: what chance wins
    leftover : share of the refit's misfit (rms) on the selection blocks left by the best named structure at which
        "unknown" is as likely as it
    leftover_held : the same of the held-out free run, where the command's jumps are known to a row only
    steepness : exponent of these transitions
    floor : mean square, sigmas, that a right structure may leave by its sensors and numerics alone
    real : mean square of the refit above which a gap without a name counts as unknown rather than none
    held : held-out gap over the noise floor that a right structure may leave (jitter, lost samples, jumps between rows)
    kept : share of the held-out equations' gap left by the best named structure at which "unknown" is as likely as it
    walls : parameters at their bounds at which "unknown" is as likely as the name
    held_real : held-out gap of the refit over the noise floor above which a gap without a name is unknown, not none
    """

    sharpness: float = 36.0
    first_toll: float = 9.0
    second_toll: float = 9.0
    leftover: float = 0.065
    leftover_held: float = 0.18
    steepness: float = 4.0
    floor: float = 0.6
    real: float = 2.5
    held: float = 1.5
    kept: float = 0.25
    walls: float = 1.3
    held_real: float = 3.0


@dataclass(frozen=True)
class HeldOutGaps:
    """What the held-out log says of the chosen structure.

    Attributes
    ----------
    refit, chosen : free-run gaps of the refit and of the chosen structure, in noise floors
    kept : share of the equations' gap that the chosen structure leaves to flexible corrections; None where the
        equations show too little of it
    """

    refit: float
    chosen: float
    kept: float | None = None


@dataclass(frozen=True)
class Opinion:
    """Probabilities of all hypotheses.

    Attributes
    ----------
    chosen : the selected structure (the refit for "none" and "unknown")
    verdict : id, pair of ids, "none" or "unknown"
    named : probability of each finalist and of the refit ("none"), by candidate
    unknown : probability that the library lacks the effect
    """

    chosen: Scored
    verdict: str
    named: Mapping[Candidate, float]
    unknown: float

    @property
    def probability(self) -> float:
        """Of the verdict: all candidates of the same effects count together, whatever their sites."""
        return self.unknown if self.verdict == "unknown" else self.of(self.verdict)

    @property
    def effects(self) -> dict[str, float]:
        """Probability of each effect, or pair of effects, wherever it sits."""
        names = dict.fromkeys(name_of(c) for c in self.named if c.parts)
        return {name: self.of(name) for name in names}

    def of(self, name: str) -> float:
        """Probability of all candidates of a name."""
        return min(1.0, sum(p for c, p in self.named.items() if name_of(c) == name))


def name_of(candidate: Candidate) -> str:
    """Verdict word of a candidate; one effect at two places is still that effect."""
    return "+".join(dict.fromkeys(sorted(effect for effect, _ in candidate.parts))) or "none"


def judge(
    refit: Scored,
    finalists: Sequence[Scored],
    chosen: Scored,
    calibration: Calibration,
    held: HeldOutGaps,
    walls: int = 0,
) -> Opinion:
    """Probabilities of the refit, of every finalist and of "unknown"; the verdict follows the selection.

    ``walls`` counts the chosen structure's parameters at a bound.
    """
    named = _named(refit, finalists, chosen, calibration)
    unknown = nameless(refit.level, chosen.level if chosen.size else None, held, walls, calibration)
    scaled = {candidate: p * (1.0 - unknown) for candidate, p in named.items()}
    verdict = "unknown" if unknown > 0.5 else name_of(chosen.fit.candidate)
    return Opinion(chosen, verdict, scaled, unknown)


def _named(
    refit: Scored, finalists: Sequence[Scored], chosen: Scored, calibration: Calibration
) -> dict[Candidate, float]:
    """Softmax of the training costs, parameters and effects paying their tolls; the selection has the last word."""
    tolls = (0.0, calibration.first_toll, calibration.first_toll + calibration.second_toll)

    def height(s: Scored) -> float:
        return -calibration.sharpness * s.price / s.samples - tolls[min(s.size, 2)]

    heights = {s.fit.candidate: height(s) for s in (refit, *finalists)}
    top = max(heights.values())
    # What the selection blocks chose is at least as probable as any other.
    heights[chosen.fit.candidate] = max(top, heights[chosen.fit.candidate])
    weights = {c: float(np.exp(h - top)) for c, h in heights.items()}
    total = sum(weights.values())
    return {c: w / total for c, w in weights.items()}


def nameless(
    level_refit: float, level_chosen: float | None, held: HeldOutGaps, walls: int, calibration: Calibration
) -> float:
    """Probability that what is left is the work of something without a name.

    Parameters
    ----------
    level_refit, level_chosen : mean squares on the selection blocks, sigmas; None where no effect was chosen
    held, walls, calibration : as in :func:`judge`
    """
    c = calibration
    if level_chosen is None:
        share = (level_refit / c.real) ** (0.5 * c.steepness)
        share += (beyond(held.refit, 1.0) / beyond(c.held_real, 1.0)) ** c.steepness
        return float(share / (1.0 + share))
    left = np.sqrt(max(0.0, level_chosen - c.floor) / max(level_refit, 1e-9))
    left_held = beyond(held.chosen, c.held) / max(beyond(held.refit, 1.0), c.held)
    # A law that is bent to the ends of what it can do stands in for another one.
    against = [left / c.leftover, left_held / c.leftover_held, walls / c.walls]
    if held.kept is not None:
        against.append(held.kept / c.kept)
    share = max(against) ** c.steepness
    return float(share / (1.0 + share))


def beyond(gap: float, floor: float) -> float:
    """What a gap holds beside a floor, both in noise floors."""
    return float(np.sqrt(max(0.0, gap**2 - floor**2)))
