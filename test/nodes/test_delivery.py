# SPDX-License-Identifier: Apache-2.0
"""The last message of a node that ends, to a subscriber in another process that is held up meanwhile."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

from helpers import sessions

from pneumo_ros.session.middleware import FAST_DDS_PROFILES, middleware_settings

LISTENER = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
rclpy.init()
node = Node("listener")
kept = [node.create_subscription(String, topic, lambda _: None, 10) for topic in ("/one", "/two")]
rclpy.spin(node)
"""

TALKER = """
import glob, json, os, signal, subprocess, sys, time
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from pneumo_ros.nodes.delivery import delivered
listener, held = int(sys.argv[1]), float(sys.argv[2])
rclpy.init()
node = Node("talker")
made = [node.create_publisher(String, topic, 10) for topic in ("/one", "/two")]
while not all(one.get_subscription_count() for one in made):
    time.sleep(0.02)
os.kill(listener, signal.SIGSTOP)
while any(") T " not in open(path).read() for path in glob.glob(f"/proc/{listener}/task/*/stat")):
    time.sleep(0.01)  # a thread that still runs would confirm
for one in made:
    one.publish(String(data="the end"))
began = time.monotonic()
early = delivered(made, patience=2.0)
lost = time.monotonic() - began
subprocess.Popen(["sh", "-c", f"sleep {held}; kill -CONT {listener}"])  # the wait holds this interpreter
began = time.monotonic()
print(json.dumps([early, lost, delivered(made), time.monotonic() - began]))
"""


def test_a_subscriber_that_was_held_up_gets_the_last_message_once_it_goes_on() -> None:
    environment = sessions.environment() | {"ROS_DOMAIN_ID": str(sessions.own_domain())}
    environment |= middleware_settings(environment)
    listener = subprocess.Popen([sys.executable, "-c", LISTENER], env=environment)
    try:
        done = subprocess.run([sys.executable, "-c", TALKER, str(listener.pid), "2.5"], env=environment,
                              capture_output=True, text=True, timeout=60)  # fmt: skip
    finally:
        os.kill(listener.pid, signal.SIGCONT)
        listener.kill()
        listener.wait()
    early, lost, late, took = json.loads(done.stdout)
    assert not early and 2.0 <= lost < 3.9, f"the patience is for all publishers together, it took {lost} s"
    assert late and 2.5 <= took < 5.0, "with the middleware's own heartbeat it takes 6 s"


def test_what_the_user_told_the_middleware_stays() -> None:
    own = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", FAST_DDS_PROFILES: "/mine.xml"}
    assert middleware_settings(own) == {}
    for discovery in ("LOCALHOST", "SUBNET"):
        assert Path(middleware_settings({}, discovery)[FAST_DDS_PROFILES]).is_file()
    peers = middleware_settings({"ROS_STATIC_PEERS": "192.0.2.7"})
    assert peers == middleware_settings({}, "SUBNET") | {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


LISTENS = """
import glob, os
import rclpy
from rclpy.node import Node
rclpy.init()
node = Node("listens")
own = {os.readlink(entry) for entry in glob.glob("/proc/self/fd/*") if os.path.islink(entry)}
rows = [line.split() for line in open("/proc/net/udp").read().splitlines()[1:]]
print(" ".join(row[1] for row in rows if f"socket:[{row[9]}]" in own))
"""
LOOPBACK = "0100007F"


def heard_by(discovery: str) -> tuple[set[str], int]:
    """Addresses, in hexadecimal, at which a node takes messages of its domain, and how many sockets that are."""
    domain = sessions.own_domain()
    environment = {**sessions.environment(), "ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": discovery}
    done = subprocess.run([sys.executable, "-c", LISTENS], env=environment | middleware_settings(environment),
                          capture_output=True, text=True, timeout=60, check=True)  # fmt: skip
    ports = range(7400 + 250 * domain, 7650 + 250 * domain)  # of a domain, by the RTPS specification
    found = [place.split(":") for place in done.stdout.split()]
    heard = [address for address, port in found if int(port, 16) in ports]
    return set(heard), len(heard)


def test_a_session_that_stays_on_this_computer_takes_nothing_from_the_network() -> None:
    """With a range of LOCALHOST alone a node's sockets are as open as with SUBNET."""
    addresses, count = heard_by("LOCALHOST")
    assert addresses == {LOOPBACK} and count >= 2
    assert "00000000" in heard_by("SUBNET")[0], "who wants the network has it"
