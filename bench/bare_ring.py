# SPDX-License-Identifier: Apache-2.0
"""The messages of a lockstep session and nothing else: what bare rclpy makes of the same hops.

Five nodes with the publishers, subscriptions, sizes and quality of service of a session pass messages that are packed
once and read by nobody: the fastest that the graph can go, whatever is computed in it. There are two graphs: the
parcels of a session in several processes, and every topic by itself, as a listener outside hears them.
``python bench/lockstep.py`` runs both beside sessions.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future

from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder, encode_clock
from pneumo_ros.log.parcel import pack
from pneumo_ros.log.topics import Topic
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.parcels import BATCH
from pneumo_ros.nodes.qos import publisher_qos, recorder_qos, subscriber_qos
from pneumo_ros.nodes.spin import LOOK_PERIOD, SPIN_TIMEOUT
from pneumo_ros.session.middleware import middleware_settings

SOME = 5  # clock, truth and sliding variables go out every so many periods, and a clock asks for as many road samples


class Said(NamedTuple):
    """What a node says: so many messages of a topic at once, every so many periods."""

    topic: Topic
    data: bytes
    every: int = 1
    times: int = 1


def packed(topic: Topic) -> bytes:
    """A message of the topic's size."""
    if topic is topics.CLOCK:
        return encode_clock(0)
    if topic.type == topics.PRESSURE:
        return PressureEncoder(topic.frame_id, 0.0).encode(0, 0.0)
    return JointEncoder(topic.frame_id, topic.names, topic.rates).encode(
        0, [0.0] * len(topic.names), [0.0] * len(topic.names) if topic.rates else ()
    )


