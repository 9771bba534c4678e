# SPDX-License-Identifier: Apache-2.0
"""The nodes of a lockstep session in several processes send one another parcels (:mod:`pneumo_ros.log.parcel`).

What a node says in one step goes as one message to the nodes that wait for it, and a batch of steps as one message to
the recorder, for which nobody waits. None of them subscribes to the topics themselves: these are for everybody else,
and sent as soon as anybody listens. Whoever else publishes one of them is not heard by the session, and still ends it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from pneumo_ros.log.parcel import pack, unpack
from pneumo_ros.log.topics import FOR_LOG, FOR_NEXT, IN_PARCELS, Topic
from pneumo_ros.nodes.sources import SoleSource

Take = Callable[[bytes], None]
BATCH = 20  # messages of a parcel for the log, or some more: a node that is killed takes as many with it
LOOK_AGAIN = 0.5  # s between looks who else publishes, and at most that a message for the log waits


class Owner(Protocol):
    """What parcels need of their node, which is a :class:`~pneumo_ros.nodes.base.RigNode`."""

    role: str

    @property
    def session_nodes(self) -> set[str]: ...

    def takers(self, topic: Topic) -> set[str]: ...

    def publisher(self, topic: Topic, **options: Any) -> Publisher: ...

    def subscribe(self, topic: Topic, callback: Take, qos: QoSProfile | None = None) -> SoleSource: ...

    def sole_publisher(self, topic: Topic) -> None: ...


class Lane:
    """Messages that wait to go to the same nodes in one parcel.

    Parameters
    ----------
    topic : that carries the parcels
    made : its publisher
    """

    def __init__(self, topic: Topic, made: Publisher) -> None:
        self.topic = topic
        self.waiting: list[tuple[str, bytes]] = []
        self._send: Take = made.handle.publish_raw

    def send(self) -> None:
        """What waits, if anything does."""
        if self.waiting:
            self._send(pack(self.waiting))
            self.waiting.clear()


class Outlet:
    """One topic's messages: into parcels, and by themselves while anybody listens.

    Attributes
    ----------
    heard : whether anybody does
    """

    def __init__(self, topic: Topic, lanes: Sequence[Lane]) -> None:
        self.topic, self.heard = topic, False
        self._lanes = lanes
        self._send: Take | None = None

    def attach(self, made: Publisher) -> None:
        """The publisher for whoever listens."""
        self._send = made.handle.publish_raw

    def on_matched(self, change: Any) -> None:
        """As the middleware tells of subscriptions."""
        self.heard = change.current_count > 0

    def publish(self, data: bytes) -> None:
        """One serialised message."""
        for lane in self._lanes:
            lane.waiting.append((self.topic.name, data))
        if self.heard and self._send is not None:
            self._send(data)


class Parcels:
    """What one node sends and takes in parcels.

    Parameters
    ----------
    node : of a lockstep session whose nodes know one another, in a process of its own
    """

    def __init__(self, node: Owner) -> None:
        self._node = node
        self._next, self._log = self._lane(FOR_NEXT), self._lane(FOR_LOG)
        self._outlets: list[Outlet] = []
        self._takers: dict[str, dict[str, Take]] = {}
        self._sources: dict[str, SoleSource] = {}

    def covers(self, topic: Topic) -> bool:
        """Whether a topic's messages come to this node, or go from it, in parcels: both ends are of the session."""
        return topic in IN_PARCELS and {topic.publisher, self._node.role} <= self._node.session_nodes

    def outlet(self, topic: Topic) -> Outlet:
        """For the publisher of a topic."""
        takers = self._node.takers
        lanes = [one for one in (self._next, self._log) if one is not None and takers(one.topic) & takers(topic)]
        self._outlets.append(Outlet(topic, lanes))
        return self._outlets[-1]

    def take(self, topic: Topic, callback: Take, qos: QoSProfile) -> SoleSource:
        """Call ``callback`` with each serialised message of a topic; returns whom the parcels come from."""
        here = self._node.role
        parcel = next(t[topic.publisher] for t in (FOR_NEXT, FOR_LOG) if here in t[topic.publisher].subscribers)
        takers = self._takers.setdefault(parcel.name, {})
        takers[topic.name] = callback
        if parcel.name not in self._sources:

            def opened(data: bytes) -> None:
                for name, message in unpack(data, parcel.name):
                    takers[name](message)

            self._sources[parcel.name] = self._node.subscribe(parcel, opened, qos)
        return self._sources[parcel.name]

    def send_off(self) -> None:
        """What the next nodes wait for; while they work, what is for the log as soon as it is a batch."""
        if self._next is not None:
            self._next.send()
        if self._log is not None and len(self._log.waiting) >= BATCH:
            self._log.send()

    def send_log(self) -> None:
        """What is for the log, however little."""
        if self._log is not None:
            self._log.send()

    def begin(self, timer: Callable[[float, Callable[[], None]], object]) -> None:
        """The session begins; ``timer`` calls a function every so many seconds."""
        self._look()
        timer(LOOK_AGAIN, self._look)
        timer(LOOK_AGAIN, self.send_log)

    def _look(self) -> None:
        """No subscription of the session's would be told of a second publisher."""
        for one in self._outlets:
            self._node.sole_publisher(one.topic)

    def _lane(self, parcels: Mapping[str, Topic]) -> Lane | None:
        parcel = parcels.get(self._node.role)
        if parcel is None or not self._node.takers(parcel):
            return None
        return Lane(parcel, self._node.publisher(parcel))
