# SPDX-License-Identifier: Apache-2.0
"""Where, for a named verdict: how much each place's part of the fitted effects moves the outputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.fit.problem import scale_of
from pneumo_ros.diagnosis.model import Model
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.effects.parameters import Active


def effect_shares(
    model: Model, record: Record, nuisance: Array, initial: Array, active: Sequence[Active], explained: float
) -> list[tuple[str, float]]:
    """Places with their share of the gap, largest first.

    Each effect is split into its sites; a part's share is the mean square by which the prediction moves when the part
    is taken away, averaged over being taken first and being left last (fair to parts that work together).

    Parameters
    ----------
    explained : share of the gap that the effects close together; what is left is not given to any place
    """
    parts = [(one, piece) for one in active for piece in _pieces(model, one)]
    if not parts:
        return []
    whole = model.predict(record, nuisance, initial, active)
    bare = model.predict(record, nuisance, initial, ())
    moved = []
    for k, (_, piece) in enumerate(parts):
        others = [p for m, (_, p) in enumerate(parts) if m != k]
        without = model.predict(record, nuisance, initial, others)
        alone = model.predict(record, nuisance, initial, (piece,))
        moved.append(0.5 * (_size(record, whole - without) + _size(record, alone - bare)))
    total = sum(moved) or 1.0
    shares: dict[str, float] = {}
    for (_, piece), size in zip(parts, moved, strict=True):
        place = model.places(piece)[0]
        shares[place] = shares.get(place, 0.0) + explained * size / total
    return sorted(shares.items(), key=lambda item: -item[1])


def _pieces(model: Model, one: Active) -> list[Active]:
    """An effect at several sites, as one at each."""
    if one.site == "both":
        sites = model.effects[one.effect].sites
        return [Active(one.effect, site, one.values) for site in sites if site != "both"]
    return [one]


def _size(record: Record, difference: Array) -> float:
    value = float(np.mean((difference / scale_of(record)) ** 2))
    return value if np.isfinite(value) else 0.0
