"""The same road with the valves held at trim, simulated without ROS: what the active session is held against."""

from __future__ import annotations

import numpy as np

from pneumo_ros.plant.sensors import truth
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.session.summary import Recorded


def passive_twin(session: Recorded) -> Recorded:
    """The recorded road through the logged rig with passive valves; truth only, at the rate of the log's."""
    car, trim = nominal_half_car(session.rig)
    period = float(np.median(np.diff(session.road_time)))
    count = len(session.road) - 1
    states = car.simulate(trim.state, np.tile(trim.command, (count, 1)), session.road, period)
    every = max(1, round(float(np.median(np.diff(session.truth_time))) / period))
    rows = np.arange(0, count + 1, every)
    times = np.asarray(rows * period, dtype=np.float64)
    known = np.array([truth(car, states[i], trim.command, session.road[i]) for i in rows])
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
