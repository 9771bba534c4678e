# SPDX-License-Identifier: Apache-2.0
"""The same road with the valves held at trim, simulated without ROS: what the active session is held against."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.plant.sensors import truth
from pneumo_ros.plant.stepping import SteppedRig
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.session.summary import Recorded


def passive_session(session: Recorded, stepped: SteppedRig | None = None) -> Recorded:
    """The recorded road through the logged rig with passive valves; truth only, at the rate of the log's.

    ``stepped`` is the rig with its effects, stepped at the road's period; the nominal equations without it.
    """
    car, trim = nominal_half_car(session.rig)
    period = road_period(session)
    count = len(session.road) - 1
    shown = session.truth_time if len(session.truth_time) > 1 else session.measured_time
    every = max(1, round(float(np.median(np.diff(shown))) / period))
    rows = np.arange(0, count + 1, every)
    times = np.asarray(rows * period, dtype=np.float64)
    if stepped is None:
        states = car.simulate(trim.state, np.tile(trim.command, (count, 1)), session.road, period)
        known = np.array([truth(car, states[i], trim.command, session.road[i]) for i in rows])
    else:
        known = _stepped_truth(stepped, trim.command, session.road, every)
    return Recorded(
        rig=session.rig,
        time=times,
        command=np.tile(trim.command, (len(rows), 1)),
        estimate_time=np.empty(0),
        estimate=np.empty((0, 16)),
        truth_time=times,
        truth=known,
        road_time=session.road_time,
        road=session.road,
    )


def road_period(session: Recorded) -> float:
    """Of the road's samples, s."""
    return float(np.median(np.diff(session.road_time)))


def _stepped_truth(
    stepped: SteppedRig, command: NDArray[np.float64], road: NDArray[np.float64], every: int
) -> NDArray[np.float64]:
    state, known = stepped.init(), []
    for i in range(len(road)):
        if i % every == 0:
            known.append(stepped.truth(state, command, road[i]))
        if i + 1 < len(road):
            state = stepped.step(state, command, road[i : i + 2])
    return np.array(known)
