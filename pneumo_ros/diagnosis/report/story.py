# SPDX-License-Identifier: Apache-2.0
"""What a reader needs first, in order, for the report's first screen and the terminal alike.

What it is, where, how big, which signals it mends and by how much, how to check it by hand, what else it may be, what
to do next; where there is no name, what came closest and why it was not taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.report.card import HALF_CAR, RigCard, ShownLog, ToldEffect
from pneumo_ros.diagnosis.report.facts import (
    Gain,
    check,
    closest,
    fate,
    measured,
    mended,
    moved,
    off,
    places,
    rivals,
    sizes,
    unseen,
    why_not,
)
from pneumo_ros.diagnosis.report.steps import Asked, Step, next_steps
from pneumo_ros.diagnosis.report.words import (
    UNNAMED,
    confidence,
    forbidden,
    headline,
    how_far,
    poor_timing,
)


@dataclass(frozen=True)
class Story:
    """The first screen.

    Attributes
    ----------
    headline, confidence : what, and how sure
    facts : (what is told, its text), in order
    steps : what to do next
    """

    headline: str
    confidence: str
    facts: tuple[tuple[str, str], ...]
    steps: tuple[Step, ...]


@dataclass(frozen=True)
class Known:
    """What is known beside the diagnosis file.

    Attributes
    ----------
    library : id -> effect
    gains : of :func:`gains`
    priors : parameter of the rig -> its nominal value and standard deviation
    own : ids of the user's own effects that competed
    asked : what was typed
    """

    library: Mapping[str, ToldEffect]
    gains: Sequence[Gain] = ()
    priors: Mapping[str, tuple[float, float]] | None = None
    own: Sequence[str] = ()
    asked: Asked | None = None


def gains(holdout: ShownLog, runs: Mapping[str, Array], card: RigCard = HALF_CAR) -> list[Gain]:
    """Of every usable signal, the one that is mended most (in its own standard deviations) first."""
    off = {key: _rms(holdout, runs[key]) for key in ("refit", "best")}
    order = np.argsort(-(off["refit"] - off["best"]) / holdout.scale)
    out = []
    for c in (int(c) for c in order if holdout.usable[c]):
        name = list(card.titles)[c]
        unit, factor = card.units[name]
        values = (factor * float(x[c]) for x in (off["refit"], off["best"], holdout.noise))
        out.append(Gain(card.titles[name], unit, *values))
    return out


def _rms(log: ShownLog, run: Array) -> Array:
    weight = np.maximum(log.weight.sum(axis=0), 1.0)
    return np.sqrt((log.weight * (log.measured - run) ** 2).sum(axis=0) / weight)


def story(summary: Mapping[str, Any], known: Known) -> Story:
    """The first screen of a diagnosis.

    Parameters
    ----------
    summary : the diagnosis file's mapping
    """
    verdict = str(summary["verdict"])
    phrases = {name: effect.summary for name, effect in known.library.items()}
    tell = _named if verdict not in UNNAMED else {"unknown": _unknown}.get(verdict, _nothing)
    facts = [*tell(summary, known), ("timing", poor_timing(summary)), *_own(summary, known)]
    steps = tuple(next_steps(summary, known.asked))
    return Story(headline(summary, phrases), confidence(summary), tuple(fact for fact in facts if fact[1]), steps)


def _named(summary: Mapping[str, Any], known: Known) -> list[tuple[str, str]]:
    return [
        ("where", places(summary)),
        ("how big", ", ".join(sizes(summary, known.library))),
        ("mends", mended(known.gains)),
        ("by hand", check(summary, known.library)),
        ("or else", rivals(summary, known.library)),
        ("the rig", moved(summary, known.priors)),
    ]


def _nothing(summary: Mapping[str, Any], known: Known) -> list[tuple[str, str]]:
    if summary["verdict"] == "not_testable":
        return [] if forbidden(summary) else [("unseen", unseen(summary))]
    return [
        ("the gap", how_far(summary)),
        ("off by", off(known.gains)),
        ("or else", rivals(summary, known.library)),
        ("the rig", moved(summary, known.priors)),
        ("unseen", unseen(summary)),
    ]


def _unknown(summary: Mapping[str, Any], known: Known) -> list[tuple[str, str]]:
    return [
        ("where", places(summary)),
        ("off by", off(known.gains)),
        ("closest", closest(summary)),
        ("not it", why_not(summary)),
        ("measured", measured(summary)),
        ("or else", rivals(summary, known.library)),
    ]


def _own(summary: Mapping[str, Any], known: Known) -> list[tuple[str, str]]:
    """What became of the user's own effects."""
    return [("your effect", "; ".join(fate(summary, name) for name in known.own))] if known.own else []
