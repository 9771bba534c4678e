# SPDX-License-Identifier: Apache-2.0
"""What commands the valves: a controller, or a profile that is played without looking at the rig."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.control.half_car import HEAVE_REFERENCE, PARAMETERS, PITCH_REFERENCE, PROFILE, build_controller
from pneumo_ros.parameters import Value, settings
from pneumo_ros.plant.trim import Trim, trim
from pneumo_ros.rig import Rig
from pneumo_ros.road.valve_profile import ValveProfile, read_profile

NUMBER = 6  # place in the state of the number of the next sample; a controller keeps an integral there


class Commander(Protocol):
    """Steps from an estimate to a command, as :class:`pneumo_ros.control.half_car.Controller`."""

    @property
    def at_rest(self) -> Trim: ...

    def init(self, estimate: Array | None = None) -> Array:
        """State (8,)."""

    def step(self, state: Array, estimate: Array) -> tuple[Array, Array, Array]:
        """New state (8,), command (4,) m2, telemetry (4,)."""


@dataclass(frozen=True)
class ProfilePlayer:
    """A table looked up by time.

    Attributes
    ----------
    at_rest : the trim, for valves that the profile leaves alone
    profile : what is played
    period : s between samples
    """

    at_rest: Trim
    profile: ValveProfile
    period: float

    def init(self, estimate: Array | None = None) -> Array:
        """State (8,): the heave and pitch it found (as references that nobody follows), sample 0."""
        state = np.zeros(8)
        if estimate is not None:
            state[HEAVE_REFERENCE], state[PITCH_REFERENCE] = estimate[0], estimate[1]
        return state

    def placed(self, state: Array, number: int) -> Array:
        """The state at the ``number``-th sample of the session: a lost sample must not delay what follows."""
        out = state.copy()
        out[NUMBER] = number
        return out

    def step(self, state: Array, estimate: Array) -> tuple[Array, Array, Array]:
        """The profile's openings at this sample, whatever the estimate."""
        command = self.profile.at(float(state[NUMBER]) * self.period)
        return self.placed(state, int(state[NUMBER]) + 1), command, np.zeros(4)


def build_commander(
    rig: Rig, period: float, values: dict[str, Value] | None = None, where: object = "controller"
) -> Commander:
    """A controller for a rig, or the player of a valve profile where ``controller`` says so.

    Raises
    ------
    InputError
        if a parameter or the profile cannot be used.
    """
    v = settings(PARAMETERS, values, where)
    if v["controller"] != PROFILE:
        return build_controller(rig, period, values, where)
    at_rest = trim(rig)
    profile = read_profile(str(v["valve_profile"]), at_rest.command, rig.inlet_area_max.value)
    return ProfilePlayer(at_rest, profile, period)
