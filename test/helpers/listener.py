# SPDX-License-Identifier: Apache-2.0
"""A program beside a session that listens to what goes out every period, with the session's settings of the middleware.

Its own process: Fast DDS reads its profiles once, and other tests have made their nodes by then.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor

from helpers.sessions import own_context
from pneumo_ros.log import topics
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.qos import recorder_qos
from pneumo_ros.session.middleware import middleware_settings

LIMIT = 60.0  # s of listening


def listen(domain: int, least: int) -> dict[str, list[bytes]]:
    """Topic -> the messages that a program of its own heard, ``least`` of each or what came in :data:`LIMIT`."""
    command = [sys.executable, "-m", __name__, str(domain), str(least)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run(command, env=environment | middleware_settings(environment),
                          stdout=subprocess.PIPE, timeout=2 * LIMIT, check=True)  # fmt: skip
    heard: dict[str, list[bytes]] = pickle.loads(done.stdout)
    return heard


def main(domain: int, least: int) -> None:
    heard: dict[str, list[bytes]] = {topic.name: [] for topic in topics.EVERY_PERIOD}
    with own_context(domain) as context:
        node = rclpy.create_node("listener", context=context)
        for topic in topics.EVERY_PERIOD:
            qos, take = recorder_qos(topic.flow), heard[topic.name].append
            node.create_subscription(message_class(topic.type), topic.name, take, qos, raw=True)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        end = time.monotonic() + LIMIT
        while min(map(len, heard.values())) < least and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.1)
        executor.shutdown()
    sys.stdout.buffer.write(pickle.dumps(heard))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
