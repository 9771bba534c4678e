# SPDX-License-Identifier: Apache-2.0
"""Quality of service of each kind of flow, by REP 2003, for both time modes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rcl_interfaces.msg import SetParametersResult
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import InvalidQosOverridesError, QoSOverridingOptions

from pneumo_ros.documents import parse_yaml
from pneumo_ros.errors import InputError
from pneumo_ros.log.topics import BY_NAME, Flow

RECORDER_DEPTH = 10_000  # a chunk flush may hold the recorder for 10 ms; lockstep sends thousands of samples a second
LOCKSTEP_DEPTH = 2000  # samples a writer keeps for a recorder that another program holds up: 0.2 s of quick lockstep

_DEPTH = {Flow.STREAM: 200, Flow.CLOCK: 1, Flow.LATCHED: 1, Flow.EVENTS: 100, Flow.STATUS: 10, Flow.STOP: 10}


OVERRIDABLE = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY)


def overriding(lockstep: bool) -> QoSOverridingOptions:
    """Lets parameters ``qos_overrides.<topic>.<publisher or subscription>.<policy>`` replace what the table says.

    Not everything: in lockstep a lost sample would stop the session for ever, and a queue of nothing delivers nothing.
    """

    def judged(profile: QoSProfile) -> SetParametersResult:
        reason = ""
        if lockstep and profile.reliability is ReliabilityPolicy.BEST_EFFORT:
            reason = "in lockstep every message counts: reliability must be reliable"
        if profile.history is HistoryPolicy.KEEP_LAST and profile.depth < 1:
            reason = f"depth is {profile.depth}, 1 or more is allowed"
        return SetParametersResult(successful=not reason, reason=reason)

    return QoSOverridingOptions(OVERRIDABLE, callback=judged)


@contextmanager
def refused_overrides(node: str, topic: str) -> Iterator[None]:
    """What rclpy says of a bad override, as the mistake of a user that it is.

    Raises
    ------
    InputError
        instead of rclpy's own kinds of error.
    """
    try:
        yield
    except (InvalidQosOverridesError, RuntimeError) as error:
        if "QoS override" not in str(error):
            raise
        raise InputError(
            f"refused ({error})",
            where=node,
            key=f"qos_overrides.{topic}",
            allowed="history keep_last or keep_all; depth 1 or more; reliability reliable, or best_effort but not in "
            "lockstep; durability volatile or transient_local",
            remedy="correct or remove the override",
        ) from error


def publisher_qos(flow: Flow, lockstep: bool) -> QoSProfile:
    """Offered by publishers: reliable, so that the recorder misses nothing; the real-time clock alone is not."""
    latched = flow in (Flow.LATCHED, Flow.EVENTS)
    reliable = lockstep or flow is not Flow.CLOCK
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=LOCKSTEP_DEPTH if lockstep and flow is Flow.STREAM else _DEPTH[flow],
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def subscriber_qos(flow: Flow, lockstep: bool) -> QoSProfile:
    """Requested by the control loop.

    In lockstep every sample counts: reliable. In real time only the newest does: best effort, depth 1 (15-25 % quicker
    between processes, and an old sample is worse than none).
    """
    if flow is Flow.STREAM and not lockstep:
        return QoSProfile(
            history=HistoryPolicy.KEEP_LAST, depth=1, reliability=ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.VOLATILE,
        )  # fmt: skip
    return publisher_qos(flow, lockstep)


def recorder_qos(flow: Flow) -> QoSProfile:
    """Requested by the recorder: reliable and deep whatever the mode."""
    profile = publisher_qos(flow, lockstep=True)
    profile.depth = RECORDER_DEPTH
    return profile


def rosbag2_qos(profile: QoSProfile) -> dict[str, object]:
    """A profile in the words of rosbag2's metadata."""

    def span(duration: object) -> dict[str, int]:
        total = int(duration.nanoseconds)  # type: ignore[attr-defined]
        return {"sec": total // 1_000_000_000, "nsec": total % 1_000_000_000}

    return {
        "history": profile.history.name.lower(),
        "depth": profile.depth,
        "reliability": profile.reliability.name.lower(),
        "durability": profile.durability.name.lower(),
        "deadline": span(profile.deadline),
        "lifespan": span(profile.lifespan),
        "liveliness": profile.liveliness.name.lower(),
        "liveliness_lease_duration": span(profile.liveliness_lease_duration),
        "avoid_ros_namespace_conventions": profile.avoid_ros_namespace_conventions,
    }


def recorded_qos(name: str, text: str) -> QoSProfile:
    """The QoS a topic was offered with, from the recorder's note; the table's where there is none."""
    known = BY_NAME.get(name)
    profile = publisher_qos(known.flow, lockstep=True) if known else QoSProfile(depth=100)
    try:
        offered = parse_yaml(text, name) or []
    except InputError:
        offered = []
    if not isinstance(offered, list) or not offered or not isinstance(offered[0], dict):
        return profile
    # rosbag2 writes words since Iron and the numbers of rmw's enumerations before.
    if str(offered[0].get("reliability")) in ("best_effort", "2"):
        profile.reliability = ReliabilityPolicy.BEST_EFFORT
    elif str(offered[0].get("reliability")) in ("reliable", "1"):
        profile.reliability = ReliabilityPolicy.RELIABLE
    if str(offered[0].get("durability")) in ("transient_local", "1"):
        profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
    elif str(offered[0].get("durability")) in ("volatile", "2"):
        profile.durability = DurabilityPolicy.VOLATILE
    return profile
