# SPDX-License-Identifier: Apache-2.0
"""What an effect is described by, whatever the rig: parameters, what they give together, and an effect at work."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Parameter:
    """A nuisance parameter: what the maker states and how well it is known.

    ``std`` is one sigma of the prior in ``unit``; the fit stays inside ``nominal`` +-
    three sigma of it.
    """

    name: str
    unit: str
    nominal: float
    std: float


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
    ends : bounds that are natural ends of the law (a part of it that is absent, a share that is whole), where a fit may
        well stop; a stop at another bound is counted against the effect
    """

    name: str
    unit: str
    low: float
    high: float
    typical: float
    size: bool = False
    starts: tuple[float, ...] = ()
    ends: tuple[float, ...] = (0.0,)

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise ValueError(f"parameter {self.name!r}: low {self.low:g} is not below high {self.high:g}")
        for word, value in (("typical", self.typical), *(("start", start) for start in self.starts)):
            if not self.low <= value <= self.high:
                text = f"parameter {self.name!r}: {word} {value:g} is outside low {self.low:g} to high {self.high:g}"
                raise ValueError(text)


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