def parcels(sender: str, every: int, said: Sequence[Topic], seldom: Sequence[Topic] = ()) -> tuple[Said, Said]:
    """For the next node what ``said`` holds, once a period each, and for the log that and what is said seldom."""
    once = [(topic.name, packed(topic)) for topic in said]
    periods = max(every, every * -(-BATCH // (every * len(said))))
    rare = [(topic.name, packed(topic)) for topic in seldom] * (periods // SOME)
    return (
        Said(topics.FOR_NEXT[sender], pack(once * every), every),
        Said(topics.FOR_LOG[sender], pack(once * periods + rare), periods),
    )


# Node -> what it waits for every period, and what it then says.
Graph = dict[str, tuple[tuple[Topic, ...], tuple[Said, ...]]]
CLOCK = Said(topics.CLOCK, packed(topics.CLOCK), SOME)
IN_PARCELS: Graph = {
    "road_profile": ((topics.CLOCK,), parcels("road_profile", SOME, (topics.ROAD,))),
    "plant": (
        (topics.FOR_NEXT["controller"], topics.FOR_NEXT["road_profile"]),
        (CLOCK, *parcels("plant", 1, topics.MEASUREMENTS, (topics.TRUTH,))),
    ),
    "estimator": ((topics.FOR_NEXT["plant"],), parcels("estimator", 1, (topics.ESTIMATE,))),
    "controller": ((topics.FOR_NEXT["estimator"],), parcels("controller", 1, (topics.COMMAND,), (topics.SLIDING,))),
    "session_recorder": (tuple(topics.FOR_LOG.values()), ()),
}
BY_THEMSELVES: Graph = {
    "road_profile": ((topics.CLOCK,), (Said(topics.ROAD, packed(topics.ROAD), SOME, SOME),)),
    "plant": (
        (topics.COMMAND, topics.ROAD),
        (CLOCK, *(Said(t, packed(t)) for t in topics.MEASUREMENTS), Said(topics.TRUTH, packed(topics.TRUTH), SOME)),
    ),
    "estimator": (topics.MEASUREMENTS, (Said(topics.ESTIMATE, packed(topics.ESTIMATE)),)),
    "controller": (
        (topics.ESTIMATE,),
        (Said(topics.COMMAND, packed(topics.COMMAND)), Said(topics.SLIDING, packed(topics.SLIDING), SOME)),
    ),
    "session_recorder": (topics.IN_PARCELS, ()),
}
GRAPHS = {"parcels": IN_PARCELS, "topics": BY_THEMSELVES}
ROLES = tuple(IN_PARCELS)
STEADY = Clock(clock_type=ClockType.STEADY_TIME)
START = 1.0  # s for all nodes to find one another


def said(graph: Graph) -> dict[str, Said]:
    """By the topic's name."""
    return {one.topic.name: one for _, says in graph.values() for one in says}


def hops(graph: Graph) -> float:
    """Messages a period that reach a subscriber."""
    all_said = said(graph)
    taken = [all_said[topic.name] for takes, _ in graph.values() for topic in takes]
    return sum(one.times / one.every for one in taken)


class Bare:
    """One node: when everything it waits for has come once more, it says what it has to say."""

    def __init__(self, role: str, graph: Graph) -> None:
        self.node = Node(f"bare_{role}", enable_rosout=False, start_parameter_services=False)
        self.periods = 0
        takes, says = graph[role]
        qos = (lambda flow, _: recorder_qos(flow)) if role == "session_recorder" else subscriber_qos
        self._says = [(self._publisher(one.topic), one) for one in says]
        steps = [one.every // one.times for one in (said(graph)[topic.name] for topic in takes)]
        self._waiting, self._step = [0] * len(takes), min(steps)
        for k, (topic, step) in enumerate(zip(takes, steps, strict=True)):
            kind, flow = message_class(topic.type), qos(topic.flow, True)
            self.node.create_subscription(kind, topic.relative, partial(self._take, k, step), flow, raw=True)

    def _publisher(self, topic: Topic) -> Callable[[bytes], None]:
        qos = publisher_qos(topic.flow, True)
        made = self.node.create_publisher(message_class(topic.type), topic.relative, qos)
        send: Callable[[bytes], None] = made.handle.publish_raw
        return send

    def say(self) -> None:
        """All that is due."""
        for publish, one in self._says:
            if self.periods % one.every == 0:
                for _ in range(one.times):
                    publish(one.data)

    def _take(self, k: int, step: int, _: bytes) -> None:
        self._waiting[k] += step
        if min(self._waiting) > self.periods:
            self.periods += self._step
            self.say()


def spin(roles: Sequence[str], graph: Graph, seconds: float) -> float:
    """Periods a second of the ring whose ``roles`` run in this process; 0 where the plant is elsewhere."""
    rclpy.init()
    nodes = {role: Bare(role, graph) for role in roles}
    executor = EventsExecutor()
    for one in nodes.values():
        executor.add_node(one.node)

    def until(end: float, done: Callable[[], bool] = lambda: False) -> None:
        """All events in few calls of the executor, as the nodes of a session do it (pneumo_ros/nodes/spin.py)."""
        asked = Future()

        def look() -> None:
            if (time.monotonic() >= end or done()) and not asked.done():
                asked.set_result(None)

        node = next(iter(nodes.values())).node
        timer = node.create_timer(LOOK_PERIOD, look, clock=STEADY)
        while time.monotonic() < end and not done():
            asked = Future()
            executor.spin_until_future_complete(asked, SPIN_TIMEOUT)
        node.destroy_timer(timer)

    until(time.monotonic() + START)
    if "plant" not in nodes:
        until(time.monotonic() + START + seconds)
        return 0.0
    plant = nodes["plant"]
    plant.say()  # the first sample
    until(time.monotonic() + START, lambda: plant.periods > 0)
    before, begun = plant.periods, time.monotonic()
    until(begun + seconds)
    return (plant.periods - before) / (time.monotonic() - begun)


def ring(domain: int, seconds: float, graph: str, single: bool) -> float:
    """Periods a second of a graph of :data:`GRAPHS`, in one process or in five."""
    groups = [",".join(ROLES)] if single else list(ROLES)
    place = {**os.environ, **middleware_settings(os.environ), "ROS_DOMAIN_ID": str(domain)}
    started = [
        subprocess.Popen(
            [sys.executable, __file__, "--roles", group, "--graph", graph, "--seconds", str(seconds)], env=place,
            text=True, stdout=subprocess.PIPE,
        )
        for group in groups
    ]  # fmt: skip
    return max(float(process.communicate()[0]) for process in started)


def main() -> None:
    """Run some roles and print the periods a second."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--roles", default=",".join(ROLES))
    parser.add_argument("--graph", choices=GRAPHS, default="parcels")
    parser.add_argument("--seconds", type=float, default=5.0)
    arguments = parser.parse_args()
    print(spin(arguments.roles.split(","), GRAPHS[arguments.graph], arguments.seconds))


if __name__ == "__main__":
    main()
