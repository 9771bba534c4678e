# SPDX-License-Identifier: Apache-2.0
"""What an effect is described by, whatever the rig: parameters, what they give together, and an effect at work."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from pneumo_ros.arrays import Array


@dataclass(frozen=True)
class Parameter:
    """A nuisance parameter: what the maker states and how well it is known.

    ``std`` is one sigma of the prior in ``unit``; the fit stays inside ``nominal`` +-
    three sigma of it.

    Attributes
    ----------
    loose : times ``std`` that it may be off by on a rig whose maker was wrong to be that sure
    otherwise : what such a maker states instead, in words; '' where ``loose`` is 1
    """

    name: str
    unit: str
    nominal: float
    std: float
    loose: float = 1.0
    otherwise: str = ""


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    Attributes
    ----------
    name, unit : SI
    low, high : bounds of the fit
    typical : a size (or shape) worth trying first; also the scale of the fit
    size : True for the parameter whose zero means "no effect"; False for one that shapes it
    starts : further values to start the fit from
    spread : prior standard deviation, in typical values; infinite where nothing is known beforehand
    ends : bounds that are natural ends of the law (a part of it that is absent, a share that is whole), where a fit may
        well stop; a stop at another bound is counted against the effect
    borders : bounds at which another family begins: as telling as a size beyond all measure
    meaning : what it is, in a few words for who has not read the law; '' where nobody wrote it
    """

    name: str
    unit: str
    low: float
    high: float
    typical: float
    size: bool = False
    starts: tuple[float, ...] = ()
    ends: tuple[float, ...] = (0.0,)
    borders: tuple[float, ...] = ()
    spread: float = math.inf
    meaning: str = ""

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise ValueError(f"parameter {self.name!r}: low {self.low:g} is not below high {self.high:g}")
        for word, value in (("typical", self.typical), *(("start", start) for start in self.starts)):
            if not self.low <= value <= self.high:
                text = f"parameter {self.name!r}: {word} {value:g} is outside low {self.low:g} to high {self.high:g}"
                raise ValueError(text)


# A family's shape is called <family>.shape; what may act at a place, whatever it is, anything.<kind of place>.
SHAPE, ANYTHING = "shape", "anything"


def family_of(effect: str) -> str:
    """The mechanism that an effect of the library is a law or the shape of: its id up to the first dot."""
    return effect.partition(".")[0]


def is_law(effect: str) -> bool:
    """Whether an effect competes by itself: a law of a family, neither its shape nor a place's ceiling."""
    return not effect.endswith(f".{SHAPE}") and family_of(effect) != ANYTHING


# Share of what is there that the reading of a sensor whose scale is off still follows: one that stops has come to its
# limit, which is an effect of another kind.
STILL_FOLLOWS = 0.15


@dataclass(frozen=True)
class Derived:
    """A number that an effect's parameters give together, for the report: often better known than any of them.

    ``of`` maps the parameter values (SI, in order) to it.
    """

    name: str
    unit: str
    of: Callable[[tuple[float, ...]], float]


@dataclass(frozen=True)
class Active:
    """An effect at a site with values of its parameters (in their order)."""

    effect: str
    site: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class Axis:
    """Name and unit of a coordinate."""

    name: str
    unit: str


@dataclass(frozen=True)
class Curve:
    """A law as measured.

    Attributes
    ----------
    x, y : coordinates
    points : (B, 5) x, y, low and high end of the 90 % band, weight (share of the run in the bin)
    """

    x: Axis
    y: Axis
    points: Array
