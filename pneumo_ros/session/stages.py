# SPDX-License-Identifier: Apache-2.0
"""Estimator and controller as a session runs them, without ROS: one input in, one message out, state explicit.

The nodes and stepped replay take the same :func:`advance`: a replayed session gives the recorded bytes again because
nothing is written twice.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.control.guard import guarded_step
from pneumo_ros.control.half_car import HEAVE_REFERENCE, PITCH_REFERENCE
from pneumo_ros.control.half_car import PARAMETERS as CONTROL_PARAMETERS
from pneumo_ros.control.profile import ProfilePlayer, build_commander
from pneumo_ros.estimation.half_car import PARAMETERS as ESTIMATION_PARAMETERS
from pneumo_ros.estimation.half_car import build_estimator
from pneumo_ros.parameters import Value
from pneumo_ros.rig import Rig
from pneumo_ros.road.valve_profile import ValveProfile


class Output(NamedTuple):
    """What a stage says at one sample: its message's values and, of the controller, its telemetry.

    ``refused``: the command was not finite, and ``values`` are the trim in its place.
    """

    values: Array
    telemetry: Array
    refused: bool = False


class Stage(Protocol):
    """One node's work."""

    def first(self, given: Array) -> Any:
        """State before the first input."""

    def placed(self, state: Any, number: int) -> Any:
        """The state at the ``number``-th sample of the session, for a stage that counts them."""

    def step(self, state: Any, given: Array) -> tuple[Any, Output]:
        """New state and output."""

    def warm_up(self) -> None:
        """Load the compiled code, so that the first period is as short as the others."""


class Progress(NamedTuple):
    """How far a stage has come in a session: its state, and the stamps of its first and its last sample, ns."""

    state: Any
    first_ns: int
    last_ns: int


GAP_PERIODS = 10  # control periods without a sample after which estimator and controller begin afresh
_NOTHING = np.empty(0)


def continues(stamp_ns: int, last_ns: int, period_ns: int) -> bool:
    """Whether a sample follows the last one closely: not after a jump back (a replayed log) or a long gap."""
    return 0 <= stamp_ns - last_ns <= GAP_PERIODS * period_ns


def advance(
    stage: Stage, progress: Progress | None, stamp_ns: int, given: Array, period_ns: int
) -> tuple[Progress, Output]:
    """One sample of a session.

    Parameters
    ----------
    progress : how far the stage has come, or None before the first sample
    stamp_ns : of the sample, ns
    given : what the stage takes, SI
    period_ns : control period, ns
    """
    first_ns = stamp_ns if progress is None else progress.first_ns
    if progress is None or not continues(stamp_ns, progress.last_ns, period_ns):
        progress = Progress(stage.first(given), first_ns, stamp_ns)
    state, output = stage.step(stage.placed(progress.state, round((stamp_ns - first_ns) / period_ns)), given)
    return Progress(state, first_ns, stamp_ns), output


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

    def warm_up(self) -> None:
        """One step from rest."""
        self._estimator.step(self._estimator.init(np.zeros(6)), np.full(6, 2e5))


class ControllerStage:
    """Estimate (16,) to command (4,), m2, and telemetry (6,) of /controller/sliding."""

    def __init__(self, rig: Rig, period: float, values: Mapping[str, Value]) -> None:
        self._controller = build_commander(rig, period, known(CONTROL_PARAMETERS, values), "controller")

    @property
    def profile(self) -> ValveProfile | None:
        """The valve profile that is played, if no controller runs."""
        player = self._controller
        return player.profile if isinstance(player, ProfilePlayer) else None

    def first(self, given: Array) -> Any:
        """The reference starts where the estimate is."""
        return self._controller.init(given)

    def placed(self, state: Any, number: int) -> Any:
        """A valve profile is looked up by it; a controller does not count."""
        player = self._controller
        return player.placed(state, number) if isinstance(player, ProfilePlayer) else state

    def step(self, state: Any, given: Array) -> tuple[Any, Output]:
        """One estimate; a command that is not finite is replaced by the trim."""
        done = guarded_step(self._controller, state, given)
        telemetry = np.empty(6)
        telemetry[:4] = done.telemetry
        telemetry[4], telemetry[5] = done.state[HEAVE_REFERENCE], done.state[PITCH_REFERENCE]
        return done.state, Output(done.command, telemetry, done.refused)

    def warm_up(self) -> None:
        """One step from rest."""
        self._controller.step(self._controller.init(), np.full(16, 1e-3))


def known(table: Any, values: Mapping[str, Value]) -> dict[str, Value]:
    """The entries of ``values`` that ``table`` declares; nodes have further ones."""
    names = {parameter.name for parameter in table}
    return {name: value for name, value in values.items() if name in names}
