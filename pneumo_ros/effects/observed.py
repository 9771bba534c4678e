# SPDX-License-Identifier: Apache-2.0
"""From states of the half car to what ideal sensors show, and back."""

from __future__ import annotations

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.plant.equations import Body
from pneumo_ros.rig.channels import CHANNELS, channels_of_states


def ideal_channels(states: Array, body: Body) -> Array:
    """(..., 10) -> (..., 6): sprung points above the axles, axles, pressures."""
    out = np.empty((*states.shape[:-1], len(CHANNELS)))
    for k, column in enumerate(channels_of_states(states, body.front_arm, body.rear_arm)):
        out[..., k] = column
    return out


def rates_of_channels(state: Array, body: Body) -> Array:
    """Rates of the four measured heights, m/s, of a state (10,)."""
    return ideal_channels(np.concatenate([state[4:8], np.zeros(6)]), body)[:4]


def state_of(channels: Array, rates: Array, body: Body) -> Array:
    """The state (10,) that shows these channels (6,) and rates of heights (4,)."""
    base = body.front_arm + body.rear_arm
    pitch, pitch_rate = (channels[0] - channels[1]) / base, (rates[0] - rates[1]) / base
    heave, heave_rate = channels[0] - body.front_arm * pitch, rates[0] - body.front_arm * pitch_rate
    return np.array([heave, pitch, *channels[2:4], heave_rate, pitch_rate, *rates[2:4], *channels[4:6]])
