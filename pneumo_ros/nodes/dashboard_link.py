# SPDX-License-Identifier: Apache-2.0
"""What the dashboard hears of a running session, and what it may ask of it. The session never waits for it."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterDescriptor, ParameterType
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from pneumo_ros.dashboard.panels import SHOWN, Samples
from pneumo_ros.dashboard.ring import Ring
from pneumo_ros.dashboard.source import Control, Status
from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointDecoder, decode_pressure
from pneumo_ros.log.inspection import Event
from pneumo_ros.nodes.emergency_stop import RESET_SERVICE, TRIP_SERVICE
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.qos import publisher_qos
from pneumo_ros.nodes.spin import SPIN_TIMEOUT, make_executor
from pneumo_ros.parameters import Value
from pneumo_ros.rig import Rig, load_rig, parse_rig

NODE_NAME = "dashboard"
STOP = "emergency stop"
QUIET = 1.5  # s without a sample after which the session is taken to be over or not there
STOP_HEARD = 1.0  # s at most that closing waits for a stop to be acknowledged
ASK_AGAIN = 0.5  # s between requests of a stop that nobody has confirmed
CONFIRMATION = 10.0  # s after which a stop that nobody has confirmed is told
TUNABLE = ("controller", "estimator")
LOOK_PERIOD = 1.0  # s between looks for the parameters of a node that has not answered yet
_ENDING = ("session_complete", "session_stopped", "node_died")
_DEPTH = 50
_NUMBERS = {ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_INTEGER, ParameterType.PARAMETER_BOOL}


class LiveLink:
    """Source and controls of the dashboard for the session on a DDS domain. A context manager.

    Parameters
    ----------
    domain_id : DDS domain, or None for the environment's
    namespace : ROS namespace of the session
    """

    title = "running session"

    def __init__(self, domain_id: int | None = None, namespace: str = "") -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain_id, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node(
            NODE_NAME, context=self._context, namespace=namespace, enable_rosout=False, start_parameter_services=False
        )
        self._rings = {topic.name: Ring(_names(topic)) for topic in SHOWN}
        self._events: deque[Event] = deque(maxlen=1000)
        self._answers: deque[str] = deque(maxlen=100)
        self._controls: dict[str, list[Control]] = {}
        self._clients = {name: AsyncParameterClient(self._node, name) for name in TUNABLE}
        self._rig = load_rig()
        self._start_ns, self._latest_ns, self._heard = 0, 0, 0.0
        self._ended = ""
        self._subscribe()
        self._stop_topic = self._node.create_publisher(
            Bool, topics.ESTOP.relative, publisher_qos(topics.ESTOP.flow, True)
        )
        self._trip = self._node.create_client(Trigger, TRIP_SERVICE)
        self._reset = self._node.create_client(Trigger, RESET_SERVICE)
        self._stop_asked: float | None = None  # monotonic s; None once it is confirmed or given up
        self._node.create_timer(ASK_AGAIN, self._ask_for_stop_again)
        self._node.create_timer(LOOK_PERIOD, self._look_for_parameters)
        self._running = True
        self._thread = threading.Thread(target=self._spin, name="dashboard-link", daemon=True)

    def __enter__(self) -> LiveLink:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._running = False
        self._thread.join()
        # A page that is closed right after its red button was pressed: the stop must have reached who listens.
        self._stop_topic.wait_for_all_acked(Duration(seconds=STOP_HEARD))
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def _spin(self) -> None:
        executor = make_executor("single", self._context)
        executor.add_node(self._node)
        while self._running and self._context.ok():
            executor.spin_once(timeout_sec=SPIN_TIMEOUT)
        executor.shutdown()

    # -- what is heard ---------------------------------------------------------------------------------------------

    def _subscribe(self) -> None:
        # Best effort: a page that cannot keep up loses samples; it must never hold up a reliable publisher.
        stream = QoSProfile(depth=_DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)
        for topic in SHOWN:
            self._node.create_subscription(
                message_class(topic.type), topic.relative, self._taker(topic), stream, raw=True
            )
        latched = QoSProfile(
            depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
        )
        self._node.create_subscription(DiagnosticArray, topics.EVENTS.relative, self._on_events, latched)
        self._node.create_subscription(String, topics.CONFIG.relative, self._on_config, latched)

    def _taker(self, topic: topics.Topic) -> Callable[[bytes], None]:
        ring = self._rings[topic.name]
        read = JointDecoder(topic.name, topic.names).decode if topic.type == topics.JOINT else _read_pressure

        def take(data: bytes) -> None:
            try:
                stamp, values = read(data)
            except InputError as error:
                self._answers.append(str(error))
                return
            ring.append(stamp, values)
            self._note_time(stamp)

        return take

    def _note_time(self, stamp: int) -> None:
        # Stragglers may follow the event that ends a session; the stamps of the next one are far from them.
        if not self._start_ns or abs(stamp - self._latest_ns) > QUIET * 1e9:
            self._start_ns = self._latest_ns = stamp
            self._ended = ""
        self._latest_ns, self._heard = max(stamp, self._latest_ns), time.monotonic()

    def _on_events(self, message: DiagnosticArray) -> None:
        now = self._latest_ns or message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            code = values.pop("code", "")
            level = int.from_bytes(status.level, "little") if isinstance(status.level, bytes) else int(status.level)
            self._events.append(Event(now, level, status.name, code, status.message, values))
            if code in _ENDING:
                self._ended = f"{code}: {status.message}"

    def _on_config(self, message: String) -> None:
        try:
            self._rig = parse_rig(message.data, topics.CONFIG.name)
        except InputError as error:
            self._answers.append(str(error))

    # -- Source ----------------------------------------------------------------------------------------------------

    @property
    def rig(self) -> Rig:
        """As the session publishes it; the nominal one before."""
        return self._rig

    def tick(self, elapsed: float) -> None:
        """Time passes by itself."""

    def status(self) -> Status:
        """Live, waiting for samples, or ended; the last samples stay."""
        if not self._latest_ns:
            return Status("waiting", 0, 0, 0, "no session is heard on this domain yet")
        quiet = time.monotonic() - self._heard > QUIET
        if self._ended and quiet:
            return Status("ended", self._latest_ns, self._start_ns, self._latest_ns, self._ended)
        remark = f"nothing heard for {time.monotonic() - self._heard:.0f} s" if quiet else ""
        return Status("waiting" if quiet else "live", self._latest_ns, self._start_ns, self._latest_ns, remark)

    def window(self, seconds: float) -> Mapping[str, Samples]:
        """The newest ``seconds`` of every topic that has said something."""
        begin = self._latest_ns - round(seconds * 1e9)
        found = {name: ring.since(begin) for name, ring in self._rings.items()}
        return {name: samples for name, samples in found.items() if len(samples.time_ns)}

    def events(self) -> Sequence[Event]:
        """Everything said on /rig/events."""
        return list(self._events)

    # -- Controls --------------------------------------------------------------------------------------------------

    def estop(self) -> None:
        """By topic, which needs no answer, and by service, which gives one; both again until that has come."""
        if not self._trip.service_is_ready():
            self._answers.append(f"{STOP}: sent by topic, no node offers the service yet")
        self._stop_asked = time.monotonic()
        self._ask_for_stop()

    def reset(self) -> None:
        """Ask the owner of the valves to release the stop; it is not asked for again then."""
        self._stop_asked = None
        self._call(self._reset, "release")

    def parameters(self) -> Sequence[Control]:
        """Numbers and switches of controller and estimator that may change live."""
        return [control for name in TUNABLE for control in self._controls.get(name, [])]

    def change(self, node: str, name: str, value: Value) -> None:
        """Set a parameter; the node's own range decides."""
        client = self._clients[node]
        if not client.services_are_ready():
            self._answers.append(f"{node}.{name}: the node is gone")
            return
        label = f"{node}.{name} = {value}"

        def answered(future: Future[Any]) -> None:
            result = future.result().results[0]
            self._answers.append(f"{label}: {'set' if result.successful else 'refused, ' + result.reason}")

        client.set_parameters([Parameter(name, value=value)]).add_done_callback(answered)

    def answers(self) -> list[str]:
        """Since the last call."""
        out = []
        while self._answers:
            out.append(self._answers.popleft())
        return out

    def _ask_for_stop(self) -> None:
        self._stop_topic.publish(Bool(data=True))
        if self._trip.service_is_ready():
            self._trip.call_async(Trigger.Request()).add_done_callback(self._stop_confirmed)

    def _stop_confirmed(self, future: Future[Any]) -> None:
        if self._stop_asked is not None:  # the first answer to one press
            self._stop_asked = None
            self._answers.append(_answer(STOP, future))

    def _ask_for_stop_again(self) -> None:
        """A request or its answer may be lost, or come before the service was found; a stop must not be."""
        if self._stop_asked is None:
            return
        if time.monotonic() - self._stop_asked > CONFIRMATION:
            self._stop_asked = None
            self._answers.append(f"{STOP}: nobody confirmed it within {CONFIRMATION:g} s; look at the valves")
        else:
            self._ask_for_stop()

    def _call(self, client: Any, what: str) -> None:
        if not client.service_is_ready():
            self._answers.append(f"{what}: no node offers the service")
            return
        client.call_async(Trigger.Request()).add_done_callback(lambda f: self._answers.append(_answer(what, f)))

    def _look_for_parameters(self) -> None:
        for name, client in self._clients.items():
            if name not in self._controls and client.services_are_ready():
                self._controls[name] = []
                client.list_parameters().add_done_callback(lambda f, n=name: self._describe(n, f.result().result.names))

    def _describe(self, node: str, names: Sequence[str]) -> None:
        client = self._clients[node]

        def described(future: Future[Any]) -> None:
            kept = [d for d in future.result().descriptors if not d.read_only and d.type in _NUMBERS]
            wanted = [d.name for d in kept if d.name != "use_sim_time"]
            client.get_parameters(wanted).add_done_callback(lambda f: self._keep(node, kept, wanted, f.result().values))

        client.describe_parameters(list(names)).add_done_callback(described)

    def _keep(
        self, node: str, kept: Sequence[ParameterDescriptor], wanted: Sequence[str], values: Sequence[Any]
    ) -> None:
        descriptors = {d.name: d for d in kept}
        self._controls[node] = [
            _control(node, descriptors[name], parameter_value_to_python(value))
            for name, value in zip(wanted, values, strict=True)
        ]


def _answer(what: str, future: Future[Any]) -> str:
    result = future.result()
    return f"{what}: {'done' if result.success else 'refused'}, {result.message}"


def _control(node: str, descriptor: ParameterDescriptor, value: Value) -> Control:
    ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
    low, high = (ranges[0].from_value, ranges[0].to_value) if ranges else (-1e12, 1e12)
    return Control(node, descriptor.name, descriptor.description, value, low, high)


def _names(topic: topics.Topic) -> tuple[str, ...]:
    return topic.names if topic.type == topics.JOINT else topic.names[:1]


def _read_pressure(data: bytes) -> tuple[int, tuple[float, ...]]:
    stamp, value = decode_pressure(data)
    return stamp, (value,)
