# SPDX-License-Identifier: Apache-2.0
"""What is missing at a place as a curve: the residual of its equation over the one quantity that explains it best."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals import MEASURED
from pneumo_ros.diagnosis.half_car.where.design import Design
from pneumo_ros.diagnosis.half_car.where.locate import Location, corrected_residual
from pneumo_ros.diagnosis.half_car.where.regimes import shows_in
from pneumo_ros.diagnosis.half_car.where.weak import EQUATIONS, UNITS, averaged

BINS: Final = 15  # points of a measured law [display]
RISE: Final = 0.02  # s over which a change of opening is taken [taste]


@dataclass(frozen=True)
class Law:
    """A missing force, moment or flow over a quantity.

    Attributes
    ----------
    place, equation : where; the residual is what would have to be added to that equation
    quantity, quantity_unit, unit : of the axes, SI
    x, y : (K,) every window
    centres, means : (M,) mean residual in bins of equal count
    explained : share of the residual's variance that the curve of means explains, 0..1
    """

    place: str
    equation: str
    quantity: str
    quantity_unit: str
    unit: str
    x: Array
    y: Array
    centres: Array
    means: Array
    explained: float


def missing_law(location: Location, place: str | None = None) -> Law:
    """The curve that explains most of what the refitted model misses at a place (the one with the largest share)."""
    judge = location.judge
    where = place or location.shares[0][0]
    residual = corrected_residual(judge, location.refit_nuisance, np.zeros(len(judge.columns)))
    equation = shows_in(where, residual, judge.weight)
    e = EQUATIONS.index(equation)
    real = judge.weight[:, e] > 0
    y = (residual[:, e] * judge.null[e])[real]
    laws = [_law(where, equation, quantity, unit, x[real], y) for quantity, unit, x in _quantities(judge, e, where)]
    return max(laws, key=lambda law: law.explained)


def _law(place: str, equation: str, quantity: str, quantity_unit: str, x: Array, y: Array) -> Law:
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, BINS + 1)))
    unit = UNITS[EQUATIONS.index(equation)]
    if len(edges) < 3:
        return Law(place, equation, quantity, quantity_unit, unit, x, y, x[:0], y[:0], 0.0)
    bins = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    counts = np.maximum(np.bincount(bins, minlength=len(edges) - 1), 1)
    means = np.bincount(bins, y, len(edges) - 1) / counts
    centres = np.bincount(bins, x, len(edges) - 1) / counts
    variance = float(np.var(y)) or 1.0
    explained = 1.0 - float(np.mean((y - means[bins]) ** 2)) / variance
    return Law(place, equation, quantity, quantity_unit, unit, x, y, centres, means, explained)


def _quantities(design: Design, e: int, place: str) -> list[tuple[str, str, Array]]:
    features, signals = design.features, design.signals
    ends = features.ends if e < 2 else (features.ends[e % 2],)
    shift = max(1, round(RISE / signals.period))
    found = [
        ("spring velocity", "m/s", sum(end.travel_rate for end in ends)),
        ("spring travel", "m", sum(end.travel for end in ends)),
        ("gauge pressure", "Pa", sum(end.gauge for end in ends)),
        ("tyre compression rate", "m/s", sum(end.squeeze_rate for end in ends)),
        ("tyre compression", "m", sum(end.squeeze for end in ends)),
        ("body velocity", "m/s", features.heave_rate),
        ("pitch rate", "rad/s", features.pitch_rate),
        ("body acceleration", "m/s2", features.heave_acceleration),
        ("inlet opening", "m2", sum(end.inlet for end in ends)),
        ("change of opening in 20 ms", "m2", sum(end.inlet - np.roll(end.inlet, shift) for end in ends)),
        ("time", "s", features.time),
    ]
    if place.startswith("sensor:"):
        channel = place.removeprefix("sensor:")
        unit = "Pa" if channel.endswith("pressure") else "m"
        found.append((f"{channel.replace('_', ' ')} reading", unit, features.smooth[:, MEASURED.index(channel)]))
    windows = design.windows
    return [(name, unit, averaged(np.asarray(x), windows.window.value, windows.centres)) for name, unit, x in found]
