# SPDX-License-Identifier: Apache-2.0
"""Whose commands the valves follow: one publisher's, for samples that were published; all else trips or is refused."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")
from helpers import sessions
from helpers.daq_bench import Bench, emulator
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState

from pneumo_ros.daq.actuation import Mode
from pneumo_ros.daq.reasons import Reason
from pneumo_ros.log.topics import COMMAND

OPEN = [5e-6, 5e-6, 0.0, 0.0]  # m2

pytestmark = [pytest.mark.realtime, pytest.mark.slow]


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with emulator(tmp_path) as (link, _, _):
        made = Bench(link, sessions.own_domain())
        yield made
        made.stop()


def speaker(bench: Bench) -> Any:
    """Somebody who publishes commands, and hears the samples."""
    node = bench.other()
    node.heard = []
    node.create_subscription(JointState, "/rig/displacement", node.heard.append, QoSProfile(depth=1))
    node.commands = node.create_publisher(JointState, "/valve/command", 10)
    return node


def command(stamp: Any) -> JointState:
    message = JointState(name=list(COMMAND.names), position=OPEN)
    message.header.stamp = stamp
    return message


TRIES = 6  # armings that a stall of this computer may trip before the scenario


def test_a_second_voice_trips_armed_valves_and_is_not_obeyed(bench: Bench) -> None:
    bench.start()
    first = speaker(bench)
    node = bench.healthy()
    bench.until(lambda: node.commands.count == 1, "the first publisher")
    assert node.driver is not None
    core = node.driver.core
    for _ in range(TRIES):
        bench.arm()
        second = speaker(bench)
        bench.until(lambda: core.mode is Mode.SAFE and node.commands.count == 2, "the trip")
        if core.trip is not None and core.trip.reason is Reason.COMMAND_FOREIGN:
            break
        second.destroy_publisher(second.commands)
        bench.until(lambda: node.commands.count == 1 and node.state_label == "inactive", "the second to leave")
    assert core.trip is not None and "2 nodes publish /valve/command" in core.trip.message, core.trip
    assert any("2 nodes" in why for why in node.blockers())
    second.commands.publish(command(second.get_clock().now().to_msg()))
    second.destroy_publisher(second.commands)
    bench.until(lambda: node.commands.count == 1, "the second to leave")
    assert node.commands.bound and not any("nodes publish" in why for why in node.blockers())
    assert core.actuation.areas == node.safety.safe_command
    assert first.commands.get_subscription_count() == 1


def test_a_command_for_no_sample_of_this_rig_is_not_obeyed(bench: Bench) -> None:
    bench.start()
    one = speaker(bench)
    node = bench.arm()
    assert node.driver is not None
    passed: list[int] = []
    forward = node.driver.command

    def command_to(areas: Any, stamp: int) -> None:
        passed.append(stamp)
        forward(areas, stamp)

    node.driver.command = command_to  # type: ignore[method-assign]
    bench.until(lambda: one.heard, "a sample")
    wrong = one.heard[-1].header.stamp
    wrong.nanosec += 1
    count = len(node.timing._marks) + node.timing.count
    one.commands.publish(command(wrong))
    bench.until(lambda: len(node.timing._marks) + node.timing.count > count, "the command to arrive")
    assert passed == [], "a stamp that is nobody's"

    def answer() -> bool:
        if one.heard:
            one.commands.publish(command(one.heard.pop().header.stamp))
        return bool(passed)

    bench.until(answer, "one of its own samples to be answered")
