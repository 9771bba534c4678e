# SPDX-License-Identifier: Apache-2.0
"""What records, models and effects may have beyond the least that a diagnosis asks of them: one protocol each.

The least stands in :mod:`pneumo_ros.diagnosis.model`. Whoever wants one of these asks with ``isinstance``, so that a
misspelt property is an error of types and not a silent default.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from pneumo_ros.arrays import Array
from pneumo_ros.effects.parameters import Active, Derived, EffectParameter

if TYPE_CHECKING:
    from pneumo_ros.diagnosis.fit.pace import Pace
    from pneumo_ros.diagnosis.record import Record
    from pneumo_ros.diagnosis.signals.types import Limitation


@runtime_checkable
class HasModelForm(Protocol):
    """A record whose rig's maker states what the model form is worth."""

    @property
    def model_form(self) -> float:
        """Share of each channel's std below which no difference is called an effect; 0 where nothing is stated."""


@runtime_checkable
class HasSlowNoise(Protocol):
    """A record part of whose noise wanders, so that averaging does not lessen it."""

    @property
    def slow_noise(self) -> Array:
        """(C,) standard deviation of that part."""


@runtime_checkable
class HasScale(Protocol):
    """A record that knows the std of its channels over its real samples."""

    @property
    def scale(self) -> Array:
        """(C,) standard deviation of each channel, in its unit."""


@runtime_checkable
class HasPace(Protocol):
    """A record with lengths of its own."""

    @property
    def pace(self) -> Pace: ...


@runtime_checkable
class ChangesNumbers(Protocol):
    """An effect that may change numbers of the rig itself, and nothing besides."""

    @property
    def changes_numbers(self) -> bool:
        """Whether it does: tolerances may then answer for all of it."""


@runtime_checkable
class IsScreened(Protocol):
    """A shape of which some parameters may be tried alone."""

    @property
    def screened(self) -> tuple[int, ...]:
        """Which are: the family's law does nothing like them."""


@runtime_checkable
class BeginsAlone(Protocol):
    """A shape that is fitted from some values as well, without its family's laws."""

    @property
    def begins(self) -> Sequence[tuple[float, ...]]:
        """Values of its parameters there, SI; empty for a shape that starts at nothing only."""


@runtime_checkable
class IsFollowed(Protocol):
    """A sensor's error that leaves the reading alive."""

    @property
    def follows(self) -> float:
        """Least share of what is there that the reading still follows at either end of its range; 0 where it may
        stop.
        """


@runtime_checkable
class ActsElsewhere(Protocol):
    """An effect whose motion may also come from places where no such effect sits."""

    @property
    def always(self) -> bool:
        """Whether its name is held against those places however little the structure leaves."""

    def elsewhere_of(self, site: str) -> tuple[tuple[str, ...], ...]:
        """Sets of those places, for what acts at one site; each set could make its motion; one with "-" is
        what ties two together, or another thing at one."""


@runtime_checkable
class HasLimits(Protocol):
    """A record that may forbid a verdict."""

    @property
    def limitations(self) -> Sequence[Limitation]: ...

    @property
    def blocked(self) -> bool:
        """Whether a limitation forbids a verdict."""


@runtime_checkable
class HasCoarse(Protocol):
    """A model that makes records of half the rate, for sensitivities."""

    def coarse_serves(self, active: Sequence[Active]) -> bool:
        """Whether half the rate will do for the sensitivities of these effects."""

    def coarse(self, record: Record) -> Record:
        """The record with every other row, so of twice the period."""


@runtime_checkable
class HasChanges(Protocol):
    """A model that sees what the configuration of another record states differently."""

    def changes(self, record: Record) -> dict[str, float]:
        """Factor on each parameter that differs, by name."""


@runtime_checkable
class NeedsVariety(Protocol):
    """An effect whose law is shown only where what it is a function of takes more than one value."""

    def varied(self, site: str) -> float:
        """Share (mean square) of what the law is a function of that its sign alone does not explain, along the logs
        that were fitted: where it is next to none, a law that knows the sign alone would do as well. Infinite for a law
        that asks for no variety.
        """


@runtime_checkable
class HasDerived(Protocol):
    """An effect whose parameters give further quantities together."""

    @property
    def derived(self) -> Sequence[Derived]: ...


@runtime_checkable
class HasSiteParameters(Protocol):
    """An effect whose parameters differ from site to site."""

    @property
    def by_site(self) -> Mapping[str, tuple[EffectParameter, ...]]: ...
