# SPDX-License-Identifier: Apache-2.0
"""residual.mcap: the held-out log beside the models' free runs, for PlotJuggler, Foxglove and every reader of logs.

The contract's topics under a prefix each, same types and units: ``/measured``, ``/nominal``, ``/refit``, ``/corrected``
(with the best explanation) and ``/residual`` (measured minus corrected). Road, command and config keep their own names,
so that the file is itself a log of the rig's inputs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.signals import COMMANDS, MEASURED, ROADS, Signals
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder
from pneumo_ros.log.topics import (
    COMMAND,
    DISPLACEMENT,
    FRONT_PRESSURE,
    JOINT,
    PRESSURE,
    REAR_PRESSURE,
    ROAD,
    STRING,
)
from pneumo_ros.log.writing import Channel, LogWriter

# run -> what its topics in residual.mcap begin with [definition]
PREFIXES: Final = {"nominal": "/nominal", "refit": "/refit", "best": "/corrected"}
CONFIG: Final = "/rig/config"  # topic of the contract [definition]


def write_residual_log(path: Path, holdout: Signals, trajectories: Mapping[str, Array]) -> None:
    """Write the file; an older one of that name is replaced.

    Parameters
    ----------
    path : .mcap
    holdout : the log
    trajectories : "nominal", "refit" and "best" -> (N, 6) free runs; what is missing is left out

    A measured value without a real sample behind it is NaN.
    """
    path.unlink(missing_ok=True)
    stamps = round(holdout.start * 1e9) + np.round(holdout.time * 1e9).astype(np.int64)
    measured = np.where(holdout.weight > 0, holdout.measured, np.nan)
    about = {"log": holdout.name, "prefixes": "measured nominal refit corrected residual"}
    writer = LogWriter(path, {"diagnosis": about}, bag_folder=False)
    complete = False
    try:
        _write_inputs(writer, holdout, stamps)
        _write_channels(writer, "/measured", stamps, measured)
        for key, prefix in PREFIXES.items():
            if key in trajectories:
                _write_channels(writer, prefix, stamps, trajectories[key])
        if "best" in trajectories:
            _write_channels(writer, "/residual", stamps, measured - trajectories["best"])
        complete = True
    finally:
        writer.finish(complete, "" if complete else "the diagnosis was interrupted")


def _write_inputs(writer: LogWriter, log: Signals, stamps: NDArray[np.int64]) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    text = store.types[STRING](data=log.rig.to_yaml())
    data = bytes(store.serialize_cdr(text, STRING))
    writer.write(writer.add_topic(CONFIG, STRING), data, int(stamps[0]))
    _write_joints(writer, ROAD.name, ROAD.frame_id, ROADS, stamps, log.road)
    _write_joints(writer, COMMAND.name, COMMAND.frame_id, COMMANDS, stamps, log.commands)


def _write_channels(writer: LogWriter, prefix: str, stamps: NDArray[np.int64], values: Array) -> None:
    _write_joints(writer, prefix + DISPLACEMENT.name, DISPLACEMENT.frame_id, MEASURED[:4], stamps, values[:, :4])
    for column, topic in ((4, FRONT_PRESSURE), (5, REAR_PRESSURE)):
        channel, encoder = writer.add_topic(prefix + topic.name, PRESSURE), PressureEncoder(topic.frame_id, 0.0)
        for stamp, value in zip(stamps.tolist(), values[:, column].tolist(), strict=True):
            writer.write(channel, encoder.encode(stamp, value), stamp)


def _write_joints(
    writer: LogWriter, topic: str, frame_id: str, names: Sequence[str], stamps: NDArray[np.int64], values: Array
) -> None:
    channel: Channel = writer.add_topic(topic, JOINT)
    encoder = JointEncoder(frame_id, names)
    for stamp, row in zip(stamps.tolist(), values.tolist(), strict=True):
        writer.write(channel, encoder.encode(stamp, row), stamp)
