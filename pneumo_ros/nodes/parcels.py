# SPDX-License-Identifier: Apache-2.0
"""The nodes of a lockstep session in several processes send one another parcels (:mod:`pneumo_ros.log.parcel`).

What a node says in one step goes as one message to the nodes that wait for it, and a batch of steps as one message to
the recorder, for which nobody waits. Everybody else hears the topics as ever: a message goes out by itself as soon as
anybody listens who takes no parcel with it. Subscriptions of the session's own nodes stay, unheard: they watch for a
second publisher (:mod:`pneumo_ros.nodes.sources`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from pneumo_ros.log.parcel import pack, unpack
from pneumo_ros.log.topics import FOR_LOG, FOR_NEXT, IN_PARCELS, Topic
from pneumo_ros.nodes.readiness import Readiness

Take = Callable[[bytes], None]
BATCH = 20  # messages of a parcel for the log, or some more: a node that is killed takes as many with it
LOOK_AGAIN = 0.5  # s between looks who listens, and at most that a message for the log waits


class Owner(Protocol):
    """What parcels need of their node, which is a :class:`~pneumo_ros.nodes.base.RigNode`."""

    role: str
    readiness: Readiness
    begun: bool

    @property
    def session_nodes(self) -> set[str]: ...

    def expected_subscribers(self, topic: Topic) -> set[str]: ...

    def publisher(self, topic: Topic, **options: Any) -> Publisher: ...

    def subscribe(self, topic: Topic, callback: Take, qos: QoSProfile | None = None) -> object: ...


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
    """One topic's messages: into parcels, and by themselves while anybody listens who takes none of these.

    Attributes
    ----------
    heard : whether anybody does; True as long as it is not known
    """

    def __init__(self, topic: Topic, lanes: Sequence[Lane], made: Publisher) -> None:
        self.topic, self.lanes, self.made = topic, lanes, made
        self.heard = True
        self._send: Take = made.handle.publish_raw

    def publish(self, data: bytes) -> None:
        """One serialised message."""
        for lane in self.lanes:
            lane.waiting.append((self.topic.name, data))
        if self.heard:
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

    def covers(self, topic: Topic) -> bool:
        """Whether a topic's messages come to this node, or go from it, in parcels: both ends are of the session."""
        return topic in IN_PARCELS and {topic.publisher, self._node.role} <= self._node.session_nodes

    def sender(self, topic: Topic) -> Take:
        """Create the publisher of a topic; what sends its serialised messages."""
        takers = self._node.expected_subscribers
        lanes = [one for one in (self._next, self._log) if one is not None and takers(one.topic) & takers(topic)]
        on_matched = PublisherEventCallbacks(matched=lambda _: self._look())
        outlet = Outlet(topic, lanes, self._node.publisher(topic, event_callbacks=on_matched))
        self._outlets.append(outlet)
        return outlet.publish

    def take(self, topic: Topic, callback: Take, qos: QoSProfile) -> None:
        """Call ``callback`` with each serialised message of a topic."""
        here = self._node.role
        parcel = next(t[topic.publisher] for t in (FOR_NEXT, FOR_LOG) if here in t[topic.publisher].subscribers)
        if parcel.name not in self._takers:
            self._takers[parcel.name] = {}
            self._node.subscribe(parcel, self._opener(parcel), qos)
        self._takers[parcel.name][topic.name] = callback

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
        """The session begins: who takes parcels is known. ``timer`` calls a function every so many seconds."""
        self._look()
        timer(LOOK_AGAIN, self._look)
        timer(LOOK_AGAIN, self.send_log)

    def _look(self) -> None:
        """Who listens; again and again, for the graph lags behind what the middleware tells."""
        for one in self._outlets:
            parcels = {lane.topic.name for lane in one.lanes}
            one.heard = not self._node.begun or self._node.readiness.outsiders(one.topic, one.made, parcels)

    def _lane(self, parcels: Mapping[str, Topic]) -> Lane | None:
        parcel = parcels.get(self._node.role)
        if parcel is None or not self._node.expected_subscribers(parcel):
            return None
        return Lane(parcel, self._node.publisher(parcel))

    def _opener(self, parcel: Topic) -> Take:
        takers = self._takers[parcel.name]

        def opened(data: bytes) -> None:
            for topic, message in unpack(data, parcel.name):
                takers[topic](message)

        return opened
