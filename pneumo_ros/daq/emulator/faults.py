# SPDX-License-Identifier: Apache-2.0
"""Faults the emulator can inject, and how they are written: ``kind@start[+duration][:key=value,...]``.

Times are seconds after the valves were armed for the first time; without a duration a fault stays (a reset and a
disconnection end by themselves).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pneumo_ros.daq.calibration import SENSORS
from pneumo_ros.errors import InputError, did_you_mean

DEFAULTS: dict[str, dict[str, float | str]] = {
    "drop": {"rate": 1e-3},
    "flip": {"rate": 1e-3},
    "noise": {"bytes": 64.0},
    "stuck": {"channel": "sprung_front"},
    "rail": {"channel": "sprung_front", "side": "high"},
    "offset": {"channel": "sprung_front", "value": 0.01},
    "jitter": {"ms": 8.0},
    "disconnect": {},
    "silent": {"deaf": 0.0},
    "drift": {"ppm": 100.0},
    "reset": {},
    "estop": {},
    "converter": {},
    "supply": {"pressure": 3e5},
}
MEANING = {
    "drop": "bytes vanish in both directions (rate: share of bytes)",
    "flip": "bits flip in both directions (rate: share of bytes hit)",
    "noise": "a burst of random bytes towards the host (bytes: how many)",
    "stuck": "a sensor repeats its last count (channel)",
    "rail": "a sensor sits at the converter's end (channel; side: high or low)",
    "offset": "a sensor jumps by a value (channel; value: m or Pa)",
    "jitter": "frames to the host are held back at random (ms: at most)",
    "disconnect": "the port vanishes; it comes back after the duration, 1 s by default",
    "silent": "the board stops sending (deaf=1: and listening)",
    "drift": "the board's clock runs fast, from boot on (ppm)",
    "reset": "the board restarts with closed valves and another boot id",
    "estop": "the hardware e-stop is pressed",
    "converter": "the converter does not answer",
    "supply": "the supply pressure falls (pressure: Pa absolute)",
}
PULSES = {"disconnect": 1.0, "reset": 0.2, "noise": 0.001}  # s they take by themselves
WORDS = {"channel": SENSORS, "side": ("high", "low")}


@dataclass(frozen=True)
class Fault:
    """One fault; ``start`` and ``end`` in s after the first arming, ``options`` as in :data:`DEFAULTS`."""

    kind: str
    start: float
    end: float
    options: Mapping[str, float | str] = field(default_factory=dict)

    def number(self, key: str) -> float:
        """A numeric option."""
        return float(self.options[key])

    def word(self, key: str) -> str:
        """An option that is a name."""
        return str(self.options[key])

    def active(self, elapsed: float) -> bool:
        """Whether it acts ``elapsed`` s after the first arming."""
        return self.start <= elapsed < self.end


def parse_fault(text: str) -> Fault:
    """Read ``kind@start[+duration][:key=value,...]``.

    Raises
    ------
    InputError
        naming the text and what is allowed.
    """
    head, _, tail = text.partition(":")
    kind, _, when = head.partition("@")
    if kind not in DEFAULTS:
        raise InputError("unknown fault", where="--fault", value=text, allowed=", ".join(DEFAULTS),
                         remedy=did_you_mean(kind, DEFAULTS))  # fmt: skip
    start_text, _, span_text = when.partition("+")
    start = _seconds(start_text or "0", text)
    if start < 0.0:
        raise InputError("a fault cannot begin before the first arming", where="--fault", value=text,
                         allowed="from 0 s", remedy="write for example stuck@5+2")  # fmt: skip
    span = _seconds(span_text, text) if span_text else PULSES.get(kind, math.inf)
    if span <= 0.0:
        raise InputError("a fault that lasts no time", where="--fault", value=text, allowed="more than 0 s",
                         remedy="write for example stuck@5+2")  # fmt: skip
    options = dict(DEFAULTS[kind])
    for item in filter(None, tail.split(",")):
        key, _, raw = item.partition("=")
        if key not in options:
            allowed = ", ".join(options) or "none"
            raise InputError("unknown option of a fault", where="--fault", key=key, value=text, allowed=allowed)
        options[key] = _option(key, raw, text)
    return Fault(kind, start, start + span, options)


def _option(key: str, raw: str, text: str) -> float | str:
    if key in WORDS:
        if raw not in WORDS[key]:
            raise InputError("unknown word", where="--fault", key=key, value=text, allowed=", ".join(WORDS[key]))
        return raw
    return _seconds(raw, text, key)


def _seconds(raw: str, text: str, key: str = "time") -> float:
    try:
        value = float(raw)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError("not a number", where="--fault", key=key, value=text, allowed="like stuck@5+2:channel=...")
    return value


class NoisyLine:
    """What dropped bytes and flipped bits do to a stream; ``rng`` makes it repeatable."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self.hits = 0

    def pass_through(self, data: bytes, drop: float, flip: float) -> bytes:
        """The bytes that arrive; ``drop`` and ``flip`` are shares of bytes hit."""
        if not data or (drop <= 0.0 and flip <= 0.0):
            return data
        draws = self._rng.random(len(data))
        if draws.min() > drop + flip:
            return data
        array = np.frombuffer(data, dtype=np.uint8).copy()
        flipped = (draws >= drop) & (draws < drop + flip)
        array[flipped] ^= (1 << self._rng.integers(0, 8, int(flipped.sum()))).astype(np.uint8)
        self.hits += int((draws < drop + flip).sum())
        return array[draws >= drop].tobytes()
