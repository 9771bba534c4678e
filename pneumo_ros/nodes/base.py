# SPDX-License-Identifier: Apache-2.0
"""What every node of a session shares: declared parameters, readiness, its end, health."""

from __future__ import annotations

import inspect
import os
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import TextIO

import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.parameter import Parameter as RosParameter
from rclpy.timer import Timer
from std_msgs.msg import String

from pneumo_ros.daq.priority import prefer_this_process
from pneumo_ros.errors import InputError
from pneumo_ros.log.topics import DIAGNOSTIC, EVENTS, SETUP
from pneumo_ros.nodes.delivery import DELIVERY_PATIENCE, delivered
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.nodes.readiness import Readiness
from pneumo_ros.nodes.wired import WiredNode
from pneumo_ros.parameters import Parameter, Value
from pneumo_ros.session.supervisor import SUPERVISOR, noted_failure
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
        "executor", "events", "", "events: EventsExecutor; single: SingleThreadedExecutor",
        choices=("events", "single"), read_only=True,
    ),
    Parameter(
        "session_id", "", "", "identity of the session: its nodes listen to each other and to nobody else; empty for "
        "nodes that are started by hand", read_only=True,
    ),
)  # fmt: skip
FAILED = 1  # exit code of a node that ends its session because something is wrong
SAY_AGAIN = 1.0  # s between log lines about events of one code
FAILED_PATIENCE = 2.0  # s to wait for subscribers of a failed session: the one that failed confirms nothing
READY_PERIOD = 0.05  # s between looks at the graph while waiting for subscribers
DIAGNOSTIC_PERIOD = 1.0  # s, REP 107
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


class StopRequest:
    """Asks the spinning loop to end; shared by its nodes.

    ``failed`` says that the session ended because something broke, not because it was over; ``reason`` what.
    """

    def __init__(self) -> None:
        self.set = False
        self.failed = False
        self.reason = ""


