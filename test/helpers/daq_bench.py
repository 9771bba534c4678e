# SPDX-License-Identifier: Apache-2.0
"""The hardware node in the test's own process, an emulated board behind a real port, and other nodes beside it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from helpers import emulators
from helpers.serial_rig import CALIBRATION
from pneumo_ros.daq.actuation import Mode
from pneumo_ros.nodes.daq import DaqNode
from pneumo_ros.nodes.emergency_stop import RESET_SERVICE

SUCCESS = TransitionCallbackReturn.SUCCESS
PATIENCE = 40.0  # s; a loaded computer is slow, not wrong
ASK_AGAIN = 5.0  # s without an answer from a service
DAQ = {"mode": "realtime", "autostart": False, "calibration": CALIBRATION, "session_nodes": "daq"}
ORDINARY = QoSProfile(depth=10)


@dataclass
class Bench:
    """A hardware node in this process, and somebody else in another context."""

    link: Path
    domain: int
    node: DaqNode | None = None
    contexts: list[Context] = field(default_factory=list)
    executors: list[Executor] = field(default_factory=list)

    def start(self, domain: int | None = None) -> DaqNode:
        """The node, as after a restart; the others end as well."""
        self.stop()
        self.domain = self.domain if domain is None else domain
        context = self.context()
        self.node = DaqNode(context, {**DAQ, "port": str(self.link)})
        self.spin_with(EventsExecutor(context=context), self.node)
        return self.node

    def stop(self) -> None:
        if self.node is not None:
            self.node.on_stop(self.executors[0])
            self.node.destroy_node()
        self.node = None
        for context in self.contexts:
            context.try_shutdown()
        self.contexts, self.executors = [], []

    def other(self) -> Any:
        """A node of somebody else."""
        context = self.context()
        made = rclpy.create_node("panel", context=context)
        self.spin_with(SingleThreadedExecutor(context=context), made)
        return made

    def context(self) -> Context:
        context = Context()
        rclpy.init(context=context, domain_id=self.domain)
        self.contexts.append(context)
        return context

    def spin_with(self, executor: Executor, node: Any) -> None:
        """The node under test runs on the executor that its program takes."""
        executor.add_node(node)
        self.executors.append(executor)

    def until(self, condition: Callable[[], Any], what: str, seconds: float = PATIENCE) -> None:
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, f"waited {seconds} s for {what}"
            for executor in self.executors:
                executor.spin_once(timeout_sec=0.005)

    def press(self, qos: QoSProfile = ORDINARY, value: bool = True) -> None:
        """A panel that publishes once, as soon as somebody listens, and goes on existing."""
        panel = self.other().create_publisher(Bool, "/rig/estop", qos)
        self.until(lambda: panel.get_subscription_count() > 0, "a subscription that matches")
        # Best effort is what it says: once may be lost while the other side has not yet found the panel.
        for _ in range(1 if qos.reliability == ReliabilityPolicy.RELIABLE else 6):
            panel.publish(Bool(data=value))
            end = time.monotonic() + 0.1
            self.until(lambda: time.monotonic() > end, "the message")  # noqa: B023
        end = time.monotonic() + 0.3
        self.until(lambda: time.monotonic() > end, "the message")

    def call(self, name: str) -> tuple[bool, str]:
        end = time.monotonic() + PATIENCE
        while True:  # DDS matches the two directions of a service one by one: a first answer may find nobody yet
            client = self.other().create_client(Trigger, name)
            self.until(client.service_is_ready, name)
            future, again = client.call_async(Trigger.Request()), time.monotonic() + ASK_AGAIN
            self.until(lambda: future.done() or time.monotonic() > again, "an answer")  # noqa: B023
            if future.done():
                answer: Any = future.result()
                return answer.success, answer.message
            assert time.monotonic() < end, f"no answer from {name}"

    def reset(self) -> None:
        """As a person does it: until the rig is healthy."""
        end = time.monotonic() + PATIENCE
        while not self.call(RESET_SERVICE)[0] and self.node.driver.core.mode is Mode.ESTOP:
            assert time.monotonic() < end, "never healthy enough to reset"

    # -- states ----------------------------------------------------------------------------------------------------

    def configure(self) -> DaqNode:
        node = self.node or self.start()
        if node.state_label == "unconfigured":
            assert node.trigger_configure() is SUCCESS, node.reason
        return node

    def healthy(self) -> DaqNode:
        """Configured, and nothing but a stop would speak against arming."""
        node = self.configure()
        assert node.driver is not None
        core = node.driver.core
        self.until(lambda: core.last is not None, "a sample, which tells the board's state")
        if core.mode is Mode.ESTOP:
            self.reset()  # the board remembers the test before
        self.until(lambda: not core.blockers(time.monotonic_ns()), "a healthy rig")
        return node

    def arm(self) -> DaqNode:
        node = self.healthy()
        self.until(lambda: node.trigger_activate() is SUCCESS, "arming")
        return node

    def assert_stopped(self) -> None:
        """The valves cannot be armed, and the reason is the stop."""
        node = self.node
        assert node is not None
        self.until(lambda: node.operator.latch.found(), "the latch")
        if node.driver is None:
            self.configure()
        assert node.driver is not None and node.driver.core.mode is Mode.ESTOP
        assert node.trigger_activate() is not SUCCESS
        assert "emergency stop" in node.reason and "a person resets it" in node.reason


@contextmanager
def emulator(folder: Path) -> Iterator[tuple[Path, Callable[[], None], Callable[[], None]]]:
    """(link, start, stop) of an emulated rig; started."""
    link = folder / "rig"
    running: list[BaseProcess] = []

    def start() -> None:
        running.append(emulators.started(link, "--calibration", CALIBRATION, "--road", "flat"))

    def stop() -> None:
        while running:
            emulators.ended(running.pop())

    start()
    try:
        yield link, start, stop
    finally:
        stop()
