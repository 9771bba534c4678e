# SPDX-License-Identifier: Apache-2.0
"""A log of the half car on its way into the diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.diagnosis.half_car.signals.initial import Initial, estimate_initial
from pneumo_ros.diagnosis.signals.types import Limitation, TopicTiming
from pneumo_ros.rig import Rig, channels

MEASURED: Final = channels.CHANNELS  # names of the contract [definition]
COMMANDS: Final = channels.VALVES  # names of the contract [definition]
ROADS: Final = channels.ROADS  # names of the contract [definition]


@dataclass(frozen=True)
class Signals:
    """One log on a uniform time base.

    Attributes
    ----------
    name : of the log, for messages
    rig : the log's own rig, SI with tolerances
    start : stamp of row 0, s since the epoch
    period : s between rows
    measured : (N, 6) columns ``MEASURED``, m upwards from the ground datum and Pa absolute; filled, never NaN
    weight : (N, 6) 1 where a real sample stands behind the value, 0 where it was filled
    commands : (N, 4) columns ``COMMANDS``, m2; row i holds from row i to row i + 1
    road : (N, 2) columns ``ROADS``, m; linear between rows
    noise, noise_stated : (6,) standard deviation of white sensor noise, from the data and from the config
    start_state : state of the half car at row 0 with its uncertainty
    topics : timing of each topic
    limitations : what is missing or doubtful
    """

    name: str
    rig: Rig
    start: float
    period: float
    measured: NDArray[np.float64]
    weight: NDArray[np.float64]
    commands: NDArray[np.float64]
    road: NDArray[np.float64]
    noise: NDArray[np.float64]
    noise_stated: NDArray[np.float64]
    start_state: Initial
    topics: tuple[TopicTiming, ...] = ()
    limitations: tuple[Limitation, ...] = ()

    @property
    def rig_name(self) -> str:
        """As its file has it."""
        return self.rig.name

    @property
    def time(self) -> NDArray[np.float64]:
        """(N,) s from row 0."""
        return np.asarray(np.arange(len(self.measured)) * self.period, dtype=float)

    @property
    def initial(self) -> NDArray[np.float64]:
        """(10,) state of :mod:`pneumo_ros.plant.equations` at row 0, estimated from the measurements around it."""
        return self.start_state.state

    @property
    def initial_std(self) -> NDArray[np.float64]:
        """(10,) one sigma of :attr:`initial`."""
        return self.start_state.std

    @property
    def model_form(self) -> float:
        """Share of each channel's std below which the rig's maker calls no difference an effect."""
        return self.rig.model_form.value

    @property
    def usable(self) -> NDArray[np.bool_]:
        """(6,) channels that carry anything."""
        return np.asarray(self.weight.any(axis=0))

    @property
    def scale(self) -> NDArray[np.float64]:
        """(6,) standard deviation of each channel over its real samples: what the gap is normalised by.

        1 for a channel without samples.
        """
        total = np.maximum(self.weight.sum(axis=0), 1.0)
        mean = (self.weight * self.measured).sum(axis=0) / total
        std = np.sqrt((self.weight * (self.measured - mean) ** 2).sum(axis=0) / total)
        return np.where(self.usable & (std > 0.0), std, 1.0)

    @property
    def confidence_cap(self) -> float:
        """Upper bound of the probability of any verdict from this log, 0..1."""
        return min((limit.cap for limit in self.limitations), default=1.0)

    @property
    def blocked(self) -> bool:
        """Whether a limitation forbids a verdict."""
        return self.confidence_cap <= 0.0

    def slice(self, first: int, last: int) -> Signals:
        """Rows ``first`` to ``last`` (excluded) as a log of its own, its initial state estimated anew."""
        measured, weight = self.measured[first:last], self.weight[first:last]
        return replace(
            self,
            start=self.start + first * self.period,
            measured=measured,
            weight=weight,
            commands=self.commands[first:last],
            road=self.road[first:last],
            start_state=estimate_initial(measured, weight, self.noise, self.period, self.rig),
        )
