# SPDX-License-Identifier: Apache-2.0
"""How report and terminal speak of a rig: its name, what its channels are called and shown in, and its picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.half_car.signals import MEASURED
from pneumo_ros.diagnosis.model import EffectLike
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.report.rig_map import draw_map
from pneumo_ros.diagnosis.signals.types import TopicTiming
from pneumo_ros.effects.guide import Guide

# names of the channels on the page [display]
TITLES: Final = {
    "sprung_front": "body above front axle", "sprung_rear": "body above rear axle", "unsprung_front": "front axle",
    "unsprung_rear": "rear axle", "front_pressure": "front air pressure", "rear_pressure": "rear air pressure",
}  # fmt: skip
# channel -> (unit shown, factor from SI) [display]
UNITS: Final = {name: ("kPa", 1e-3) if name.endswith("pressure") else ("mm", 1e3) for name in MEASURED}


class ToldEffect(EffectLike, Protocol):
    """An effect as a reader is told of it."""

    @property
    def summary(self) -> str:
        """What it is, in a few words."""

    @property
    def guide(self) -> Guide | None:
        """How it is checked by hand, and what it is mistaken for."""


class ShownLog(Record, Protocol):
    """A held-out log as the page shows it."""

    @property
    def rig_name(self) -> str: ...

    @property
    def time(self) -> Array:
        """(N,) s from row 0."""

    @property
    def scale(self) -> Array:
        """(C,) standard deviation of each channel."""

    @property
    def usable(self) -> Mask:
        """(C,) channels that carry anything."""

    @property
    def topics(self) -> Sequence[TopicTiming]:
        """Timing of each topic."""


@dataclass(frozen=True)
class RigCard:
    """A rig as people speak of it.

    Attributes
    ----------
    titles : channel -> what it is called, in the order of the record's columns
    units : channel -> unit shown, and factor to it
    picture : shares by place -> SVG
    name : of the rig; "" where the record's own says it
    """

    titles: Mapping[str, str]
    units: Mapping[str, tuple[str, float]]
    picture: Callable[[Mapping[str, float]], str]
    name: str = ""


HALF_CAR: Final = RigCard(TITLES, UNITS, draw_map)  # how the page shows the half car [display]
