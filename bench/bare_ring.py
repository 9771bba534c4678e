# SPDX-License-Identifier: Apache-2.0
"""The messages of a lockstep session and nothing else: what bare rclpy makes of the same hops.

Five nodes with the publishers, subscriptions, sizes and quality of service of a session pass messages that are packed
once and read by nobody: the fastest that the graph can go, whatever is computed in it. ``python bench/lockstep.py``
runs it beside sessions.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future

from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder, encode_clock
from pneumo_ros.log.topics import Topic
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.qos import publisher_qos, recorder_qos, subscriber_qos
from pneumo_ros.nodes.spin import LOOK_PERIOD, SPIN_TIMEOUT
from pneumo_ros.session.middleware import middleware_settings

# Node -> what it waits for every period, and what it then says.
GRAPH: dict[str, tuple[tuple[Topic, ...], tuple[Topic, ...]]] = {
    "road": ((topics.CLOCK,), (topics.ROAD,)),
    "plant": ((topics.COMMAND, topics.ROAD), (topics.CLOCK, *topics.MEASUREMENTS, topics.TRUTH)),
    "estimator": (topics.MEASUREMENTS, (topics.ESTIMATE,)),
    "controller": ((topics.ESTIMATE,), (topics.COMMAND, topics.SLIDING)),
}
RECORDED = (topics.ROAD, *topics.MEASUREMENTS, topics.ESTIMATE, topics.COMMAND, topics.TRUTH, topics.SLIDING)
SOME = 5  # clock, truth and sliding variables go out every so many periods, and a clock asks for as many road samples
SELDOM = (topics.CLOCK, topics.TRUTH, topics.SLIDING)
HOPS = sum(1.0 / SOME if t in SELDOM else 1.0 for t in (*RECORDED, *(t for takes, _ in GRAPH.values() for t in takes)))
STEADY = Clock(clock_type=ClockType.STEADY_TIME)
START = 1.0  # s for all nodes to find one another
ROLES = (*GRAPH, "recorder")


def packed(topic: Topic) -> bytes:
    """A message of the topic's size."""
    if topic is topics.CLOCK:
        return encode_clock(0)
    if topic.type == topics.PRESSURE:
        return PressureEncoder(topic.frame_id, 0.0).encode(0, 0.0)
    return JointEncoder(topic.frame_id, topic.names).encode(0, [0.0] * len(topic.names))


class Bare:
    """One node: when everything it waits for has come once more, it says what it has to say."""

    def __init__(self, role: str) -> None:
        self.node = Node(f"bare_{role}", enable_rosout=False, start_parameter_services=False)
        self.periods = 0
        takes, says = GRAPH.get(role, (RECORDED, ()))
        qos = (lambda flow, _: recorder_qos(flow)) if role == "recorder" else subscriber_qos
        self._waiting = dict.fromkeys(range(len(takes)), 0)
        self._times = SOME if role == "road" else 1
        self._says = []
        for topic in says:
            made = self.node.create_publisher(
                message_class(topic.type), topic.relative, publisher_qos(topic.flow, True)
            )
            self._says.append((made.publish, packed(topic), topic in SELDOM))
        for k, topic in enumerate(takes):
            self.node.create_subscription(
                message_class(topic.type), topic.relative, partial(self._take, k), qos(topic.flow, True), raw=True
            )

    def say(self) -> None:
        """All that is due."""
        for _ in range(self._times):
            for publish, data, seldom in self._says:
                if not seldom or self.periods % SOME == 0:
                    publish(data)

    def _take(self, k: int, _: bytes) -> None:
        self._waiting[k] += 1
        if min(self._waiting.values()) > self.periods:
            self.periods += 1
            self.say()


def spin(roles: Sequence[str], seconds: float) -> float:
    """Periods a second of the ring whose ``roles`` run in this process; 0 where the plant is elsewhere."""
    rclpy.init()
    nodes = {role: Bare(role) for role in roles}
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


def ring(domain: int, seconds: float, single: bool) -> float:
    """Periods a second, in one process or in five."""
    groups = [",".join(ROLES)] if single else list(ROLES)
    place = {**os.environ, **middleware_settings(os.environ), "ROS_DOMAIN_ID": str(domain)}
    started = [
        subprocess.Popen(
            [sys.executable, __file__, "--roles", group, "--seconds", str(seconds)], env=place, text=True,
            stdout=subprocess.PIPE,
        )
        for group in groups
    ]  # fmt: skip
    return max(float(process.communicate()[0]) for process in started)


def main() -> None:
    """Run some roles and print the periods a second."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--roles", default=",".join(ROLES))
    parser.add_argument("--seconds", type=float, default=5.0)
    arguments = parser.parse_args()
    print(spin(arguments.roles.split(","), arguments.seconds))


if __name__ == "__main__":
    main()
