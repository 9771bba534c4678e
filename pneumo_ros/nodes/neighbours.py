# SPDX-License-Identifier: Apache-2.0
"""Find a place in the ROS graph for a session: where nobody else publishes what its nodes publish."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String

from pneumo_ros.errors import InputError
from pneumo_ros.log.topics import CLOCK, EVERY_PERIOD, READY
from pneumo_ros.nodes.qos import publisher_qos
from pneumo_ros.nodes.sources import NAMELESS, NAMING, node_of
from pneumo_ros.session.claim import Claim, taken

# s. On one computer five looks of six see a publisher within 0.1 s; the sixth waits up to 3 s for an announcement.
# Valves are worth the wait; in a simulation a publisher that was missed ends the session at its first message.
LOOK_FOR = 0.5
LOOK_FOR_BEFORE_VALVES = 3.2
STEP = 0.02  # s
ISOLATED = range(1, 101)  # domains to isolate a session in; higher ones reach the ephemeral ports
OWNED = (READY, CLOCK, *EVERY_PERIOD)
"""What only a session's nodes publish."""


def claim_place(domain: int | None, namespace: str, isolate: bool, what: str, valves: bool = False) -> Claim:
    """Take a place where this session is alone.

    Parameters
    ----------
    domain : DDS domain, None for the environment's
    namespace : '' or of the form /rig1
    isolate : take a free domain instead
    what : words about the session
    valves : it drives real ones

    Raises
    ------
    InputError
        naming who is there.
    """
    look_for = LOOK_FOR_BEFORE_VALVES if valves else LOOK_FOR
    if not isolate:
        return _claim(environment_domain() if domain is None else domain, namespace, what, look_for)
    first = os.getpid() % len(ISOLATED)
    for candidate in (*ISOLATED[first:], *ISOLATED[:first]):
        try:
            return _claim(candidate, namespace, what, look_for)
        except InputError:
            continue
    raise InputError("no free domain", where="--isolate", allowed=f"{ISOLATED[0]} to {ISOLATED[-1]}",
                     remedy="end a session")  # fmt: skip


def environment_domain() -> int:
    """The DDS domain that ROS_DOMAIN_ID asks for."""
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not text.isdigit() or int(text) > 232:
        raise InputError("not a DDS domain", where="environment", key="ROS_DOMAIN_ID", value=text, allowed="0 to 232")
    return int(text)


def _claim(domain: int, namespace: str, what: str, look_for: float) -> Claim:
    claim = Claim(domain, namespace, what)
    try:
        found = neighbours(domain, namespace, look_for)
        if found:
            raise taken(domain, namespace, "; ".join(found))
    except BaseException:
        claim.release()
        raise
    return claim


def neighbours(domain: int, namespace: str, look_for: float) -> list[str]:
    """Who publishes what a session's nodes would: a sentence for each that was seen within so many s."""
    context = Context()
    rclpy.init(context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node(
            "newcomer", context=context, namespace=namespace, enable_rosout=False, start_parameter_services=False
        )
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        sessions: set[str] = set()
        qos = publisher_qos(READY.flow, lockstep=True)
        node.create_subscription(String, READY.relative, lambda message: sessions.add(_session(message.data)), qos)
        end = time.monotonic() + look_for
        while time.monotonic() < end:
            executor.spin_once(timeout_sec=STEP)
        end += NAMING
        while NAMELESS in {name for _, name in _publishers(node)} and time.monotonic() < end:
            executor.spin_once(timeout_sec=STEP)
        found = sorted({f"{publisher} publishes {topic}" for topic, publisher in _publishers(node)})
        executor.shutdown()
        node.destroy_node()
    finally:
        rclpy.try_shutdown(context=context)
    return [f"session {one}" for one in sorted(sessions - {""})] + found[:3]


def _publishers(node: Node) -> Iterable[tuple[str, str]]:
    for topic in OWNED:
        name = node.resolve_topic_name(topic.relative)
        for info in node.get_publishers_info_by_topic(topic.relative):
            yield name, node_of(info)


def _session(data: str) -> str:
    try:
        return str(json.loads(data)["session"])
    except (ValueError, TypeError, KeyError):
        return ""
