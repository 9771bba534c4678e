# SPDX-License-Identifier: Apache-2.0
"""Whom a subscription hears: one publisher, of this session, from the first sample to the last.

ROS 2 hands out messages without saying who sent them (rclpy's message info has no publisher), but the middleware says
that a publisher was matched before anything of it is delivered. A second publisher of a topic that has one is therefore
known in time: whatever it sends is never used.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from pneumo_ros.log.topics import Topic

NAMELESS = "a node without a name yet"
# s a node may take to announce its name after its publisher: 10 ms on an idle computer; an announcement that was lost
# is repeated after 3 s
NAMING = 4.0
UNKNOWN = "_UNKNOWN_"  # part of rmw's name of a node that has announced its publisher but not yet itself


def gid_of(info: TopicEndpointInfo) -> str:
    """An endpoint's identifier as text."""
    return bytes(info.endpoint_gid).hex()


def node_of(info: TopicEndpointInfo) -> str:
    """Full name of an endpoint's node."""
    if UNKNOWN in info.node_name + info.node_namespace:
        return NAMELESS
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"


class SoleSource:
    """The one publisher that a subscription may hear.

    Parameters
    ----------
    node : owner of the subscription
    topic : with one publisher by the table of topics
    on_other : called with a sentence when another publisher is there

    Attributes
    ----------
    bound : identifier of the publisher that is heard, '' before there is one
    held : whether another one may no longer take its place (set when the session has begun)
    count : publishers matched now
    """

    def __init__(self, node: Node, topic: Topic, on_other: Callable[[SoleSource, str], None]) -> None:
        self.topic = topic
        self.bound, self.held, self.count = "", False, 0
        self._subscription: Any = None
        self._callback: Any = None
        self._node, self._on_other = node, on_other

    def callbacks(self) -> SubscriptionEventCallbacks:
        """For the subscription's creation."""
        return SubscriptionEventCallbacks(matched=self._on_matched)

    def attach(self, subscription: Any) -> None:
        """The subscription it is about."""
        self._subscription, self._callback = subscription, subscription.callback

    def unheard(self) -> None:
        """Watch for publishers only: the messages come another way."""
        self._subscription.callback = self._callback = _forget

    def mute(self) -> None:
        """Use nothing more that arrives, whoever sent it, until one publisher is left."""
        self._subscription.callback = _forget

    def publishers(self) -> dict[str, str]:
        """Publishers there are: identifier -> node."""
        return {gid_of(i): node_of(i) for i in self._node.get_publishers_info_by_topic(self.topic.relative)}

    def too_many(self, patience: float = 0.0) -> str:
        """Who publishes the topic, in a sentence; with ``patience``, s, until all have a name."""
        end = time.monotonic() + patience
        while True:
            nodes = ", ".join(self._label(gid, node) for gid, node in self.publishers().items())
            if NAMELESS not in nodes or time.monotonic() >= end:
                return f"{self.count} nodes publish {self._name()}: {nodes}"
            time.sleep(NAMING / 100)

    def _on_matched(self, change: Any) -> None:
        there = self.publishers()
        self.count = change.current_count
        if self.count > 1:
            self._on_other(self, self.too_many())
        elif self.count == 1 and len(there) == 1:
            self._bind(*there.popitem())

    def _bind(self, gid: str, node: str) -> None:
        if self.held and self.bound not in ("", gid):
            self._on_other(self, f"{node} publishes {self._name()} in place of this session's node")
            return
        self.bound = gid
        self._subscription.callback = self._callback

    def refuse_other_publisher(self, announced: set[str]) -> None:
        """Say if the publisher is none of those that this session's nodes announced."""
        if self.bound and announced and self.bound not in announced:
            node = self.publishers().get(self.bound, "a node that has gone")
            self._on_other(self, f"{node} publishes {self._name()} and is not of this session")

    def _name(self) -> str:
        return str(self._node.resolve_topic_name(self.topic.relative))

    def _label(self, gid: str, node: str) -> str:
        return f"{node} (heard until now)" if gid == self.bound else f"{node} ({gid})"


def _forget(data: bytes) -> None:
    """Takes the place of a muted subscription's callback."""
