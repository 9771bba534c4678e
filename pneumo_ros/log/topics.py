# SPDX-License-Identifier: Apache-2.0
"""The table of topics: every topic of the graph, its type, contents, units, quality of service and who uses it.

The nodes create their publishers and subscriptions from it; docs/topics.md and msg_tests are made from it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from pneumo_ros.rig.channels import CHANNELS, DISPLACEMENTS, ESTIMATE_FIELDS, ROADS, TRUTH_FIELDS, VALVES


class Flow(Enum):
    """Quality of service of a topic (REP 2003), with the reason."""

    STREAM = "reliable, keep last 200 (lockstep 2000), volatile: one sample a control period; the log must not miss one"
    CLOCK = "best effort in real time, reliable in lockstep, keep last 1: only the newest time matters"
    LATCHED = "reliable, keep last 1, transient local: a late subscriber still learns it"
    EVENTS = "reliable, keep last 100, transient local: rare, each one matters, also to a late subscriber"
    STATUS = "reliable, keep last 10, volatile: periodic health, a lost one is replaced by the next"
    STOP = (
        "reliable, keep last 10, volatile; the valves' owner also takes best effort and transient local: any publisher"
    )


@dataclass(frozen=True)
class Topic:
    """One topic of the graph.

    Attributes
    ----------
    name : absolute name, as in every log; nodes create it below their namespace (:attr:`relative`)
    type : ROS interface name
    meaning : what it carries, in a sentence
    publisher : node that publishes it ('' where any node may)
    subscribers : nodes that act on it; the recorder takes everything with ``recorded``
    in_real_time : nodes that act on it in real time only
    flow : quality of service
    frame_id : of the header
    fields : name -> unit of each value carried (``position`` of a JointState)
    rates : name -> unit of each value in ``velocity``, where there is one
    recorded : written to the log
    """

    name: str
    type: str
    meaning: str
    publisher: str
    subscribers: tuple[str, ...] = ()
    in_real_time: tuple[str, ...] = field(default=(), kw_only=True)
    flow: Flow = Flow.STREAM
    frame_id: str = ""
    fields: tuple[tuple[str, str], ...] = ()
    rates: bool = False
    recorded: bool = True

    @property
    def relative(self) -> str:
        """Name that a node's namespace and remappings apply to."""
        return self.name.lstrip("/")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values, in the order they are published."""
        return tuple(name for name, _ in self.fields)


JOINT = "sensor_msgs/msg/JointState"
PRESSURE = "sensor_msgs/msg/FluidPressure"
STRING = "std_msgs/msg/String"
PARCEL = "std_msgs/msg/UInt8MultiArray"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"

ROAD = Topic(
    "/road/profile", JOINT, "commanded road height and its rate under each axle", "road_profile", ("plant",),
    frame_id="ground", fields=tuple((name, "m") for name in ROADS), rates=True,
)  # fmt: skip
DISPLACEMENT = Topic(
    "/rig/displacement", JOINT, "calibrated LVDTs, upwards from the ground datum, sprung points above each axle",
    "plant", ("estimator",), in_real_time=("road_profile",), frame_id="ground",
    fields=tuple((name, "m") for name in DISPLACEMENTS),
)  # fmt: skip
FRONT_PRESSURE = Topic(
    "/rig/front/pressure", PRESSURE, "front air spring, absolute", "plant", ("estimator",),
    frame_id="front_air_spring", fields=(("fluid_pressure", "Pa"), ("variance", "Pa2")),
)  # fmt: skip
REAR_PRESSURE = Topic(
    "/rig/rear/pressure", PRESSURE, "rear air spring, absolute", "plant", ("estimator",),
    frame_id="rear_air_spring", fields=(("fluid_pressure", "Pa"), ("variance", "Pa2")),
)  # fmt: skip
COMMAND = Topic(
    "/valve/command", JOINT, "commanded orifice areas, held until the next", "controller", ("plant", "daq"),
    frame_id="manifold",
    fields=tuple((name, "m2") for name in VALVES),
)  # fmt: skip
ESTIMATE = Topic(
    "/estimate/state",
    JOINT,
    "body and spring motion by robust exact differentiation, pressures as measured, effective areas by least squares",
    "estimator",
    ("controller",),
    frame_id="ground",
    fields=ESTIMATE_FIELDS,
)
SLIDING = Topic(
    "/controller/sliding",
    JOINT,
    "sliding variables, inlet openings before they are clipped to the valve's range, reference model",
    "controller",
    frame_id="manifold",
    fields=(
        ("sliding_heave", "m/s"),
        ("sliding_pitch", "rad/s"),
        ("front_inlet_unclipped", "m2"),
        ("rear_inlet_unclipped", "m2"),
        ("reference_heave", "m"),
        ("reference_pitch_nose_up", "rad"),
    ),
)
TRUTH = Topic(
    "/sim/truth", JOINT, "what the simulated rig really does (simulation only)", "plant", frame_id="ground",
    fields=TRUTH_FIELDS,
)  # fmt: skip
CLOCK = Topic(
    "/clock", "rosgraph_msgs/msg/Clock", "simulation time, lockstep only; the plant owns it", "plant",
    ("road_profile",), flow=Flow.CLOCK, recorded=False,
)  # fmt: skip
CONFIG = Topic("/rig/config", STRING, "the rig's parameters with tolerances, YAML", "plant", flow=Flow.LATCHED)
SETUP = Topic(
    "/rig/setup", STRING, "parameters of one node at start and after each change, YAML, one message a node and change",
    "", flow=Flow.EVENTS,
)  # fmt: skip
EVENTS = Topic(
    "/rig/events", DIAGNOSTICS, "trips, life cycle, parameter changes, end of the session; values carry a reason code",
    "", flow=Flow.EVENTS,
)  # fmt: skip
DIAGNOSTIC = Topic(
    "/diagnostics", DIAGNOSTICS, "health at 1 Hz (REP 107): period and execution time p50, p99, max, missed ticks",
    "", flow=Flow.STATUS,
)  # fmt: skip
ESTOP = Topic(
    "/rig/estop", "std_msgs/msg/Bool", "emergency stop: true latches it, false does nothing; released by service only",
    "", ("plant", "daq"), flow=Flow.STOP,
)  # fmt: skip
READY = Topic(
    "/rig/ready", STRING, "name of a node whose publishers have all their subscribers", "", ("plant", "daq"),
    flow=Flow.EVENTS, recorded=False,
)  # fmt: skip

RAW = Topic(
    "/rig/raw", JOINT, "converter counts of every sample as they came, also before arming (hardware only)", "daq",
    frame_id="converter",
    fields=tuple((name, "count") for name in (*CHANNELS, "supply_pressure")),
)  # fmt: skip
SUPPLY_PRESSURE = Topic(
    "/rig/supply/pressure", PRESSURE, "air supply, absolute (hardware only)", "daq",
    frame_id="supply", fields=(("fluid_pressure", "Pa"), ("variance", "Pa2")),
)  # fmt: skip
APPLIED = Topic(
    "/valve/applied", JOINT,
    "orifice areas sent to the valves, stamped when they were: the command after ramp, refusals and trips "
    "(hardware only)",
    "daq", frame_id="manifold", fields=COMMAND.fields,
)  # fmt: skip
CALIBRATION = Topic(
    "/rig/calibration", STRING, "calibration in use, YAML, at start and after zero or span (hardware only)", "daq",
    flow=Flow.EVENTS,
)  # fmt: skip

JOINT_STATES = Topic(
    "/joint_states", JOINT, "joints of the URDF, for viewers (node joint_states beside a session, or pneumo log scene)",
    "joint_states", frame_id="ground", recorded=False,
    fields=(("heave", "m"), ("pitch_nose_up", "rad"), ("unsprung_front", "m"), ("unsprung_rear", "m")),
)  # fmt: skip
ROBOT_DESCRIPTION = Topic(
    "/robot_description", STRING, "URDF of the rig, for viewers", "joint_states", flow=Flow.LATCHED, recorded=False,
)  # fmt: skip

SENDERS = ("road_profile", "plant", "estimator", "controller")
IN_PARCELS = (ROAD, DISPLACEMENT, FRONT_PRESSURE, REAR_PRESSURE, COMMAND, ESTIMATE, SLIDING, TRUTH)
FOR_NEXT = {
    sender: Topic(
        f"/_parcels/{sender}", PARCEL, f"what {sender} says in one step, to the nodes that wait for it (lockstep)",
        sender, tuple({s: 0 for t in IN_PARCELS if t.publisher == sender for s in t.subscribers if s in SENDERS}),
        recorded=False,
    )
    for sender in SENDERS
}  # fmt: skip
FOR_LOG = {
    sender: Topic(
        f"/_parcels/{sender}/log", PARCEL, f"what {sender} says in several steps, to the recorder (lockstep)", sender,
        ("session_recorder",), recorded=False,
    )
    for sender in SENDERS
}  # fmt: skip
"""Parcels by sender (nodes/parcels.py); ROS 2 hides names that begin with an underscore from its tools."""

TOPICS: tuple[Topic, ...] = (
    ROAD, DISPLACEMENT, FRONT_PRESSURE, REAR_PRESSURE, COMMAND, ESTIMATE, SLIDING, TRUTH, CLOCK, CONFIG, SETUP,
    EVENTS, DIAGNOSTIC, ESTOP, READY, RAW, SUPPLY_PRESSURE, APPLIED, CALIBRATION, JOINT_STATES, ROBOT_DESCRIPTION,
    *FOR_NEXT.values(), *FOR_LOG.values(),
)  # fmt: skip
MEASUREMENTS = (DISPLACEMENT, FRONT_PRESSURE, REAR_PRESSURE)
BY_NAME = {topic.name: topic for topic in TOPICS}
EVERY_PERIOD = (ROAD, *MEASUREMENTS, COMMAND, ESTIMATE)
"""Topics that carry exactly one message a control period; a complete log has the same count of each."""


def topics_table() -> str:
    """The table of docs/topics.md, Markdown."""
    lines = [
        "| topic | type | values (unit) | from | to | quality of service | meaning |",
        "|---|---|---|---|---|---|---|",
    ]
    for t in TOPICS:
        values = ", ".join(f"{name} ({unit})" for name, unit in t.fields) or "-"
        real_time = tuple(f"{node} (real time)" for node in t.in_real_time)
        to = ", ".join((*t.subscribers, *real_time, *(("session_recorder",) if t.recorded else ()))) or "-"
        lines.append(
            f"| `{t.name}` | {t.type} | {values} | {t.publisher or 'any'} | {to} | {t.flow.value} | {t.meaning} |"
        )
    return "\n".join(lines) + "\n"