class RigNode(WiredNode):
    """A node of the session.

    Parameters
    ----------
    name : node name as in the table of topics
    table : its own parameters; :data:`COMMON` is added
    context : private context, or None for the default one
    overrides : parameter values that win over files and arguments
    owns_time : whether samples get their time here: such a node cannot follow /clock, whatever use_sim_time says
    hand_over : of the nodes of one process; used in lockstep, where every message counts
    """

    def __init__(
        self,
        name: str,
        table: Sequence[Parameter] = (),
        *,
        context: Context | None = None,
        overrides: Mapping[str, Value] | None = None,
        owns_time: bool = False,
        hand_over: HandOver | None = None,
    ) -> None:
        given = {**(overrides or {}), **({"use_sim_time": False} if owns_time else {})}
        super().__init__(
            name,
            context=context,
            parameter_overrides=[RosParameter(key, value=value) for key, value in given.items()],
        )
        self.role, self.owns_time = name, owns_time
        self.table = {p.name: p for p in (*COMMON, *table)}
        self.values = {p.name: self._declare(p) for p in self.table.values()}
        if "daq" in str(self.values["session_nodes"]).split(",") and name != "session_recorder":
            prefer_this_process()  # hardware does not wait for other programs; the recorder may
        self.period_ns = round(1e9 / self.values["rate_hz"])
        self.stop = StopRequest()
        self.exit_code = 0
        self.timing = LoopTiming()
        self._logged: dict[str, float] = {}
        self.wire(hand_over, self._refuse_publisher)
        self._events = self.publisher(EVENTS)
        self._setup = self.publisher(SETUP)
        self._diagnostics = self.publisher(DIAGNOSTIC)
        self.readiness = Readiness(self, name, str(self.values["session_id"]), self._on_other_session)
        self.ready = self.begun = False
        self._ready_timer: Timer = self.steady_timer(READY_PERIOD, self._look_for_subscribers)
        self.steady_timer(DIAGNOSTIC_PERIOD, self._publish_diagnostics)
        self.add_on_set_parameters_callback(self._check_change)
        self.add_post_set_parameters_callback(self._note_change)
        if not self.lockstep:
            # rclpy asks inspect for the place of each line of log; the first time it looks at every module there is,
            # 20 to 90 ms in which a node would neither sample nor command.
            inspect.getframeinfo(sys._getframe())

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
                elif change.name == "use_sim_time" and change.value and self.owns_time:
                    raise InputError("the samples get their time here", where=self.get_name(), key="use_sim_time")
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
        text = yaml.safe_dump({"node": self.role, "time_ns": stamp, "parameters": self.values}, sort_keys=False)
        self._setup.publish(String(data=text))

    # -- the session ---------------------------------------------------------------------------------------------------

    def _refuse_publisher(self, text: str) -> None:
        self.fail("other_publisher", f"{text}; end the other one, or run in another domain or namespace")

    def _on_other_session(self, text: str) -> None:
        # A session that runs goes on: the newcomer hears of it and ends. Its publishers are another matter.
        if not self.begun:
            self.fail("other_session", f"{text}; end it, or use --domain N or --isolate")

    def _look_for_subscribers(self) -> None:
        if not self.ready:
            self._announce()
        elif self.session_nodes <= self.readiness.ready:
            self._ready_timer.cancel()
            self._begin()

    def _announce(self) -> None:
        outgoing = [topic for topic, _ in self._outgoing]
        if not self.readiness.announce(outgoing, [source.topic for source in self.sources]):
            return
        if all(self.readiness.connected(t, made, self.expected_subscribers(t)) for t, made in self._outgoing):
            self.ready = True
            self.publish_setup()
            self.readiness.announce_ready()

    def _begin(self) -> None:
        """Every node is ready: from here on each topic belongs to the publisher that this session announced."""
        self.begun = True
        for source in self.sources:
            if source.topic.publisher:
                source.held = bool(self.values["session_id"])
                source.refuse_other_publisher(self.readiness.publishers(source.topic))
        for shorter in (self.hand_over, self.parcels):
            if shorter is not None:
                shorter.begin(self.steady_timer)
        if not self.stop.set:
            self.on_begin()

    def on_begin(self) -> None:
        """Called once, when every node of the session is ready."""

    def on_stop(self, executor: Executor) -> None:
        """Called when the session ends, after the last callback; what was published is delivered first."""
        if self.parcels is not None:
            self.parcels.send_log()
        patience = FAILED_PATIENCE if self.stop.failed else DELIVERY_PATIENCE
        if not delivered((made for _, made in self._outgoing), patience):
            self.get_logger().warning(f"not every subscriber confirmed the last messages within {patience:g} s")

    def fail(self, code: str, text: str) -> None:
        """End the session because of ``text``; said once."""
        if self.stop.set:
            return
        self.event(ERROR, code, text)
        say(f"error: {text}", sys.stderr)
        self.exit_code, self.stop.reason = FAILED, text
        self.stop.failed = self.stop.set = True

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
        self._diagnostics.publish(self._array(level, f"{self.role}: loop", message, self.health()))

    def _end_if_alone(self) -> None:
        """A node must not drive valves for a session whose supervisor was killed."""
        supervisor = os.environ.get(SUPERVISOR)
        if supervisor and os.getppid() != int(supervisor):
            self.fail("supervisor_gone", "the session's supervisor was killed")

    def event(self, level: bytes, code: str, message: str, values: Mapping[str, str] | None = None) -> None:
        """Publish an event; ``code`` is its reason code. What the log has to say before it is sent before it."""
        if self.parcels is not None:
            self.parcels.send_log()
        self._events.publish(self._array(level, self.role, message, {"code": code, **(values or {})}))
        self._log(level, code, message)

    def _log(self, level: bytes, code: str, message: str) -> None:
        """To the console and /rosout as well, once a second and code at most."""
        now = time.monotonic()
        if now - self._logged.get(code, -SAY_AGAIN) < SAY_AGAIN:
            return
        self._logged[code] = now
        logger = self.get_logger()
        # One call a level: rclpy refuses a place in the code that changes its severity.
        if level == ERROR:
            logger.error(f"{code}: {message}")
        elif level == WARN:
            logger.warning(f"{code}: {message}")
        else:
            logger.info(f"{code}: {message}")

    def _array(self, level: bytes, name: str, message: str, values: Mapping[str, str]) -> DiagnosticArray:
        status = DiagnosticStatus(level=level, name=name, message=message, hardware_id=self.hardware_id)
        status.values = [KeyValue(key=key, value=value) for key, value in values.items()]
        out = DiagnosticArray(status=[status])
        out.header.stamp = self.get_clock().now().to_msg()
        return out


def say(line: str, stream: TextIO | None = None) -> None:
    """Print a line; a supervisor or terminal that has gone is no reason to stop driving valves in order."""
    with suppress(OSError, ValueError):
        print(line, file=stream or sys.stdout, flush=True)


def tell_end(node: RigNode, elapsed: float, values: Mapping[str, str] | None = None) -> None:
    """Of the node that is the rig, when it is stopped from outside: the recorder writes it into the log.

    A session without a duration is over when it is stopped; one with a duration was cut short.
    """
    duration, failure = float(node.values["duration"]), noted_failure() or node.stop.reason
    if duration or failure:
        length, why = f" of {duration:g} s" if duration else "", f": {failure}" if failure else ""
        node.event(WARN, "session_stopped", f"cut short after {elapsed:.3f} s{length}{why}", values)
    else:
        node.event(OK, "session_complete", f"stopped by the user after {elapsed:.3f} s", values)


def node_parameters(table: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """The complete parameter table of a node."""
    return (*COMMON, *table)
