# SPDX-License-Identifier: Apache-2.0
"""What every node of a session shares: declared parameters, topics from the table, readiness, health."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from std_msgs.msg import String

from pneumo_ros.daq.priority import prefer_this_process
from pneumo_ros.errors import InputError
from pneumo_ros.log.topics import DIAGNOSTIC, EVENTS, READY, SETUP, TOPICS, Topic
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.qos import overriding, publisher_qos, refused_overrides, subscriber_qos
from pneumo_ros.parameters import Parameter, Value
from pneumo_ros.session.supervisor import SUPERVISOR
from pneumo_ros.session.timing import LoopTiming

SESSION_NODES = "road_profile,plant,estimator,controller,session_recorder"
COMMON: tuple[Parameter, ...] = (
    Parameter(
        "mode", "lockstep", "", "lockstep: a period passes when its command is in; realtime: absolute deadlines",
        choices=("lockstep", "realtime"), read_only=True,
    ),
    Parameter("rate_hz", 500.0, "Hz", "control rate", 50.0, 2000.0, read_only=True),
    Parameter("rig", "", "", "rig file (YAML); empty for the nominal rig", read_only=True),
    Parameter(
        "session_nodes", SESSION_NODES, "",
        "nodes of the session, comma separated; each waits for the others' subscriptions before the first sample",
        read_only=True,
    ),
    Parameter(
        "executor", "events", "", "events: EventsExecutor through spin_once; single: SingleThreadedExecutor",
        choices=("events", "single"), read_only=True,
    ),
)  # fmt: skip
ACK_TIMEOUT = 2.0  # s to wait for subscribers to confirm what was published
READY_PERIOD = 0.05  # s between looks at the graph while waiting for subscribers
DIAGNOSTIC_PERIOD = 1.0  # s, REP 107
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


class StopRequest:
    """Asks the spinning loop to end; shared by its nodes.

    ``failed`` says that the session ended because something broke, not because it was over.
    """

    def __init__(self) -> None:
        self.set = False
        self.failed = False


class RigNode(Node):
    """A node of the session.

    Parameters
    ----------
    name : node name as in the table of topics
    table : its own parameters; :data:`COMMON` is added
    context : private context, or None for the default one
    overrides : parameter values that win over files and arguments
    """

    def __init__(
        self,
        name: str,
        table: Sequence[Parameter] = (),
        *,
        context: Context | None = None,
        overrides: Mapping[str, Value] | None = None,
    ) -> None:
        super().__init__(
            name,
            context=context,
            enable_rosout=False,
            parameter_overrides=[RosParameter(key, value=value) for key, value in (overrides or {}).items()],
        )
        self.table = {p.name: p for p in (*COMMON, *table)}
        self.values: dict[str, Any] = {p.name: self._declare(p) for p in self.table.values()}
        self.lockstep = self.values["mode"] == "lockstep"
        if "daq" in str(self.values["session_nodes"]).split(",") and name != "session_recorder":
            prefer_this_process()  # hardware does not wait for other programs; the recorder may
        self.period_ns = round(1e9 / self.values["rate_hz"])
        self.stop = StopRequest()
        self.exit_code = 0
        self.timing = LoopTiming()
        self._outgoing: list[tuple[Topic, Publisher]] = []
        self._events = self.publisher(EVENTS)
        self._setup = self.publisher(SETUP)
        self._diagnostics = self.publisher(DIAGNOSTIC)
        self._ready = self.publisher(READY)
        self.ready = False
        self._ready_timer: Timer = self.create_timer(READY_PERIOD, self._look_for_subscribers)
        self.create_timer(DIAGNOSTIC_PERIOD, self._publish_diagnostics)
        self.add_on_set_parameters_callback(self._check_change)
        self.add_post_set_parameters_callback(self._note_change)

    # -- parameters ------------------------------------------------------------------------------------------------

    def _declare(self, spec: Parameter) -> Value:
        descriptor = ParameterDescriptor(
            description=f"{spec.description} [{spec.unit}]" if spec.unit else spec.description,
            additional_constraints=spec.allowed,
            read_only=spec.read_only,
        )
        if isinstance(spec.default, float):
            descriptor.floating_point_range = [FloatingPointRange(from_value=spec.low, to_value=spec.high)]
        elif isinstance(spec.default, int) and not isinstance(spec.default, bool):
            descriptor.integer_range = [IntegerRange(from_value=int(spec.low), to_value=int(spec.high))]
        return spec.checked(self.declare_parameter(spec.name, spec.default, descriptor).value, self.get_name())

    def _check_change(self, changes: list[RosParameter]) -> SetParametersResult:
        try:
            for change in changes:
                if change.name in self.table:
                    self.table[change.name].checked(change.value, self.get_name())
        except InputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _note_change(self, changes: list[RosParameter]) -> None:
        ours = {c.name: c.value for c in changes if c.name in self.table}
        if not ours:
            return
        self.values.update(ours)
        self.event(OK, "parameter_changed", f"{', '.join(ours)} changed", {k: str(v) for k, v in ours.items()})
        self.publish_setup()
        self.on_parameters(ours)

    def on_parameters(self, changed: Mapping[str, Value]) -> None:
        """Called after a live change; nodes that can change override it."""

    def publish_setup(self) -> None:
        """Say on /rig/setup which parameters this node runs with."""
        stamp = self.get_clock().now().nanoseconds
        text = yaml.safe_dump({"node": self.get_name(), "time_ns": stamp, "parameters": self.values}, sort_keys=False)
        self._setup.publish(String(data=text))

    # -- topics ----------------------------------------------------------------------------------------------------

    def create_publisher(self, *args: Any, **options: Any) -> Publisher:
        """As rclpy's; the quality of service can be overridden by parameters."""
        if not hasattr(self, "lockstep"):  # rclpy's own, while the node is being made
            return super().create_publisher(*args, **options)
        options.setdefault("qos_overriding_options", overriding(self.lockstep))
        with refused_overrides(self.get_name(), args[1]):
            return super().create_publisher(*args, **options)

    def create_subscription(self, *args: Any, **options: Any) -> Subscription:
        """As rclpy's; the quality of service can be overridden by parameters."""
        if not hasattr(self, "lockstep"):
            return super().create_subscription(*args, **options)
        options.setdefault("qos_overriding_options", overriding(self.lockstep))
        with refused_overrides(self.get_name(), args[1]):
            return super().create_subscription(*args, **options)

    def publisher(self, topic: Topic) -> Publisher:
        """Create the publisher of a topic of the table."""
        made = self.create_publisher(message_class(topic.type), topic.name, publisher_qos(topic.flow, self.lockstep))
        self._outgoing.append((topic, made))
        return made

    def subscribe(self, topic: Topic, callback: Callable[[bytes], None]) -> None:
        """Receive a topic of the table as serialised bytes."""
        qos = subscriber_qos(topic.flow, self.lockstep)
        self.create_subscription(message_class(topic.type), topic.name, callback, qos, raw=True)

    def ready_qos(self) -> QoSProfile:
        """Of /rig/ready, for the node that waits for the others."""
        return publisher_qos(READY.flow, self.lockstep)

    def expected_subscribers(self, topic: Topic) -> set[str]:
        """Names of the session's nodes that take ``topic``."""
        takers = {*topic.subscribers, *(("session_recorder",) if topic.recorded else ())}
        return takers & set(str(self.values["session_nodes"]).split(",")) - {self.get_name()}

    def _look_for_subscribers(self) -> None:
        for topic, made in self._outgoing:
            wanted = self.expected_subscribers(topic)
            there = self.get_subscriptions_info_by_topic(topic.name)
            if not wanted <= {info.node_name for info in there} or made.get_subscription_count() < len(wanted):
                return
        self.ready = True
        self._ready_timer.cancel()
        self.publish_setup()
        self._ready.publish(String(data=self.get_name()))
        self.on_ready()

    def on_ready(self) -> None:
        """Called once, when every publisher has its subscribers."""

    def on_stop(self, executor: Executor) -> None:
        """Called when the session ends, after the last callback; what was published is delivered first."""
        for _, made in self._outgoing:
            made.wait_for_all_acked(Duration(seconds=ACK_TIMEOUT))

    # -- health ----------------------------------------------------------------------------------------------------

    @property
    def hardware_id(self) -> str:
        """Which rig a status is about (REP 107): the rig's name, where a node knows no closer one."""
        rig = getattr(self, "rig", None)
        return str(rig.name) if rig is not None else str(self.values["rig"]) or "half-car-rig"

    def timed(self, start_ns: int) -> None:
        """Account for one step that began at ``start_ns`` (monotonic) and ends now."""
        self.timing.mark(start_ns, time.monotonic_ns())

    def health(self) -> dict[str, str]:
        """Key figures of /diagnostics; nodes add theirs."""
        return self.timing.summary()

    def health_level(self) -> tuple[bytes, str]:
        """(level, message) of /diagnostics."""
        return OK, "running" if self.ready else "waiting for the session"

    def _publish_diagnostics(self) -> None:
        self._end_if_alone()
        level, message = self.health_level()
        self._diagnostics.publish(self._array(level, f"{self.get_name()}: loop", message, self.health()))

    def _end_if_alone(self) -> None:
        """A node must not drive valves for a session whose supervisor was killed."""
        supervisor = os.environ.get(SUPERVISOR)
        if supervisor and os.getppid() != int(supervisor):
            self.stop.failed = self.stop.set = True

    def event(self, level: bytes, code: str, message: str, values: Mapping[str, str] | None = None) -> None:
        """Publish an event; ``code`` is its reason code."""
        self._events.publish(self._array(level, self.get_name(), message, {"code": code, **(values or {})}))

    def _array(self, level: bytes, name: str, message: str, values: Mapping[str, str]) -> DiagnosticArray:
        status = DiagnosticStatus(level=level, name=name, message=message, hardware_id=self.hardware_id)
        status.values = [KeyValue(key=key, value=value) for key, value in values.items()]
        out = DiagnosticArray(status=[status])
        out.header.stamp = self.get_clock().now().to_msg()
        return out


def node_parameters(table: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """The complete parameter table of a node."""
    return (*COMMON, *table)


def all_topics_of(name: str) -> list[Topic]:
    """Topics of the table that a node publishes."""
    return [topic for topic in TOPICS if topic.publisher == name]
