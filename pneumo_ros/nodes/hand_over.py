# SPDX-License-Identifier: Apache-2.0
"""Nodes of one process hand their messages to one another, byte for byte what they would send.

rclpy has no intra-process communication: a message to a node of the same process goes through the middleware, which
costs more than all that the nodes of a lockstep session compute. Here a publisher of such a process gives its bytes to
those that take them there, and sends them as well as soon as anybody else listens. Subscriptions stay, unheard: they
watch for a second publisher (:mod:`pneumo_ros.nodes.sources`).
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Collection
from typing import Any

from rclpy.publisher import Publisher

from pneumo_ros.log.topics import Flow, Topic

Take = Callable[[bytes], None]
SLICE_NS = 4_000_000  # of handing over before timers, services and other topics have their turn
TURN = 1e-4  # s until the next slice
FLOWS = (Flow.STREAM, Flow.CLOCK)  # what every period or nearly so is sent; the rest is seldom, and sent


class Outlet:
    """The publisher of one topic in a process whose nodes hand over.

    Parameters
    ----------
    queue : where what takers are to be called with waits
    takers : called from the queue, in the order of what was published
    at_once : called before :meth:`publish` returns; must not publish

    Attributes
    ----------
    heard : whether anybody outside of the process listens
    """

    def __init__(self, queue: deque[tuple[Take, bytes]], takers: list[Take], at_once: list[Take]) -> None:
        self.heard = False
        self._queue, self._takers, self._at_once = queue, takers, at_once
        self._send: Take | None = None

    def attach(self, made: Publisher) -> None:
        """The publisher that sends to listeners outside."""
        self._send = made.handle.publish_raw

    def on_matched(self, change: Any) -> None:
        """As the middleware tells of subscriptions: those of the takers here are among them."""
        self.heard = change.current_count > len(self._takers) + len(self._at_once)

    def publish(self, data: bytes) -> None:
        """One serialised message."""
        for take in self._at_once:
            take(data)
        for take in self._takers:
            self._queue.append((take, data))
        if self.heard and self._send is not None:
            self._send(data)


class HandOver:
    """What is on its way between the nodes of one process.

    Parameters
    ----------
    roles : the nodes of the process, as the table of topics calls them
    """

    def __init__(self, roles: Collection[str]) -> None:
        self._roles, self._begun = frozenset(roles), False
        self._queue: deque[tuple[Take, bytes]] = deque()
        self._takers: dict[str, list[Take]] = {}
        self._at_once: dict[str, list[Take]] = {}

    def covers(self, topic: Topic) -> bool:
        """Whether a topic's messages are handed over: its publisher is here, and speaks all the time."""
        return topic.flow in FLOWS and topic.publisher in self._roles

    def outlet(self, topic: Topic) -> Outlet:
        """For the publisher of a topic."""
        return Outlet(self._queue, *self._lists(topic))

    def take(self, topic: Topic, callback: Take, at_once: bool = False) -> None:
        """Call ``callback`` with each message of a topic; ``at_once``: it takes no time and publishes nothing."""
        self._lists(topic)[at_once].append(callback)

    def begin(self, timer: Callable[[float, Callable[[], None]], object]) -> None:
        """Hand over from now on; ``timer`` calls a function every so many seconds. The first node that asks does it."""
        if not self._begun:
            self._begun = True
            timer(TURN, self.run)

    def run(self) -> None:
        """Hand over what waits and what that brings about, for :data:`SLICE_NS` at most."""
        queue, end = self._queue, time.monotonic_ns() + SLICE_NS
        while queue and time.monotonic_ns() < end:
            for _ in range(len(queue)):
                take, data = queue.popleft()
                take(data)

    def _lists(self, topic: Topic) -> tuple[list[Take], list[Take]]:
        return self._takers.setdefault(topic.name, []), self._at_once.setdefault(topic.name, [])
