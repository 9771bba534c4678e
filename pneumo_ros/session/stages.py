"""Estimator and controller as a session runs them, without ROS: one input in, one message out, state explicit.

The same pure steps in the same order as nodes/estimator.py and nodes/controller.py; a replayed session gives the
recorded bytes again only because of that, and a test holds the two together.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.control.guard import guarded_step
from pneumo_ros.control.half_car import PARAMETERS as CONTROL_PARAMETERS
from pneumo_ros.control.profile import ProfilePlayer, build_commander
from pneumo_ros.estimation.half_car import PARAMETERS as ESTIMATION_PARAMETERS
from pneumo_ros.estimation.half_car import build_estimator
from pneumo_ros.parameters import Value
from pneumo_ros.rig import Rig


class Output(NamedTuple):
    """What a stage says at one sample: its message's values and, of the controller, its telemetry."""

    values: Array
    telemetry: Array


class Stage(Protocol):
    """One node's work."""

    def first(self, given: Array) -> Any:
        """State before the first input."""

    def placed(self, state: Any, number: int) -> Any:
        """The state at the ``number``-th sample of the session, for a stage that counts them."""

    def step(self, state: Any, given: Array) -> tuple[Any, Output]:
        """New state and output."""


GAP_PERIODS = 10  # control periods without a sample after which estimator and controller begin afresh
_NOTHING = np.empty(0)


def continues(stamp_ns: int, last_ns: int, period_ns: int) -> bool:
    """Whether a sample follows the last one closely: not after a jump back (a replayed log) or a long gap."""
    return 0 <= stamp_ns - last_ns <= GAP_PERIODS * period_ns


class EstimatorStage:
    """Measurement (6,) to estimate (16,)."""

    def __init__(self, rig: Rig, period: float, values: Mapping[str, Value]) -> None:
        self._estimator = build_estimator(rig, period, known(ESTIMATION_PARAMETERS, values), "estimator")

    def first(self, given: Array) -> Any:
        """At rest at the first measurement."""
        return self._estimator.init(given)

    def placed(self, state: Any, number: int) -> Any:
        """Does not count."""
        return state

    def step(self, state: Any, given: Array) -> tuple[Any, Output]:
        """One measurement."""
        state, estimate = self._estimator.step(state, given)
        return state, Output(estimate, _NOTHING)


class ControllerStage:
    """Estimate (16,) to command (4,), m2, and telemetry (6,) of /controller/sliding."""

    def __init__(self, rig: Rig, period: float, values: Mapping[str, Value]) -> None:
        self._controller = build_commander(rig, period, known(CONTROL_PARAMETERS, values), "controller")

    def first(self, given: Array) -> Any:
        """The reference starts where the estimate is."""
        return self._controller.init(given)

    def placed(self, state: Any, number: int) -> Any:
        """A valve profile is looked up by it; a controller does not count."""
        player = self._controller
        return player.placed(state, number) if isinstance(player, ProfilePlayer) else state

    def step(self, state: Any, given: Array) -> tuple[Any, Output]:
        """One estimate; a command that is not finite is replaced by the trim, as in the node."""
        done = guarded_step(self._controller, state, given)
        return done.state, Output(done.command, np.concatenate([done.telemetry, done.state[[0, 3]]]))


def known(table: Any, values: Mapping[str, Value]) -> dict[str, Value]:
    """The entries of ``values`` that ``table`` declares; nodes have further ones."""
    names = {parameter.name for parameter in table}
    return {name: value for name, value in values.items() if name in names}
