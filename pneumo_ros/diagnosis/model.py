# SPDX-License-Identifier: Apache-2.0
"""What the diagnosis needs to know of any model: parameters, initial state, effects, and a prediction.

Fitting, selection, ambiguity and verdict use nothing but these protocols, so that another rig (a frame on a shaker, an
air chamber) is diagnosed by the same code; :mod:`pneumo_ros.effects.rig_model` is the half car's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.traits import HasSiteParameters
from pneumo_ros.effects.parameters import Active, Curve, EffectParameter, Parameter


class EffectLike(Protocol):
    """An unmodelled effect as the engine sees it."""

    @property
    def id(self) -> str: ...

    @property
    def sites(self) -> tuple[str, ...]:
        """Where it may act, in the model's own words: a place, a channel, "both" of two, "" for the whole rig."""

    @property
    def parameters(self) -> tuple[EffectParameter, ...]: ...


def parameters_at(effect: EffectLike, site: str) -> tuple[EffectParameter, ...]:
    """Parameters of an effect where it acts: their units and usual sizes may differ from site to site."""
    own = effect.by_site if isinstance(effect, HasSiteParameters) else {}
    return own.get(site, effect.parameters)


@dataclass(frozen=True)
class PlainEffect:
    """An effect of a rig whose model knows by itself what to do with it: name, where it may act, parameters."""

    id: str
    sites: tuple[str, ...]
    parameters: tuple[EffectParameter, ...]


class Model(Protocol):
    """A simulator with nuisance parameters and a library of effects."""

    @property
    def channels(self) -> tuple[str, ...]: ...

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    @property
    def effects(self) -> Mapping[str, EffectLike]: ...

    def initial(self, record: Any, active: Sequence[Active]) -> tuple[Array, Array]:
        """Initial state (S,) from the record's first samples, seen through the active sensor effects, and its std
        (S,).
        """

    def predict(
        self, record: Any, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> Array:
        """Free-running prediction of the measured channels, (rows or N, C); NaN after a divergence."""

    def places(self, active: Active) -> tuple[str, ...]:
        """Places of the rig that an effect at a site touches, first the one it is blamed on."""

    def side(self, active: Active) -> str | None:
        """Which side of the rig that is, in the model's own words; None where sides make no sense."""


@runtime_checkable
class HasCeilings(Protocol):
    """A model that knows what may act at a place, whatever it is: the ceiling of what can be closed there."""

    def anything_at(self, place: str) -> tuple[tuple[str, str], ...]:
        """(effect, site) of the flexible effects of a place; none where no term reaches."""


@runtime_checkable
class HasCurves(Protocol):
    """A model that shows an effect over its own coordinate."""

    def curve(
        self, record: Any, nuisance: Array, active: Sequence[Active], own: Sequence[Active], covariance: Array
    ) -> Curve | None:
        """Curve of one effect's parts along a record; ``covariance`` of their values (SI). None where it has none."""
