# SPDX-License-Identifier: Apache-2.0
"""A rig that can be stepped: what the plant node, the emulator and the replayed loop need to know of one.

Parameters are inside the object, the state is outside: ``init -> state``, ``step(state, command, road) -> state``. The
nominal equations are :class:`PlainRig`; a rig with diagnosed effects is a corrected rig, of another room.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from pneumo_ros.arrays import Array
from pneumo_ros.plant.half_car import HalfCar, half_car
from pneumo_ros.plant.sensors import read_channels, truth
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import Rig


class SteppedRig(Protocol):
    """A rig in steps of one control period."""

    def init(self) -> Any:
        """State before the first step: the trim that the rig's numbers give."""

    def step(self, state: Any, command: Array, road: Array) -> Any:
        """State one period later: command (4,) m2, held; road (2, 2) m, front and rear, at its start and end."""

    def read(self, state: Any) -> tuple[float, ...]:
        """What the sensors show without noise, (6,) of :data:`pneumo_ros.rig.channels.CHANNELS`."""

    def plant_state(self, state: Any) -> Array:
        """(10,) of :mod:`pneumo_ros.plant.equations`."""

    def truth(self, state: Any, command: Array, road: Array) -> Array:
        """(16,) as :func:`pneumo_ros.plant.sensors.truth`; command (4,), road (2,)."""

    def supply(self, state: Any) -> float:
        """Pressure at the inlet valves, Pa absolute."""

    def with_supply(self, pressure: float) -> SteppedRig:
        """The same rig at another supply pressure, Pa absolute; states go on."""


@dataclass(frozen=True)
class PlainRig:
    """The nominal equations; its state is the plant's (10,).

    Attributes
    ----------
    rig : the numbers
    car : the same, ready to integrate
    start : (10,) at rest
    period : s
    """

    rig: Rig
    car: HalfCar
    start: Array
    period: float

    def init(self) -> Array:
        """The state at trim, (10,)."""
        return self.start

    def step(self, state: Array, command: Array, road: Array) -> Array:
        """The state one period later, (10,)."""
        return self.car.advance(state, command, road, self.period)

    def read(self, state: Array) -> tuple[float, ...]:
        """What sensors without error show, (6,)."""
        return read_channels(state, self.car.body.front_arm, self.car.body.rear_arm)

    def plant_state(self, state: Array) -> Array:
        """The state itself, which is the plant's, (10,)."""
        return state

    def truth(self, state: Array, command: Array, road: Array) -> Array:
        """Of the nominal equations."""
        return truth(self.car, state, command, road)

    def supply(self, state: Array) -> float:
        """The rig's supply pressure, which is constant, Pa absolute."""
        return self.car.front.supply_pressure

    def with_supply(self, pressure: float) -> PlainRig:
        """Reference pressures stay: they are the nominal rig's."""
        references = (self.car.front.reference_pressure, self.car.rear.reference_pressure)
        rig = self.rig.with_values(supply_pressure=pressure)
        return PlainRig(rig, half_car(rig, references, self.car.surface), self.start, self.period)


def plain_rig(rig: Rig, period: float) -> PlainRig:
    """The nominal equations of a rig, stepped every ``period`` s."""
    car, at_rest = nominal_half_car(rig)
    return PlainRig(rig, car, at_rest.state, period)
