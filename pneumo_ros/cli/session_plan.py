# SPDX-License-Identifier: Apache-2.0
"""The command line's options as parameters of the nodes of a session."""

from __future__ import annotations

import json
import uuid
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pneumo_ros.cli.choices import ALIASES, DEFAULT_CONTROLLER, ROAD_CLASSES
from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.session.plan import Tables, Values


RIG_NODES = {"sim": "plant", "serial": "daq"}  # source -> the node that is the rig


def controller_of_profile(controller: str) -> str:
    """The controller that plays a valve profile, if none other was asked for beside it."""
    from pneumo_ros.control.half_car import PROFILE

    if controller not in (DEFAULT_CONTROLLER, PROFILE):
        raise InputError("either a controller or a valve profile", where="--valves", key="--controller",
                         value=controller, remedy="leave one of them out")  # fmt: skip
    return PROFILE


def session_nodes(source: str) -> tuple[str, ...]:
    """Nodes of a session in the order they are stopped."""
    if source == "serial":  # the valves first: without a controller the driver would rightly trip
        return "daq", "road_profile", "controller", "estimator", "session_recorder"
    return "road_profile", "controller", "estimator", "plant", "session_recorder"


def node_tables() -> Tables:
    """Parameter table of every node a session may have."""
    from pneumo_ros.nodes import controller, daq, estimator, plant, road_profile, session_recorder
    from pneumo_ros.nodes.base import node_parameters

    modules = {
        "road_profile": road_profile,
        "plant": plant,
        "daq": daq,
        "estimator": estimator,
        "controller": controller,
        "session_recorder": session_recorder,
    }
    return {name: node_parameters(module.PARAMETERS) for name, module in modules.items()}


def settings_of_options(
    road: str, duration: float, speed: float, controller: str, seed: int, rate: float, realtime: bool, source: str
) -> list[tuple[str, str, Any]]:
    """The command line's options as settings of nodes."""
    from pneumo_ros.control.presets import controller_settings

    return [
        *_road_options(road),
        ("road_profile", "speed_kmh", speed),
        ("road_profile", "seed", seed),
        ("plant", "seed", seed),
        ("**", "session_nodes", ",".join(session_nodes(source))),
        (RIG_NODES[source], "duration", duration),
        (RIG_NODES[source], "report_progress", True),
        *controller_settings(ALIASES.get(controller, controller)),
        ("**", "rate_hz", rate),
        ("**", "mode", "realtime" if realtime or source == "serial" else "lockstep"),
    ]


def _road_options(road: str) -> list[tuple[str, str, Any]]:
    if road.upper() in list(ROAD_CLASSES):
        return [("road_profile", "kind", "iso"), ("road_profile", "iso_class", road.upper())]
    if road.lower().endswith(".csv"):
        return [("road_profile", "kind", "file"), ("road_profile", "path", road)]
    return [("road_profile", "kind", road)]


def finish_plan(values: Values, rig: Path | None, target: Path, session: dict[str, str]) -> None:
    """Rig, log and the session's own identity into every node's parameters."""
    for own in values.values():
        if rig is not None:
            own["rig"] = str(rig.resolve())
    values["session_recorder"]["output"] = str(target)
    identity = uuid.uuid4().hex
    values["session_recorder"]["session"] = json.dumps(
        {**session, "session_id": identity, "parameters": json.dumps(values)}
    )
    for own in values.values():
        own["session_id"] = identity
