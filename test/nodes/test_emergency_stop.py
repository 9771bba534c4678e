# SPDX-License-Identifier: Apache-2.0
"""Emergency stop of the hardware: states by events, with real publishers, a real port and an emulated board.

Whatever the state, whoever presses and however the publisher is made: nothing is armed until a person resets it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
from helpers import sessions
from helpers.daq_bench import DAQ, ORDINARY, Bench, emulator
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool

from pneumo_ros.daq.actuation import Mode
from pneumo_ros.nodes import dashboard_link
from pneumo_ros.nodes.daq import DaqNode
from pneumo_ros.nodes.dashboard_link import LiveLink
from pneumo_ros.nodes.emergency_stop import RESET_SERVICE, TRIP_SERVICE

pytestmark = pytest.mark.slow
QOS = {
    f"{reliability.name.lower()}, {durability.name.lower()}": QoSProfile(
        depth=1, reliability=reliability, durability=durability
    )
    for reliability in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT)
    for durability in (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL)
}


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Callable[[], None], Callable[[], None]]]:
    with emulator(tmp_path_factory.mktemp("rig")) as made:
        yield made


@pytest.fixture
def bench(rig: tuple[Path, Callable[[], None], Callable[[], None]]) -> Iterator[Bench]:
    made = Bench(rig[0], sessions.own_domain())
    yield made
    made.stop()


# -- before configure, with publishers of every quality of service ---------------------------------------------------


@pytest.mark.parametrize("qos", QOS.values(), ids=QOS)
def test_unconfigured_stop_by_any_publisher(bench: Bench, qos: QoSProfile) -> None:
    node = bench.start()
    bench.press(qos)
    bench.until(lambda: node.operator.latch.found(), "the latch")
    assert node.state_label == "unconfigured"


def test_unconfigured_stop_keeps_it_from_arming_until_a_reset(bench: Bench) -> None:
    bench.start()
    bench.press()
    bench.assert_stopped()
    bench.reset()
    assert bench.arm().state_label == "active"


def test_unconfigured_stop_by_service(bench: Bench) -> None:
    node = bench.start()
    assert bench.call(TRIP_SERVICE)[0]
    assert node.operator.latch.found().startswith("by service")
    assert not bench.call(RESET_SERVICE)[0], "nobody knows the rig's state"


def test_a_panel_that_pressed_before_the_node_came_is_heard(bench: Bench) -> None:
    panel = bench.other().create_publisher(Bool, "/rig/estop", QOS["reliable, transient_local"])
    panel.publish(Bool(data=True))
    context = bench.context()
    node = bench.node = DaqNode(context, {**DAQ, "port": str(bench.link)})
    bench.spin_with(EventsExecutor(context=context), node)
    bench.until(lambda: node.operator.latch.found(), "the latch")


# -- inactive, arming, armed, stopped ----------------------------------------------------------------------------------


@pytest.mark.parametrize("qos", QOS.values(), ids=QOS)
def test_inactive_stop_by_any_publisher(bench: Bench, qos: QoSProfile) -> None:
    bench.healthy()
    bench.press(qos)
    bench.assert_stopped()


def test_stop_during_arming(bench: Bench) -> None:
    node = bench.healthy()
    panel = bench.other().create_publisher(Bool, "/rig/estop", ORDINARY)
    bench.until(lambda: panel.get_subscription_count() > 0, "a subscription that matches")
    assert node.driver is not None
    panel.publish(Bool(data=True))
    node.trigger_activate()  # blocks until the board has followed; the stop waits in the queue
    bench.until(lambda: node.driver is not None and node.driver.core.mode is Mode.ESTOP, "the stop")
    bench.until(lambda: node.state_label == "inactive", "the node to leave active by itself")
    bench.assert_stopped()


def test_armed_stop_closes_the_valves(bench: Bench) -> None:
    node = bench.arm()
    bench.press()
    assert node.driver is not None and node.driver.core.mode is Mode.ESTOP
    bench.until(lambda: node.state_label == "inactive", "the node to leave active by itself")
    bench.assert_stopped()


def test_false_and_another_nodes_false_release_nothing(bench: Bench) -> None:
    bench.healthy()
    bench.press()
    bench.press(value=False)
    bench.assert_stopped()


def test_released_twice(bench: Bench) -> None:
    bench.healthy()
    bench.press()
    bench.assert_stopped()
    bench.reset()
    done, why = bench.call(RESET_SERVICE)
    assert not done and "there is no emergency stop" in why


# -- reconnecting ------------------------------------------------------------------------------------------------------


def test_stop_while_the_line_is_down(tmp_path: Path) -> None:
    with emulator(tmp_path) as (link, start, stop):
        bench = Bench(link, sessions.own_domain())
        try:
            node = bench.healthy()
            driver = node.driver
            assert driver is not None
            stop()
            bench.until(lambda: not driver.running, "the line to go down")
            bench.press()
            start()
            bench.until(lambda: driver.running, "the line to come up")
            bench.assert_stopped()
            bench.reset()
        finally:
            bench.stop()


# -- restarts ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("configured", [False, True], ids=["unconfigured", "inactive"])
def test_it_is_kept_over_a_restart_of_the_node(bench: Bench, configured: bool) -> None:
    if configured:
        bench.healthy()
    else:
        bench.start()
    bench.press()
    bench.start()
    bench.assert_stopped()
    bench.reset()
    bench.start()
    assert bench.arm().state_label == "active", "a reset is kept as well"


def test_the_same_board_in_another_domain_is_still_stopped(bench: Bench) -> None:
    bench.healthy()
    bench.press()
    node = bench.start(sessions.own_domain())
    assert node.operator.latch.found() == "", "nobody has pressed here"
    bench.configure()
    bench.assert_stopped()


# -- the dashboard -----------------------------------------------------------------------------------------------------


def test_a_dashboard_that_is_closed_in_the_middle_leaves_the_stop(bench: Bench) -> None:
    node = bench.healthy()
    with LiveLink(bench.domain) as link:
        bench.until(lambda: link._stop_topic.get_subscription_count() > 0, "the dashboard to be heard")
        assert node.operator.latch.found() == "", "looking stops nothing"
        link.estop()
    bench.until(lambda: node.operator.latch.found(), "the latch")
    bench.assert_stopped()


def test_a_dashboard_that_was_pressed_before_there_was_a_service_gets_its_answer(bench: Bench) -> None:
    """A press is asked for until it is confirmed, and told when nobody does."""
    said: list[str] = []

    def heard(what: str) -> bool:
        said.extend(link.answers())
        return any(what in one for one in said)

    with LiveLink(bench.domain) as link:
        link.estop()
        assert heard("emergency stop: sent by topic, no node offers the service yet")
        node = bench.start()
        bench.until(lambda: heard("emergency stop: done"), "the confirmation")
        assert node.operator.latch.found()
        assert [one for one in said if "done" in one] == said[1:], "one press, one answer"


def test_a_stop_that_nobody_confirms_is_told(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dashboard_link, "CONFIRMATION", 1.0)
    said: list[str] = []
    with LiveLink(bench.domain) as link:
        link.estop()
        bench.until(lambda: said.extend(link.answers()) or any("nobody confirmed" in one for one in said), "the word")
    assert "look at the valves" in said[-1]
