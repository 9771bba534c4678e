# SPDX-License-Identifier: Apache-2.0
"""Who is there: each node says on /rig/ready which session it belongs to, its endpoints, and when it is ready.

Names of nodes in the graph prove nothing: they can be remapped, and two sessions have the same ones. A node counts as
there when it says so under this session's identity, and a topic as connected when the endpoints that were announced are
matched.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import String

from pneumo_ros.log.topics import READY, Topic
from pneumo_ros.nodes.qos import publisher_qos
from pneumo_ros.nodes.sources import gid_of


class Readiness:
    """What this node says of itself, and what the others of its session have said.

    Parameters
    ----------
    node : announces itself
    role : its name in the table of topics
    session : identity of the session, '' for nodes that were started by hand
    on_other_session : called with a sentence when a node of another session speaks

    Attributes
    ----------
    ready : roles whose publishers have all their subscribers
    """

    def __init__(self, node: Node, role: str, session: str, on_other_session: Callable[[str], None]) -> None:
        self.ready: set[str] = set()
        self._node, self._role, self._session, self._on_other_session = node, role, session, on_other_session
        self._said: dict[str, Mapping[str, Any]] = {}
        self._announced = False
        qos = publisher_qos(READY.flow, lockstep=True)
        self._publisher = node.create_publisher(String, READY.relative, qos)
        node.create_subscription(String, READY.relative, self._on_message, qos)

    def announce(self, outgoing: Iterable[Topic], incoming: Iterable[Topic]) -> bool:
        """Say which endpoints are this node's; False as long as the graph does not show them all."""
        if self._announced:
            return True
        published = {t.name: self._own(self._node.get_publishers_info_by_topic(t.relative)) for t in outgoing}
        taken = {t.name: self._own(self._node.get_subscriptions_info_by_topic(t.relative)) for t in incoming}
        if not all((*published.values(), *taken.values())):
            return False
        self._announced = True
        self._say({"publishers": published, "subscriptions": taken})
        return True

    def announce_ready(self) -> None:
        """Say that every publisher of this node has its subscribers."""
        self._say({"ready": True})

    def connected(self, topic: Topic, publisher: Publisher, takers: set[str]) -> bool:
        """Whether every node of ``takers`` has announced its subscription and all are matched."""
        told = [self._said.get(role, {}).get("subscriptions", {}).get(topic.name) for role in takers]
        there = {gid_of(i) for i in self._node.get_subscriptions_info_by_topic(topic.relative)}
        return all(gids and there.issuperset(gids) for gids in told) and publisher.get_subscription_count() >= len(told)

    def publishers(self, topic: Topic) -> set[str]:
        """Identifiers of the publishers of ``topic`` that this session's nodes have announced."""
        return {gid for said in self._said.values() for gid in said["publishers"].get(topic.name, [])}

    def _say(self, what: Mapping[str, Any]) -> None:
        self._publisher.publish(String(data=json.dumps({"session": self._session, "node": self._role, **what})))

    def _on_message(self, message: String) -> None:
        try:
            said = json.loads(message.data)
            session, role = str(said["session"]), str(said["node"])
        except (ValueError, TypeError, KeyError):
            self._on_other_session(f"{READY.name} carries {message.data[:60]!r}, which no node of a session says")
            return
        if session != self._session:
            self._on_other_session(f"{role} of another session ({session or 'started by hand'}) is here")
        elif "publishers" in said:
            self._said[role] = said
        elif "ready" in said:
            self.ready.add(role)

    def _own(self, endpoints: Iterable[Any]) -> list[str]:
        """Identifiers of this node's endpoints among those of a topic."""
        name, namespace = self._node.get_name(), self._node.get_namespace()
        return [gid_of(i) for i in endpoints if (i.node_name, i.node_namespace) == (name, namespace)]
