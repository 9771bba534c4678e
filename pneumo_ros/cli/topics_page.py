# SPDX-License-Identifier: Apache-2.0
"""The text of docs/topics.md around the table: why these types, and which quality of service each kind of topic has."""

from __future__ import annotations

from pneumo_ros.log.topics import TOPICS, Flow, topics_table

HEAD = """# Topics

Made from the table in `pneumo_ros/log/topics.py` by `make docs`. Every stamped message carries in `header.stamp`
the instant its values hold. `JointState` is used as the stamped, named standard message: its `position` holds the value
in the unit given here, so that any plotting tool shows it by name. Match values by name, never by position. On
hardware (`pneumo run --source serial`) the node `daq` takes the place of `plant`: it publishes what the sensors of the
real rig say under the same names.

"""
TYPES = """
## Why these types

There is no message package of the rig: every tool reads its logs without building anything first.

- **`JointState` for areas and road heights.** It is the one stamped standard message with names, and it carries any
  number of values of one instant. `Float64MultiArray` has no stamp, so that age and delay could not be measured; one
  `Float64` a valve has neither stamp nor name, and the four messages of one command could be torn apart. It was made
  for joints, and a valve opening is no position: the unit above is what holds. Where joints are meant,
  [`/joint_states`](ros2-control.md) has them.
- **`FluidPressure` for pressures.** It says Pascal, absolute and variance by definition, so no convention is needed.
  One message a spring, since it holds one value; the three messages of a sample have the same stamp.
- **`DiagnosticArray` for events** as well as for `/diagnostics`: level, text and keyed values that every monitor
  shows. By REP 107 a status of `/diagnostics` is named `node: part` and comes at 1 Hz; `hardware_id` is the board's
  serial number (node `daq`, once the board has answered) or the rig's name.
- **`UInt8MultiArray` for parcels**, several serialised messages in one (layout: `pneumo_ros/log/parcel.py`): see below.
- **YAML in `String`** for the parameters of rig and nodes: written once, read by people.

## Parcels

In a lockstep session each node waits for the one before it, and between processes a message costs for being delivered,
hardly for its size. The nodes of one session in several processes (`pneumo run`, the launch file) therefore send each
other parcels: what a node says in one step as one message to the nodes that act on it, and some twenty messages as one
to the recorder, which writes each of them to its own topic, byte for byte. They do not subscribe to the topics
themselves. Names that begin with `_` are hidden from ROS 2's tools; no log holds them. For everybody else nothing
changes:

- A topic of the table is sent as well while anybody listens, every message from the discovery of the listener on:
  `ros2 bag record`, a plot, the dashboard.
- Nodes that are started by hand (no `session_id`), or in a session whose `session_nodes` leave out a role, hear the
  topics themselves: a plant of your own publishes the three measurements and need not know of parcels.
- Real time, hardware and replay have none; in one process nodes hand over what they say without the middleware.
- A second publisher ends the session: of a parcel before anything of it is used, of a topic, of which the session
  uses nothing, within half a second.
- A node that is killed takes its last parcel for the log with it, some twenty messages; one that ends or tells an
  event sends it before.

## Quality of service and REP 2003

REP 2003 wants sensor data published with the system's defaults (reliable, volatile) and consumed best effort, and maps
reliable and transient local.

"""
# Flow -> (publisher, consumer in real time, where and why it departs from REP 2003)
PROFILES = {
    Flow.STREAM: (
        "reliable, volatile: as sensor data",
        "best effort, as sensor data; depth 1 (SensorDataQoS has 5), an old sample being worse than none",
        "lockstep: consumers are reliable, a lost sample would stop the session. Recorder: always reliable, the log "
        "must not miss one",
    ),
    Flow.CLOCK: ("best effort; reliable in lockstep", "the same", "not covered; lockstep paces by it"),
    Flow.LATCHED: ("reliable, transient local, depth 1: as a map", "the same", "-"),
    Flow.EVENTS: ("reliable, transient local, depth 100", "the same", "not covered; rare, and each one matters"),
    Flow.STATUS: ("reliable, volatile", "the same", "not covered; as diagnostic_updater does"),
    Flow.STOP: (
        "any",
        "reliable, volatile; the valves' owner also best effort and transient local",
        "not covered; whoever asks for a stop must be heard, whatever it offers",
    ),
}
OVERRIDES = """
**Overrides.** History, depth, reliability and durability of every publisher and subscription of a node are read-only
parameters, by the topic's resolved name:

```yaml
estimator:
  ros__parameters:
    qos_overrides:
      /estimate/state:
        publisher: {reliability: best_effort, depth: 1}
      /rig/displacement:
        subscription: {reliability: reliable, depth: 50}
```

In lockstep best effort is refused. A log's `offered_qos_profiles` are those of the table above, also where a publisher
was overridden. `ros2 param dump` writes overrides with the other parameters; `--params-file` and `pneumo run --config`
take such a file.
"""


def topics_page() -> str:
    """docs/topics.md, Markdown."""
    lines = ["| topics | publisher | consumer in real time | where it departs, and why |", "|---|---|---|---|"]
    for flow in Flow:
        names = ", ".join(f"`{topic.name}`" for topic in TOPICS if topic.flow is flow)
        lines.append(f"| {names} | {' | '.join(PROFILES[flow])} |")
    return HEAD + topics_table() + TYPES + "\n".join(lines) + "\n" + OVERRIDES
