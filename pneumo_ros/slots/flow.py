# SPDX-License-Identifier: Apache-2.0
"""Laws and atoms of a flow slot: leaks, errors of an orifice, relief, droop, heat; as :mod:`pneumo_ros.slots.force`.

``c`` are the coordinates (pressure or level up, down, nominal flow). What each law does is in :mod:`pneumo_ros.laws`.

Kernel arguments
----------------
c, z, P, S : coordinates (3,), memories (MEMORIES,), values of all laws and atoms (VALUES,), scales (SCALES,)
h, since : a step, and time since the log began, s
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from pneumo_ros.arrays import Array
from pneumo_ros.laws.flow import in_excess, relieved, settling, through_gap, through_hole, through_opening
from pneumo_ros.laws.memory import relaxed

# Laws: columns of P.
HOLE, GAP = 0, 1
FLOW, FLOW_SQUARE = 2, 3
RELIEF, RELIEF_DEPTH = 4, 5
DROOP, DROOP_TIME = 6, 7
HEAT, HEAT_TIME = 8, 9
POWER, EXPONENT = 10, 11
LAWS = 12

# Atoms.
A_HOLE, A_GAP = LAWS, LAWS + 1
OPENS = LAWS + 2  # holes that open above S_ABOVE
A_FLOW = OPENS + 4  # nominal flow times 1, itself, the ratio, the upper pressure
RELIEFS = A_FLOW + 4  # ramps of the upper pressure above S_ABOVE
DROOPS = RELIEFS + 4  # memories of the flow
HEATS = DROOPS + 3  # decays since the log began
STEADY = HEATS + 4
VALUES = STEADY + 1

# Scales.
S_ABOVE, S_TIMES, S_HEATS = 0, 4, 7
S_UP, S_FLOW, S_GAS, S_SWING, S_LOW = 11, 12, 13, 14, 15
SCALES = 16

# Memories: those of the flow, and the decays of heat.
Z_FLOW, Z_DROOP, Z_HEAT, Z_HEATS = 0, 3, 4, 5
MEMORIES = 9


@njit(cache=True, error_model="numpy")
def start(c: Array, z: Array, since: float, P: Array, S: Array) -> None:
    """Memories at the flow; decays as far on as the record's first row is from the log's."""
    for k in range(3):
        z[Z_FLOW + k] = c[2]
    z[Z_DROOP] = c[2]
    z[Z_HEAT] = math.exp(-since / P[HEAT_TIME]) if P[HEAT] != 0.0 else 0.0
    for k in range(4):
        z[Z_HEATS + k] = math.exp(-since / S[S_HEATS + k])


@njit(cache=True, error_model="numpy")
def advance(c: Array, z: Array, h: float, P: Array, S: Array) -> None:
    """Memories one step of ``h`` s later."""
    for k in range(3):
        z[Z_FLOW + k] = relaxed(z[Z_FLOW + k], c[2], h, S[S_TIMES + k])
    if P[DROOP] != 0.0:
        z[Z_DROOP] = relaxed(z[Z_DROOP], c[2], h, P[DROOP_TIME])
    if P[HEAT] != 0.0:
        z[Z_HEAT] *= math.exp(-h / P[HEAT_TIME])
    for k in range(4):
        z[Z_HEATS + k] *= math.exp(-h / S[S_HEATS + k])


@njit(cache=True, error_model="numpy")
def flow(c: Array, z: Array, P: Array, S: Array) -> float:
    """What flows beside the nominal flow, in the slot's unit."""
    up, down, nominal = c[0], c[1], c[2]
    gas = S[S_GAS] > 0.5
    hole, gap, share = through_hole(up, down, gas), through_gap(up, down, gas, S[S_UP]), nominal / S[S_FLOW]
    out = P[HOLE] * hole + P[GAP] * gap + in_excess(nominal, P[FLOW] + P[FLOW_SQUARE] * abs(share), 0.0, 0.0)
    out += (
        P[RELIEF] * relieved(up, S[S_LOW] + S[S_SWING] - P[RELIEF_DEPTH]) - P[DROOP] * nominal * z[Z_DROOP] / S[S_FLOW]
    )
    if P[POWER] != 0.0:
        out += P[POWER] * through_opening(up, down, S[S_UP], P[EXPONENT])
    if P[HEAT] != 0.0:
        out += P[HEAT] * settling(z[Z_HEAT], P[HEAT_TIME])
    out += P[STEADY] + P[A_HOLE] * hole + P[A_GAP] * gap
    for k in range(4):
        over = relieved(up, S[S_ABOVE + k])
        out += P[OPENS + k] * hole * over / S[S_SWING] + P[RELIEFS + k] * over
        out += P[HEATS + k] * settling(z[Z_HEATS + k], S[S_HEATS + k])
    level = (up - S[S_LOW]) / S[S_SWING]
    out += nominal * (P[A_FLOW] + P[A_FLOW + 1] * abs(share) + P[A_FLOW + 2] * (down / up if up > 0.0 else 0.0))
    out += nominal * P[A_FLOW + 3] * level
    for k in range(3):
        out -= P[DROOPS + k] * nominal * z[Z_FLOW + k] / S[S_FLOW]
    return out


def scales_of(up: Array, flow: Array, gas: bool, period: float, whole: float) -> Array:
    """Scales (SCALES,) from coordinates (M,) along runs near the data.

    Parameters
    ----------
    period, whole : s, of the slowest motion and of the record
    """
    S = np.ones(SCALES)
    low, high = (float(v) for v in np.quantile(up, [0.002, 0.998]))
    swing = max(high - low, 1e-12)
    S[S_ABOVE : S_ABOVE + 4] = low + np.array([0.4, 0.6, 0.8, 0.92]) * swing
    S[S_TIMES : S_TIMES + 3] = np.array([0.02, 0.15, 1.0]) * period
    S[S_HEATS : S_HEATS + 4] = np.array([0.01, 0.03, 0.1, 0.3]) * whole
    S[S_UP] = max(float(np.mean(np.abs(up))), 1e-12)
    S[S_FLOW] = max(float(np.quantile(np.abs(flow), 0.95)), 1e-12)
    S[S_GAS], S[S_SWING], S[S_LOW] = float(gas), swing, low
    return S
