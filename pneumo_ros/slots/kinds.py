# SPDX-License-Identifier: Apache-2.0
"""Kinds of slot: named places of a model where something could be missing, with the coordinates it depends on.

A coordinate is a function ``(x, u, p) -> float`` of state, inputs and parameters. What is missing at a slot reaches the
model through its ``f``: ``f.<name>`` of the right-hand side and of the outputs is what acts there, 0 in the nominal
model, in the unit of the slot and with the sign of the equation it stands in.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

Coordinate = Callable[[Any, Any, Any], float]


def zero(x: Any, u: Any, p: Any) -> float:
    """A coordinate that a slot does without."""
    return 0.0


def one(x: Any, u: Any, p: Any) -> float:
    """An opening that is always open."""
    return 1.0


@dataclass(frozen=True)
class Slot:
    """A named place.

    Attributes
    ----------
    name : as ``f.<name>`` and as place of the verdict
    """

    name: str
    kind: ClassVar[str] = ""

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """What its laws depend on, in the order of its kind; empty for signals."""
        return ()

    @property
    def place(self) -> str:
        """As a diagnosis names it."""
        return self.name


@dataclass(frozen=True)
class Force(Slot):
    """A force that acts along a travel, positive in the direction in which the travel grows.

    Friction, damping, hysteresis, stops, errors of a spring are laws of such a slot; each opposes ``rate`` or
    ``travel``, so ``f.<name>`` is added where a force that accelerates the travel stands. A torque over an angle, or a
    voltage over a charge, is a force as well: say so by the units.

    Attributes
    ----------
    rate, travel : of the place, from one body to the other (or to the ground)
    load : normal force, where friction may grow with it
    unit, travel_unit : of the force and of the travel
    """

    rate: Coordinate = zero
    travel: Coordinate = zero
    load: Coordinate = zero
    unit: str = "N"
    travel_unit: str = "m"
    kind: ClassVar[str] = "force"

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The slot's functions of travel, its rate and, where it has one, the load."""
        return (self.travel, self.rate, self.load)


@dataclass(frozen=True)
class Contact(Force):
    """A force between two parts that may lose touch, as teeth of a gear or a wheel on the ground.

    Beside the laws of a force it may have backlash, and its nominal force (``load``) may be unable to pull.
    """

    kind: ClassVar[str] = "contact"


@dataclass(frozen=True)
class Flow(Slot):
    """A flow from a place of high to one of low pressure (or level), positive that way.

    Attributes
    ----------
    up, down : pressures, or levels, on either side; absolute ones for a gas
    flow : what the nominal model lets flow there; 0 where the nominal place is tight
    gas : whether the flow chokes, as a gas does; a liquid's goes with the root of the difference. A gas needs a
        ``pressure_unit`` of pressure
    unit, pressure_unit : of the flow and of the pressures
    """

    up: Coordinate = one
    down: Coordinate = zero
    flow: Coordinate = zero
    gas: bool = True
    unit: str = "kg/s"
    pressure_unit: str = "Pa"
    kind: ClassVar[str] = "flow"

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Up, down, nominal flow."""
        return (self.up, self.down, self.flow)


@dataclass(frozen=True)
class Input(Slot):
    """An input on its way to the rig: an actuator that is late, weak, dead about zero, or at its limit."""

    kind: ClassVar[str] = "input"

    @property
    def place(self) -> str:
        """``input:`` and its name."""
        return f"input:{self.name}"


@dataclass(frozen=True)
class Sensor(Slot):
    """A channel on its way to the log."""

    kind: ClassVar[str] = "sensor"

    @property
    def place(self) -> str:
        """``sensor:`` and its name."""
        return f"sensor:{self.name}"


IN_EQUATIONS = ("force", "contact", "flow")  # kinds whose laws act inside the equations
