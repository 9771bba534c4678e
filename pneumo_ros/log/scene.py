# SPDX-License-Identifier: Apache-2.0
"""What a log's rig did as a scene: joint states, transforms and the URDF, for viewers that show a robot in 3D.

Made from any log with /rig/displacement, not recorded live: a session is not slowed by what only viewers want, and logs
of real rigs have it as well.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from pneumo_ros.errors import InputError
from pneumo_ros.log.cdr import JointEncoder
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.rewriting import refuse_target
from pneumo_ros.log.topic_data import Joint
from pneumo_ros.log.topics import DISPLACEMENT, JOINT_STATES, ROBOT_DESCRIPTION, STRING
from pneumo_ros.log.writing import LogWriter
from pneumo_ros.rig import Rig, load_rig
from pneumo_ros.rig.joints import Frame, frames, joint_positions
from pneumo_ros.rig.urdf import urdf

TRANSFORMS = "tf2_msgs/msg/TFMessage"
SHOWN_RATE = 100.0  # Hz; no screen shows more
NANO = 1_000_000_000
_STORE = get_typestore(Stores.ROS2_JAZZY)
Qos = list[dict[str, Any]]


def write_scene(log: Log, output: Path) -> int:
    """Write /joint_states, /tf and /robot_description of a log; returns the number of instants.

    Raises
    ------
    InputError
        if the log has no displacements, or the output exists or is no .mcap.
    """
    refuse_target(output, log.path)
    rig = log.config or load_rig()
    stamps, positions = _instants(log.joint(DISPLACEMENT.name), rig)
    writer = LogWriter(output, bag_folder=False)
    channels = [writer.add_topic(*topic) for topic in ((ROBOT_DESCRIPTION.name, STRING), ("/tf", TRANSFORMS),
                                                       (JOINT_STATES.name, JOINT_STATES.type))]  # fmt: skip
    encode = JointEncoder(JOINT_STATES.frame_id, JOINT_STATES.names).encode
    text = _STORE.types[STRING](data=urdf(rig))
    writer.write(channels[0], bytes(_STORE.serialize_cdr(text, STRING)), stamps[0])
    for stamp, position in zip(stamps, positions, strict=True):
        writer.write(channels[1], transforms(stamp, frames(position, rig)), stamp)
        writer.write(channels[2], encode(stamp, position.tolist()), stamp)
    writer.finish()
    return len(stamps)


def _instants(measured: Joint, rig: Rig) -> tuple[list[int], np.ndarray[Any, np.dtype[np.float64]]]:
    """Stamps, ns, and joint positions (n, 4), thinned to what a screen can show."""
    columns = [measured.names.index(name) for name in DISPLACEMENT.names if name in measured.names]
    if len(columns) < len(DISPLACEMENT.names) or not len(measured.stamp_ns):
        raise InputError("displacements are missing", where=DISPLACEMENT.name, value=measured.names,
                         allowed=", ".join(DISPLACEMENT.names))  # fmt: skip
    period = float(np.median(np.diff(measured.stamp_ns))) if len(measured.stamp_ns) > 1 else NANO
    every = max(1, round(NANO / SHOWN_RATE / max(period, 1.0)))
    kept = measured.position[::every][:, columns]
    return measured.stamp_ns[::every].tolist(), joint_positions(kept, rig)


def transforms(stamp_ns: int, found: tuple[Frame, ...]) -> bytes:
    """A serialised tf2_msgs/TFMessage."""
    types = _STORE.types
    stamp = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, NANO))
    listed = [
        types["geometry_msgs/msg/TransformStamped"](
            types["std_msgs/msg/Header"](stamp, frame.parent),
            frame.child,
            types["geometry_msgs/msg/Transform"](
                types["geometry_msgs/msg/Vector3"](*frame.position),
                types["geometry_msgs/msg/Quaternion"](*frame.quaternion),
            ),
        )
        for frame in found
    ]
    return bytes(_STORE.serialize_cdr(types[TRANSFORMS](listed), TRANSFORMS))
