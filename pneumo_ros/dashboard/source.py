# SPDX-License-Identifier: Apache-2.0
"""Where the dashboard's samples come from: a log that is played back, or a running session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from pneumo_ros.dashboard.panels import SHOWN, Samples
from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.decoded import JOINT_STATE, Log
from pneumo_ros.log.inspection import Event, read_events
from pneumo_ros.parameters import Value
from pneumo_ros.rig import Rig, load_rig

State = Literal["playing", "paused", "live", "waiting", "ended"]


@dataclass(frozen=True)
class Status:
    """What the header says: state, the time shown, the session's start and end so far (stamps, ns), and a remark."""

    state: State
    now_ns: int
    start_ns: int
    end_ns: int
    remark: str = ""


class Source(Protocol):
    """Samples that the page asks for several times a second."""

    title: str

    @property
    def rig(self) -> Rig:
        """The rig whose numbers the derived signals need."""

    def tick(self, elapsed: float) -> None:
        """Let ``elapsed`` s of the viewer's time pass."""

    def status(self) -> Status:
        """What is shown now."""

    def window(self, seconds: float) -> Mapping[str, Samples]:
        """The last ``seconds`` up to now, by topic."""

    def events(self) -> Sequence[Event]:
        """Events up to now, oldest first."""


@dataclass(frozen=True)
class Control:
    """A live parameter: current value, and its range or choices."""

    node: str
    name: str
    description: str
    value: Value
    low: float
    high: float
    choices: tuple[str, ...] = ()

    @property
    def unit(self) -> str:
        """As the node's description ends with it, in brackets; '' for words and flags."""
        return self.description.rpartition("[")[2].rstrip("]") if self.description.endswith("]") else ""


class Controls(Protocol):
    """What the viewer may do to a running session. Nothing blocks; answers come through :meth:`answers`."""

    def estop(self) -> None:
        """Latch the emergency stop."""

    def reset(self) -> None:
        """Ask for the emergency stop to be released."""

    def parameters(self) -> Sequence[Control]:
        """Parameters that can change while the session runs; empty until they are known."""

    def change(self, node: str, name: str, value: Value) -> None:
        """Ask a node for another value."""

    def answers(self) -> list[str]:
        """What was answered since the last call, one line each."""


class Playback:
    """A log, played back at its own pace or faster.

    Attributes
    ----------
    playing, speed, loop : as the viewer set them
    """

    def __init__(self, log: Log, seconds_before: float = 0.0) -> None:
        self.title = log.path.name
        self._rig = log.config or load_rig()
        self._found = samples_of(log)
        self._events = list(read_events(log))
        if not self._found:
            there = ", ".join(f"{name} ({info.count})" for name, info in log.topics.items() if info.count)
            raise InputError("nothing to show: none of the topics that the dashboard knows", where=log.path,
                             allowed=", ".join(topic.name for topic in SHOWN),
                             remedy=f"the log has {there or 'no message'}")  # fmt: skip
        spans = [s.time_ns[[0, -1]] for s in self._found.values() if len(s.time_ns)]
        self.start_ns = int(min((s[0] for s in spans), default=0))
        self.end_ns = int(max((s[1] for s in spans), default=0))
        self._now = self.start_ns + round(seconds_before * 1e9)
        self.playing, self.speed, self.loop = True, 1.0, False

    @property
    def rig(self) -> Rig:
        """The log's rig, or the nominal one."""
        return self._rig

    def play(self, on: bool) -> None:
        """Go on, from the start if the end is reached; or stand still."""
        if on and not self.playing and self._now >= self.end_ns:
            self._now = self.start_ns
        self.playing = on

    def seek(self, seconds: float) -> None:
        """Show the instant ``seconds`` after the start."""
        self._now = min(max(self.start_ns + round(seconds * 1e9), self.start_ns), self.end_ns)

    def step(self, seconds: float) -> None:
        """Move by ``seconds`` and stay there."""
        self.playing = False
        self.seek((self._now - self.start_ns) * 1e-9 + seconds)

    def tick(self, elapsed: float) -> None:
        """Play on."""
        if not self.playing:
            return
        self._now += round(elapsed * self.speed * 1e9)
        if self._now >= self.end_ns:
            self._now = self.start_ns if self.loop else self.end_ns
            self.playing = self.loop

    def status(self) -> Status:
        """Where playback is."""
        return Status("playing" if self.playing else "paused", self._now, self.start_ns, self.end_ns)

    def window(self, seconds: float) -> Mapping[str, Samples]:
        """The last ``seconds`` before the instant shown."""
        begin = self._now - round(seconds * 1e9)
        return {topic: found.between(begin, self._now) for topic, found in self._found.items()}

    def events(self) -> Sequence[Event]:
        """Events up to the instant shown."""
        return [event for event in self._events if event.time_ns <= self._now]


def samples_of(log: Log) -> dict[str, Samples]:
    """The topics the panels need, as far as the log has them, stamps ascending."""
    out = {}
    for topic in SHOWN:
        info = log.topics.get(topic.name)
        if info is None or info.type != topic.type or info.count == 0:
            continue
        if topic.type == JOINT_STATE:
            joint = log.joint(topic.name)
            stamps, names, values = joint.stamp_ns, joint.names, joint.position
        else:
            scalar = log.pressure(topic.name)
            stamps, names, values = scalar.stamp_ns, topics.FRONT_PRESSURE.names[:1], scalar.value[:, None]
        order = np.argsort(stamps, kind="stable")
        out[topic.name] = Samples(stamps[order], names, values[order])
    return out
