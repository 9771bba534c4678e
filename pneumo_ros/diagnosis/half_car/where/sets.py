# SPDX-License-Identifier: Apache-2.0
"""Sets of places: the smallest that closes what can be closed, its rivals, and each place's fair share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import Final, Protocol

import numpy as np

# Rms in null standard deviations below which nothing is missing: rigs with nothing but tolerances stay below 1.3,
# whatever laws they are made with [calibration: bench/locate.py]
FLAT: Final = 1.5
# Share of such a level that one place must close to be named: without a fault none closes more than a fifth
# [calibration: bench/locate.py]
SINGLED_OUT: Final = 0.3
LARGEST: Final = 5  # places in a set: two effects at both ends, and one more to see that it is not needed [taste]
WORTH: Final = 0.4  # share of what is left (mean square) that a further place must close [taste]
# Places that may act at both ends alike [definition]
BOTH_ENDS: Final = tuple((f"front_{part}", f"rear_{part}") for part in ("force", "air", "tyre"))


class Closing(Protocol):
    """Something that tells what is left once a set of places is corrected."""

    def value(self, places: Iterable[str]) -> float:
        """Mean square in null standard deviations."""


def smallest(closing: Closing, places: Sequence[str], largest: int = LARGEST, least: float = 0.0) -> list[str]:
    """The smallest set to which no further place adds enough.

    A further place must close :data:`WORTH` of what is left, and ``least`` of what was there at first.
    """
    levels = [closing.value(())]
    sets: list[list[str]] = [[]]
    for size in range(1, min(largest, len(places)) + 1):
        sets.append(best_subset(closing, size, sets[-1], places))
        levels.append(closing.value(sets[-1]))
    if len(levels) < 2 or (levels[0] < FLAT**2 and levels[1] > (1.0 - SINGLED_OUT) * levels[0]):
        return []
    for size, level in enumerate(levels[1:], start=1):
        ahead = [
            levels[k] > level * (1.0 - WORTH) ** (k - size) or level - levels[k] < least * levels[0]
            for k in range(size + 1, len(levels))
        ]
        if level < FLAT**2 or all(ahead):
            return sets[size]
    return sets[-1]


def rivals(closing: Closing, chosen: Sequence[str], places: Sequence[str]) -> tuple[tuple[tuple[str, ...], float], ...]:
    """Sets that differ from the chosen one by one place (or by both ends for a lone place) and leave at most a quarter
    more, with what they leave."""
    limit = 1.25**2 * max(closing.value(chosen), 1.0)
    found = []
    for k in range(len(chosen)):
        others = [[place] for place in places if place not in chosen]
        if len(chosen) == 1:
            others += [list(pair) for pair in BOTH_ENDS if set(pair) <= set(places) - set(chosen)]
        for instead in others:
            other = [*chosen[:k], *instead, *chosen[k + 1 :]]
            if closing.value(other) < limit:
                found.append((tuple(other), float(np.sqrt(closing.value(other)))))
    return tuple(sorted(found, key=lambda rival: rival[1])[:5])


def best_subset(closing: Closing, size: int, start: Sequence[str], places: Sequence[str]) -> list[str]:
    """Subset of ``size`` places with the lowest value: grown from ``start``, then improved by exchanges.

    Growth alone is not enough: two places that only work together (both ends of a rig) are found by the exchange.
    """
    chosen = list(start)
    while len(chosen) < size:
        chosen.append(min((p for p in places if p not in chosen), key=lambda p: closing.value([*chosen, p])))
    improving = True
    while improving:
        improving = False
        for k in range(len(chosen)):
            others = [p for p in places if p not in chosen]
            trials = [[*chosen[:k], p, *chosen[k + 1 :]] for p in others]
            if not trials:
                return chosen
            best = min(trials, key=closing.value)
            if closing.value(best) < closing.value(chosen) * (1.0 - 1e-6):
                chosen, improving = best, True
    return chosen


def shapley(closing: Closing, places: Sequence[str]) -> dict[str, float]:
    """Each place's fair share of ``value(nothing) - value(places)``, averaged over all orders of adding them."""
    count = len(places)
    weights = _order_weights(count)
    out = dict.fromkeys(places, 0.0)
    for size in range(count):
        for subset in combinations(places, size):
            before = closing.value(subset)
            for place in places:
                if place not in subset:
                    out[place] += weights[size] * (before - closing.value([*subset, place]))
    return out


def _order_weights(count: int) -> list[float]:
    """Probability that exactly a given subset of each size comes before a given place."""
    weights = []
    for size in range(count):
        choose = 1.0
        for k in range(size):
            choose *= (count - 1 - k) / (k + 1)
        weights.append(1.0 / (count * choose))
    return weights
