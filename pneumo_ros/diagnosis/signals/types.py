# SPDX-License-Identifier: Apache-2.0
"""What is said of any log: samples of a topic, their timing, and what the log cannot tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

# In the sentence of a limitation of the time base, which the first screen tells beside the verdict [display]
BUSY: Final = "the computer was busy"
NO_VERDICT: Final = "; no verdict."  # ends the sentence of a limitation that forbids one [display]


class TopicData(NamedTuple):
    """Samples of one topic as they were logged.

    Attributes
    ----------
    stamp : (M,) header stamps, s
    channels : name -> (M,) values, SI; NaN where a message did not carry the name
    received : (M,) log times, s, or None
    """

    stamp: NDArray[np.float64]
    channels: Mapping[str, NDArray[np.float64]]
    received: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class TopicTiming:
    """How regularly a topic was sampled.

    Attributes
    ----------
    topic : name
    samples : messages used
    rate : 1 / median interval, Hz
    start, end : first and last stamp relative to the log's first row, s
    jitter : robust standard deviation of the interval, s
    missing : samples missing, from intervals longer than 1.5 medians
    longest_gap : s
    latency : median of log time minus stamp, s (NaN where the log time is unknown)
    """

    topic: str
    samples: int
    rate: float
    start: float
    end: float
    jitter: float
    missing: int
    longest_gap: float
    latency: float


@dataclass(frozen=True)
class Limitation:
    """What this log cannot tell, in one sentence a reader understands.

    Attributes
    ----------
    code : short fixed word, for programs
    text : the sentence
    channels : measured channels it concerns
    cap : upper bound of the probability of any verdict drawn from the log; 0 forbids a verdict
    """

    code: str
    text: str
    channels: tuple[str, ...] = ()
    cap: float = 1.0
