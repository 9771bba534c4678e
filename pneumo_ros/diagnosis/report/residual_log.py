# SPDX-License-Identifier: Apache-2.0
"""residual.mcap: the held-out log beside the models' free runs, for PlotJuggler, Foxglove and every reader of logs.

The contract's topics under a prefix each, same types and units: ``/measured``, ``/nominal``, ``/refit``, ``/corrected``
(with the best explanation) and ``/residual`` (measured minus corrected). Road, command and config keep their own names,
so that the file is itself a log of the rig's inputs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals import COMMANDS, MEASURED, ROADS, Signals
from pneumo_ros.diagnosis.record import Record
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
    """
    stamps = round(holdout.start * 1e9) + np.round(holdout.time * 1e9).astype(np.int64)
    about = {"log": holdout.name, "prefixes": "measured nominal refit corrected residual"}
    with new_residual_log(path, about) as writer:
        _write_inputs(writer, holdout, stamps)
        for prefix, table in tables_of(holdout, trajectories).items():
            _write_channels(writer, prefix, stamps, table)


def tables_of(holdout: Record, trajectories: Mapping[str, Array]) -> dict[str, Array]:
    """Prefix of the topics -> (N, C): the log, the free runs of :data:`PREFIXES` that are there, and the residual.

    A measured value without a real sample behind it is NaN.
    """
    measured = np.where(holdout.weight > 0.0, holdout.measured, np.nan)
    runs = {prefix: trajectories[key] for key, prefix in PREFIXES.items() if key in trajectories}
    residual = {"/residual": measured - trajectories["best"]} if "best" in trajectories else {}
    return {"/measured": measured} | runs | residual


@contextmanager
def new_residual_log(path: Path, about: Mapping[str, str]) -> Iterator[LogWriter]:
    """The log to write to, with what it is ``about``; an older one of that name is replaced."""
    path.unlink(missing_ok=True)
    writer = LogWriter(path, {"diagnosis": dict(about)}, bag_folder=False)
    complete = False
    try:
        yield writer
        complete = True
    finally:
        writer.finish(complete, "" if complete else "the diagnosis was interrupted")


def _write_inputs(writer: LogWriter, log: Signals, stamps: NDArray[np.int64]) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    text = store.types[STRING](data=log.rig.to_yaml())
    data = bytes(store.serialize_cdr(text, STRING))
    writer.write(writer.add_topic(CONFIG, STRING), data, int(stamps[0]))
    write_joints(writer, ROAD.name, ROAD.frame_id, ROADS, stamps, log.road)
    write_joints(writer, COMMAND.name, COMMAND.frame_id, COMMANDS, stamps, log.commands)


def _write_channels(writer: LogWriter, prefix: str, stamps: NDArray[np.int64], values: Array) -> None:
    write_joints(writer, prefix + DISPLACEMENT.name, DISPLACEMENT.frame_id, MEASURED[:4], stamps, values[:, :4])
    for column, topic in ((4, FRONT_PRESSURE), (5, REAR_PRESSURE)):
        channel, encoder = writer.add_topic(prefix + topic.name, PRESSURE), PressureEncoder(topic.frame_id, 0.0)
        for stamp, value in zip(stamps.tolist(), values[:, column].tolist(), strict=True):
            writer.write(channel, encoder.encode(stamp, value), stamp)


def write_joints(
    writer: LogWriter, topic: str, frame_id: str, names: Sequence[str], stamps: NDArray[np.int64], values: Array
) -> None:
    """A topic of JointState: ``values`` (N, K) of the named channels at ``stamps`` (N,), ns."""
    channel: Channel = writer.add_topic(topic, JOINT)
    encoder = JointEncoder(frame_id, names)
    for stamp, row in zip(stamps.tolist(), values.tolist(), strict=True):
        writer.write(channel, encoder.encode(stamp, row), stamp)
