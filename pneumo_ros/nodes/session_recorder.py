# SPDX-License-Identifier: Apache-2.0
"""Record every topic of the session as it was sent: raw CDR, written by a thread of its own."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from datetime import datetime, timezone
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterEvent
from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.serialization import deserialize_message

from pneumo_ros.errors import InputError
from pneumo_ros.log.provenance import versions
from pneumo_ros.log.topics import APPLIED, EVENTS, EVERY_PERIOD, JOINT, PRESSURE, TOPICS, Topic
from pneumo_ros.log.writing import AT_LATEST, AT_STAMP, Channel, LogWriter, Written
from pneumo_ros.nodes.base import ERROR, WARN, RigNode
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.nodes.interfaces import message_class
from pneumo_ros.nodes.qos import publisher_qos, recorder_qos, rosbag2_qos
from pneumo_ros.nodes.spin import node_main
from pneumo_ros.parameters import Parameter, Value
from pneumo_ros.session.ending import RIG_NODES, Ending
from pneumo_ros.session.supervisor import noted_failure

DRAIN_LIMIT = 5.0  # s
WATCH_PERIOD = 0.1  # s between looks whether the stamps written are in order
QUIET_PERIOD = 0.3  # s without a message after which everything sent has arrived
PARAMETER_EVENTS = Topic("/parameter_events", "rcl_interfaces/msg/ParameterEvent", "every parameter change", "")
STAMPED = (JOINT, PRESSURE)  # types whose header says which sample they are of
PARAMETERS: tuple[Parameter, ...] = (
    Parameter("output", "session.mcap", "", "log file to write (.mcap)", read_only=True),
    Parameter("session", "{}", "", "what else explains the run, a JSON object of texts", read_only=True),
)


class SessionRecorderNode(RigNode):
    """Thin shell over :mod:`pneumo_ros.log.writing`."""

    takes_at_once = True

    def __init__(
        self,
        context: Context | None = None,
        overrides: Mapping[str, Value] | None = None,
        hand_over: HandOver | None = None,
    ) -> None:
        super().__init__("session_recorder", PARAMETERS, context=context, overrides=overrides, hand_over=hand_over)
        self.writer = LogWriter(Path(self.values["output"]), self._metadata())
        self.written: Written | None = None
        self._warned = False
        self.ending = Ending()
        for topic in (*(t for t in TOPICS if t.recorded), PARAMETER_EVENTS):
            self._record(topic)
        self.steady_timer(WATCH_PERIOD, self._watch)

    def _metadata(self) -> dict[str, dict[str, str]]:
        try:
            session = {str(k): str(v) for k, v in json.loads(self.values["session"]).items()}
        except (ValueError, AttributeError) as error:
            raise InputError(f"not a JSON object ({error})", where=self.get_name(), key="session") from error
        started = datetime.now(timezone.utc).isoformat(timespec="seconds")
        return {
            "pneumo_ros": {"started_utc": started, "mode": self.values["mode"], "rate_hz": str(self.values["rate_hz"]),
                           **session},
            "versions": versions(),
        }  # fmt: skip

    def _record(self, topic: Topic) -> None:
        offered = rosbag2_qos(publisher_qos(topic.flow, self.lockstep))
        channel = self.writer.add_topic(topic.name, topic.type, [offered], self._step(topic))
        take = self._callback(channel, topic.type in STAMPED)
        if topic is PARAMETER_EVENTS:  # absolute, and of every node of the domain
            kind, qos = message_class(topic.type), recorder_qos(topic.flow)
            self.create_subscription(kind, topic.name, self._of_this_namespace(take), qos, raw=True)
        else:
            self.subscribe(topic, self._hearing(take) if topic is EVENTS else take, recorder_qos(topic.flow))

    def _step(self, topic: Topic) -> int | None:
        """How the stamps of a topic must rise: every sample in lockstep, upwards in any case; None where many speak.

        What reached the valves is stamped when it did, on a clock that is slewed; the others have a sample's stamp.
        """
        if not topic.publisher or topic.type not in STAMPED or topic is APPLIED:
            return None
        return self.period_ns if self.lockstep and topic in EVERY_PERIOD else 0

    def _watch(self) -> None:
        if self.writer.disorder:
            self.fail("stamps_disordered", self.writer.disorder)

    def _of_this_namespace(self, take: Callable[[bytes], None]) -> Callable[[bytes], None]:
        """Only what nodes of this namespace say."""
        namespace = self.get_namespace()

        def taken(data: bytes) -> None:
            if deserialize_message(data, ParameterEvent).node.rpartition("/")[0] == namespace.rstrip("/"):
                take(data)

        return taken

    def _hearing(self, take: Callable[[bytes], None]) -> Callable[[bytes], None]:
        """Also remember how the session ended, and what went wrong last."""

        def taken(data: bytes) -> None:
            take(data)
            for status in deserialize_message(data, DiagnosticArray).status:
                self.ending.hear(status.level == ERROR, {v.key: v.value for v in status.values}, status.message)

        return taken

    def _callback(self, channel: Channel, stamped: bool) -> Callable[[bytes], None]:
        """What to do with a message of a channel.

        In lockstep a message is logged at its sample time, so that a session that ran at twenty times real time plays
        back as it was; those without a stamp and the health topics, which carry the computer's time, go to the sample
        they came with.
        """
        if not self.lockstep:
            return lambda data: self.writer.write(channel, data, time.time_ns())
        return self.writer.taker(channel, AT_STAMP if stamped else AT_LATEST)

    def health_level(self) -> tuple[bytes, str]:
        """A warning once nothing is written any more."""
        if not self.writer.stopped:
            return super().health_level()
        if not self._warned:
            self._warned = True
            self.event(WARN, "recording_stopped", self.writer.stopped)
        return WARN, self.writer.stopped

    def on_stop(self, executor: Executor) -> None:
        """Take what is still in the queues, then finish the file."""
        self.drain(executor)
        if not self.stop.failed:
            self.stop.set = False  # the last messages too must be in order
            self._watch()
            self.stop.set = True
        reason = self.stop.reason if self.stop.failed else ""
        complete, why = self.ending.verdict(RIG_NODES & self.session_nodes, noted_failure() or reason)
        self.written = self.writer.finish(complete, why)

    def drain(self, executor: Executor) -> None:
        """Spin until nothing has come for :data:`QUIET_PERIOD`; for nodes that never fall silent there is a limit."""
        before, quiet_since = -1, time.monotonic()
        end = quiet_since + DRAIN_LIMIT
        while time.monotonic() - quiet_since < QUIET_PERIOD and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.02)
            if self.writer.received != before:
                before, quiet_since = self.writer.received, time.monotonic()


def main(args: list[str] | None = None) -> int:
    """Entry point of ``session_recorder``."""
    return node_main(SessionRecorderNode, args)


if __name__ == "__main__":
    raise SystemExit(main())
