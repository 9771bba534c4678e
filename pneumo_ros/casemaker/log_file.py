# SPDX-License-Identifier: Apache-2.0
"""Write a simulated session as a log of the contract (section 2)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rosbags.typesys import Stores, get_typestore

from pneumo_ros.casemaker.scene import PERIOD, Session
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder
from pneumo_ros.log.topics import COMMAND, CONFIG, DISPLACEMENT, FRONT_PRESSURE, REAR_PRESSURE, ROAD
from pneumo_ros.log.writing import LogWriter
from pneumo_ros.rig import Rig

NANO = 1e9


def write_log(path: Path, session: Session, config: Rig, start_ns: int) -> None:
    """Write ``path`` (.mcap); ``config`` is what /rig/config says, ``start_ns`` the stamp of the first sample."""
    messages = sorted(_messages(session, config, start_ns), key=lambda item: item[1])
    writer = LogWriter(path, bag_folder=False)  # a case holds several logs, none of which is the folder's bag
    topics = {t.name: writer.add_topic(t.name, t.type)
              for t in (ROAD, DISPLACEMENT, FRONT_PRESSURE, REAR_PRESSURE, COMMAND, CONFIG)}  # fmt: skip
    for name, stamp, data in messages:
        writer.write(topics[name], data, stamp)
    writer.finish()


def _messages(session: Session, config: Rig, start_ns: int) -> list[tuple[str, int, bytes]]:
    store = get_typestore(Stores.ROS2_JAZZY)
    text = store.types["std_msgs/msg/String"](data=config.to_yaml())
    out = [(CONFIG.name, start_ns, bytes(store.serialize_cdr(text, "std_msgs/msg/String")))]
    grid = start_ns + np.round(session.time * NANO).astype(np.int64)
    stamps = start_ns + np.round(session.stamps * NANO).astype(np.int64)
    ground = JointEncoder(ROAD.frame_id, ROAD.names, with_velocity=True)
    rates = np.gradient(session.road, PERIOD, axis=0)
    command = JointEncoder(COMMAND.frame_id, COMMAND.names)
    displacement = JointEncoder(DISPLACEMENT.frame_id, DISPLACEMENT.names)
    for i, stamp in enumerate(grid.tolist()):
        out.append((ROAD.name, stamp, ground.encode(stamp, session.road[i].tolist(), rates[i].tolist())))
        out.append((COMMAND.name, stamp, command.encode(stamp, [*session.run.inlets[i].tolist(), *session.outlets])))
        if session.kept[i, 0]:
            at = int(stamps[i, 0])
            out.append((DISPLACEMENT.name, at, displacement.encode(at, session.sensors[i, :4].tolist())))
    variance = config.pressure_noise.value**2
    for column, topic in ((4, FRONT_PRESSURE), (5, REAR_PRESSURE)):
        encoder = PressureEncoder(topic.frame_id, variance)
        for i in np.flatnonzero(session.kept[:, 1]).tolist():
            at = int(stamps[i, 1])
            out.append((topic.name, at, encoder.encode(at, float(session.sensors[i, column]))))
    return out
