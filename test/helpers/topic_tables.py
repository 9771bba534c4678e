# SPDX-License-Identifier: Apache-2.0
"""Topics of a log as tables: what they are called, and how a test changes one."""

from __future__ import annotations

import numpy as np

from pneumo_ros.diagnosis.half_car.signals import Signals, TopicData

Topics = dict[str, TopicData]
DISPLACEMENT, ROAD, VALVE = "/rig/displacement", "/road/profile", "/valve/command"
FRONT, REAR = "/rig/front/pressure", "/rig/rear/pressure"


def codes(signals: Signals) -> set[str]:
    return {limit.code for limit in signals.limitations}


def rows(data: TopicData, keep: np.ndarray) -> TopicData:
    received = None if data.received is None else data.received[keep]
    return TopicData(data.stamp[keep], {k: v[keep] for k, v in data.channels.items()}, received)


def with_channel(data: TopicData, name: str, values: np.ndarray) -> TopicData:
    return data._replace(channels={**data.channels, name: values})
