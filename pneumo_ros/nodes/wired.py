# SPDX-License-Identifier: Apache-2.0
"""How a node's messages go out and come in: by topics of the table, handed over within a process, or in parcels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rclpy.timer import Timer

from pneumo_ros.log.topics import Topic
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.parcels import Parcels
from pneumo_ros.nodes.qos import overriding, publisher_qos, refused_overrides, subscriber_qos
from pneumo_ros.nodes.sources import NAMING, SoleSource


class WiredNode(Node):
    """A node whose topics are those of the table; what it makes of them is for :class:`~pneumo_ros.nodes.base.RigNode`.

    Attributes
    ----------
    takes_at_once : whether what is handed over to it is only kept, in no time
    role : its name in the table of topics
    values : its parameters, of which ``mode``, ``session_nodes`` and ``session_id`` say how it is wired
    lockstep : whether every message counts
    sources : whom each of its subscriptions hears
    hand_over, parcels : the shorter ways; None where a node goes without
    """

    takes_at_once = False
    role: str
    values: dict[str, Any]

    def wire(self, hand_over: HandOver | None, refuse: Callable[[str], None]) -> None:
        """Before the first topic, once the parameters are known.

        Parameters
        ----------
        hand_over : of the nodes of one process; used in lockstep
        refuse : called with a sentence when somebody else publishes what has one publisher
        """
        self.lockstep = self.values["mode"] == "lockstep"
        self.hand_over = hand_over if self.lockstep else None
        self.sources: list[SoleSource] = []
        self._refuse_other = refuse
        self._outgoing: list[tuple[Topic, Publisher]] = []
        apart = self.lockstep and self.hand_over is None and self.values["session_id"]
        self.parcels = Parcels(self) if apart else None

    def create_publisher(self, *args: Any, **options: Any) -> Publisher:
        """As rclpy's; the quality of service can be overridden by parameters."""
        if not hasattr(self, "lockstep"):  # rclpy's own, while the node is being made
            return super().create_publisher(*args, **options)
        options.setdefault("qos_overriding_options", overriding(self.lockstep))
        with refused_overrides(self.get_name(), self.resolve_topic_name(args[1])):
            return super().create_publisher(*args, **options)

    def create_subscription(self, *args: Any, **options: Any) -> Subscription:
        """As rclpy's; the quality of service can be overridden by parameters."""
        if not hasattr(self, "lockstep"):
            return super().create_subscription(*args, **options)
        options.setdefault("qos_overriding_options", overriding(self.lockstep))
        with refused_overrides(self.get_name(), self.resolve_topic_name(args[1])):
            return super().create_subscription(*args, **options)

    def steady_timer(self, period: float, callback: Callable[[], None]) -> Timer:
        """A timer on a steady clock: simulated time may stand still, waiting and watching must not."""
        return self.create_timer(period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def sender(self, topic: Topic) -> Callable[[bytes], None]:
        """Create the publisher of a topic of the table; what sends serialised bytes with it, or in a shorter way."""
        for shorter in (self.hand_over, self.parcels):
            if shorter is not None and shorter.covers(topic):
                outlet = shorter.outlet(topic)
                outlet.attach(self.publisher(topic, event_callbacks=PublisherEventCallbacks(matched=outlet.on_matched)))
                return outlet.publish
        send: Callable[[bytes], None] = self.publisher(topic).handle.publish_raw
        return send

    def send_off(self) -> None:
        """Everything is said that other nodes wait for: where it goes in a parcel, that leaves now."""
        if self.parcels is not None:
            self.parcels.send_off()

    def publisher(self, topic: Topic, **options: Any) -> Publisher:
        """Create the publisher of a topic of the table; ``options`` as of :meth:`create_publisher`."""
        qos = publisher_qos(topic.flow, self.lockstep)
        made = self.create_publisher(message_class(topic.type), topic.relative, qos, **options)
        self._outgoing.append((topic, made))
        return made

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None], qos: QoSProfile | None = None) -> SoleSource:
        """Receive a topic of the table, or the parcels it comes in, from its one publisher, as serialised bytes."""
        qos = qos or subscriber_qos(topic.flow, self.lockstep)
        if self.parcels is not None and self.parcels.covers(topic):
            return self.parcels.take(topic, callback, qos)
        source = SoleSource(self, topic, self.on_other_publisher)
        made = self.create_subscription(
            message_class(topic.type), topic.relative, callback, qos,
            event_callbacks=source.callbacks() if topic.publisher else None, raw=True,
        )  # fmt: skip
        source.attach(made)
        self.sources.append(source)
        if self.hand_over is not None and self.hand_over.covers(topic):
            source.unheard()
            self.hand_over.take(topic, callback, at_once=self.takes_at_once)
        return source

    def on_other_publisher(self, source: SoleSource, text: str) -> None:
        """Somebody else publishes what this node takes from one publisher; nothing more of it is used."""
        source.mute()
        self._refuse_other(source.too_many(NAMING) if source.count > 1 else text)

    def sole_publisher(self, topic: Topic) -> None:
        """End the session if anybody else publishes a topic of this node's."""
        source = SoleSource(self, topic, self.on_other_publisher)
        source.count = len(source.publishers())
        if source.count > 1:
            self._refuse_other(source.too_many(NAMING))

    def expected_subscribers(self, topic: Topic) -> set[str]:
        """Nodes of the session that take ``topic`` itself, not in parcels."""
        return set() if self.parcels is not None and self.parcels.covers(topic) else self.takers(topic)

    def takers(self, topic: Topic) -> set[str]:
        """Other nodes of the session that act on what ``topic`` carries, or record it."""
        takers = {*topic.subscribers, *(("session_recorder",) if topic.recorded else ())}
        takers |= set() if self.lockstep else set(topic.in_real_time)
        return takers & self.session_nodes - {self.role}

    @property
    def session_nodes(self) -> set[str]:
        """Nodes of the session, as the table of topics calls them."""
        return set(str(self.values["session_nodes"]).split(","))
