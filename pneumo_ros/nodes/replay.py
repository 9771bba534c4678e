# SPDX-License-Identifier: Apache-2.0
"""Publish a log again, live: its inputs as they were recorded, with /clock, for nodes that run beside it."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy
from std_srvs.srv import Trigger

from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import encode_clock
from pneumo_ros.log.decoded import Log
from pneumo_ros.nodes.delivery import delivered
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.qos import recorded_qos
from pneumo_ros.nodes.spin import SPIN_TIMEOUT
from pneumo_ros.session.transport import SECOND, Transport

INPUTS = (
    topics.ROAD, topics.DISPLACEMENT, topics.FRONT_PRESSURE, topics.REAR_PRESSURE, topics.CONFIG,
)  # fmt: skip
"""What estimator and controller take in, and what describes it; the rest of a log are their outputs."""
CLOCK_PERIOD = 10_000_000  # ns of wall time between /clock messages: 100 Hz, as Gazebo does
IDLE = 0.01  # s between looks while nothing is due


@dataclass(frozen=True)
class Tape:
    """What is published: log times ascending (N,), the publisher's number and the message's row of each."""

    time_ns: NDArray[np.int64]
    which: NDArray[np.int64]
    row: NDArray[np.int64]


class Player:
    """Publishes a log along a :class:`Transport`.

    Parameters
    ----------
    log : to be published
    transport : where playback is
    everything : republish recorded outputs too
    context : private context, or None for the default one
    """

    def __init__(
        self, log: Log, transport: Transport, everything: bool = False, context: Context | None = None
    ) -> None:
        self.node = Node("replay", context=context, enable_rosout=False)
        self.transport = transport
        self.lateness: list[int] = []
        self.notes: list[str] = []
        self._log = log
        self._names = [name for name in log.topics if everything or name in {t.name for t in INPUTS}]
        self._publishers = [self._publisher(name) for name in self._names]
        self._tape = self._cut()
        self._clock = self.node.create_publisher(message_class(topics.CLOCK.type), topics.CLOCK.name, 10)
        self._cursor, self._jumps, self._wraps, self._next_clock = 0, -1, 0, 0
        self._lock = threading.RLock()
        self._declare()
        self.node.create_service(Trigger, "~/step", self._on_step)

    # -- controls --------------------------------------------------------------------------------------------------

    def _declare(self) -> None:
        t = self.transport
        for name, value in (("paused", t.paused), ("rate", t.rate), ("loop", t.loop), ("position", 0.0)):
            self.node.declare_parameter(name, value)
        self.node.add_on_set_parameters_callback(self._on_parameters)

    def _on_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        values = {change.name: change.value for change in changes}
        if values.get("rate", 1.0) <= 0.0:
            return SetParametersResult(successful=False, reason="rate must be positive")
        with self._lock:
            wall = time.monotonic_ns()
            if "paused" in values:
                self.transport.pause(wall, bool(values["paused"]))
            if "rate" in values:
                self.transport.set_rate(wall, float(values["rate"]))
            if "loop" in values:
                self.transport.loop = bool(values["loop"])
            if "position" in values:
                self.seek(float(values["position"]))
        return SetParametersResult(successful=True)

    def _on_step(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = True, f"at {self.step():.6f} s"
        return response

    def seek(self, seconds: float) -> None:
        """Jump to ``seconds`` after the log's start."""
        with self._lock:
            self.transport.seek(time.monotonic_ns(), self.transport.start + round(seconds * SECOND))

    def step(self) -> float:
        """Pause, and publish what is recorded at the next instant; returns where that is, s after the start."""
        with self._lock:
            wall = time.monotonic_ns()
            now = self.transport.now(wall)
            after = int(np.searchsorted(self._tape.time_ns, now, side="right"))
            there = int(self._tape.time_ns[after]) if after < len(self._tape.time_ns) else self.transport.end
            self.transport.step(wall, there)
            return (there - self.transport.start) / SECOND

    @property
    def position(self) -> float:
        """s after the log's start."""
        with self._lock:
            return (self.transport.now(time.monotonic_ns()) - self.transport.start) / SECOND

    # -- publishing ------------------------------------------------------------------------------------------------

    def _publisher(self, name: str) -> Publisher | None:
        info = self._log.topics[name]
        try:
            kind = message_class(info.type)
        except (ImportError, AttributeError, ValueError):
            self.notes.append(f"{name}: {info.type} is not installed, left out")
            return None
        return self.node.create_publisher(kind, name, recorded_qos(name, info.qos))

    def _cut(self) -> Tape:
        shown = [i for i, made in enumerate(self._publishers) if made is not None]
        records = [self._log.records(self._names[i]) for i in shown]
        times = np.concatenate([r.log_time_ns for r in records] or [np.empty(0, np.int64)])
        which = np.concatenate([np.full(len(r), i) for i, r in zip(shown, records, strict=True)] or [np.empty(0, int)])
        row = np.concatenate([np.arange(len(r)) for r in records] or [np.empty(0, int)])
        order = np.argsort(times, kind="stable")
        return Tape(times[order], which[order], row[order])

    def advance(self) -> float:
        """Publish what is due; returns how long to sleep, s."""
        with self._lock:
            wall = time.monotonic_ns()
            now = self.transport.now(wall)
            if self.transport.wraps != self._wraps:
                self._publish_up_to(self.transport.end)
                self._wraps = self.transport.wraps
            if self.transport.jumps != self._jumps:
                self._jump(self.transport.landed)
            self._publish_up_to(now)
            if wall >= self._next_clock:
                self._clock.publish(encode_clock(now))
                self._next_clock = wall + CLOCK_PERIOD
            return self._pause_before_next(wall)

    def flush(self) -> None:
        """Wait until reliable subscribers have confirmed everything."""
        delivered(made for made in self._publishers if made is not None)

    def _publish_up_to(self, now: int) -> None:
        end = int(np.searchsorted(self._tape.time_ns, now, side="right"))
        for i in range(self._cursor, end):
            if not self.transport.paused:
                self.lateness.append(time.monotonic_ns() - self.transport.wall_of(int(self._tape.time_ns[i])))
            self._publish(i)
        self._cursor = max(end, self._cursor)

    def _pause_before_next(self, wall: int) -> float:
        due = self._next_clock
        if not self.transport.paused and self._cursor < len(self._tape.time_ns):
            due = min(due, self.transport.wall_of(int(self._tape.time_ns[self._cursor])))
        return min(max((due - wall) / SECOND, 0.0), IDLE)

    def _jump(self, there: int) -> None:
        """After a seek or a loop: go on from there; what is latched is said again as it was there."""
        self._jumps = self.transport.jumps
        self._cursor = int(np.searchsorted(self._tape.time_ns, there, side="left"))
        self._clock.publish(encode_clock(there))
        for i in {
            int(w): i for i, w in enumerate(self._tape.which[: self._cursor].tolist()) if self._latched(w)
        }.values():
            self._publish(i)

    def _latched(self, which: int) -> bool:
        made = self._publishers[which]
        return made is not None and made.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL

    def _publish(self, i: int) -> None:
        which = int(self._tape.which[i])
        made = self._publishers[which]
        assert made is not None
        made.publish(self._log.records(self._names[which]).message(int(self._tape.row[i])))


def transport_of(log: Log, rate: float = 1.0, loop: bool = False, paused: bool = False) -> Transport:
    """A transport over the log's periodic topics: what was latched before the first sample does not stretch it.

    Raises
    ------
    InputError
        if the log holds no message of a known input.
    """
    found = [log.records(t.name).log_time_ns for t in INPUTS if t.name in log.topics and log.topics[t.name].count > 1]
    if not found:
        raise InputError("the log holds none of the session's inputs", where=log.path,
                         allowed=", ".join(t.name for t in INPUTS))  # fmt: skip
    return Transport(int(min(t[0] for t in found)), int(max(t[-1] for t in found)), rate, loop, paused)


@contextlib.contextmanager
def spinning(node: Node, context: Context) -> Iterator[None]:
    """Answer parameters and services in a thread of their own."""
    running = True
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin() -> None:
        while running and context.ok():
            executor.spin_once(timeout_sec=SPIN_TIMEOUT)

    thread = threading.Thread(target=spin, name="replay-services", daemon=True)
    thread.start()
    try:
        yield
    finally:
        running = False
        thread.join()
        executor.shutdown()
