# SPDX-License-Identifier: Apache-2.0
"""A topic's samples as arrays: named channels, one quantity, or any type as columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.log.layouts import Text


@dataclass(frozen=True)
class TopicInfo:
    """What the log says about a topic.

    Attributes
    ----------
    name, type : topic and message type, ``pkg/msg/Type``
    count : messages
    encoding : of the messages; only ``cdr`` can be decoded
    schema_encoding, schema : the type's definition as recorded
    qos : offered QoS profiles as the recorder noted them (YAML), or ""
    type_hash : RIHS01 hash of the type, or ""
    """

    name: str
    type: str
    count: int
    encoding: str
    schema_encoding: str
    schema: str
    qos: str
    type_hash: str


@dataclass(frozen=True)
class Joint:
    """A topic of named channels: N messages, K channels.

    Attributes
    ----------
    stamp_ns : (N,) the instant each value holds, ns
    log_time_ns : (N,) when it was recorded, ns
    names : the K channel names
    position : (N, K); its unit is the topic's (m for heights, m2 for areas), NaN where a message lacks the channel
    velocity, effort : (N, K), or None if the topic leaves them empty
    """

    stamp_ns: NDArray[np.int64]
    log_time_ns: NDArray[np.int64]
    names: tuple[str, ...]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64] | None
    effort: NDArray[np.float64] | None


@dataclass(frozen=True)
class Scalar:
    """A topic of one quantity: absolute pressure, Pa, and its variance, Pa2, each (N,)."""

    stamp_ns: NDArray[np.int64]
    log_time_ns: NDArray[np.int64]
    value: NDArray[np.float64]
    variance: NDArray[np.float64]


@dataclass(frozen=True)
class Columns:
    """Any topic as columns.

    Attributes
    ----------
    stamp_ns : (N,) header stamp; the log time for types without a header
    log_time_ns : (N,)
    arrays : by field path (``header.stamp.sec``, ``position``), (N,) or (N, K); object arrays where lengths vary
    texts : constant strings by path; strings that change are in ``arrays``
    """

    stamp_ns: NDArray[np.int64]
    log_time_ns: NDArray[np.int64]
    arrays: dict[str, NDArray[Any]]
    texts: dict[str, Text]
