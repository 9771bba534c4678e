"""Signals from a log file of the contract, whoever wrote it."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from pneumo_ros.errors import InputError
from pneumo_ros.gap.signals.prepare import prepare
from pneumo_ros.gap.signals.types import Signals, TopicData
from pneumo_ros.rig import Rig, parse_rig

CONFIG = "/rig/config"


def read_signals(path: str | Path, rig: Rig | None = None) -> Signals:
    """Read a log and bring it onto one time base; ``rig`` replaces the log's own config.

    Raises
    ------
    InputError
        if the file is not a readable log, or cannot be diagnosed at all (one line: what, where, remedy).
    """
    topics, configs = topics_of(Path(path))
    return prepare(topics, rig or _own_rig(configs, Path(path)), Path(path).name)


def _own_rig(configs: list[str], path: Path) -> Rig:
    if not configs:
        raise InputError(f"no {CONFIG} in the log", where=path, remedy="give the rig with --rig FILE.yaml")
    rigs = [parse_rig(text, f"{path}, {CONFIG}") for text in configs]
    if any(other != rigs[0] for other in rigs[1:]):
        raise InputError(
            "the config changes during the log: two rigs are mixed", where=path,
            remedy="cut the log, or give the rig with --rig FILE.yaml",
        )  # fmt: skip
    return rigs[0]


def topics_of(path: Path) -> tuple[dict[str, TopicData], list[str]]:
    topics: dict[str, list[list[float]]] = defaultdict(list)
    names: dict[str, list[str]] = {}
    configs = []
    with path.open("rb") as handle:
        for _, channel, message, body in make_reader(
            handle, decoder_factories=[DecoderFactory()]
        ).iter_decoded_messages():
            if channel.topic == CONFIG:
                configs.append(body.data)
                continue
            stamp = body.header.stamp.sec + 1e-9 * body.header.stamp.nanosec
            values = [body.fluid_pressure] if hasattr(body, "fluid_pressure") else list(body.position)
            names.setdefault(channel.topic, list(getattr(body, "name", ["pressure"])))
            topics[channel.topic].append([stamp, 1e-9 * message.log_time, *values])
    out = {}
    for topic, rows in topics.items():
        array = np.array(rows)
        out[topic] = TopicData(array[:, 0], {n: array[:, 2 + i] for i, n in enumerate(names[topic])}, array[:, 1])
    return out, configs
