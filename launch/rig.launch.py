# SPDX-License-Identifier: Apache-2.0
"""Launch a session under a full ROS 2: `ros2 launch pneumo_ros rig.launch.py source:=sim`."""

from __future__ import annotations

import json
import os
import signal
import tempfile
import uuid
from datetime import datetime
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, LogInfo, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.events.process import ProcessExited
from launch.launch_context import LaunchContext
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from pneumo_ros.control.half_car import PARAMETERS as CONTROL_PARAMETERS
from pneumo_ros.control.presets import PRESETS, controller_settings
from pneumo_ros.nodes.neighbours import claim_place
from pneumo_ros.paths import share_file
from pneumo_ros.session.claim import Claim
from pneumo_ros.session.middleware import middleware_settings
from pneumo_ros.session.supervisor import END_REASON, SUPERVISOR

SOURCES = {"sim": "plant", "serial": "daq"}
ARGUMENTS = {
    "source": ("sim", "sim: the simulated rig; serial: the hardware"),
    "mode": ("auto", "lockstep or realtime; auto: lockstep for sim, realtime for serial"),
    "controller": ("file", "a preset for estimator and controller; file: what params_file says"),
    "port": ("/dev/ttyACM0", "serial port of the hardware"),
    "calibration": ("appendix_c", "of the hardware: name in config/calibration, or a YAML file"),
    "namespace": ("", "of nodes and topics, one for each rig"),
    "params_file": ("", "parameter file; config/session.yaml by default"),
    "log_folder": ("", "folder of the log session.mcap; sessions/<time> by default"),
    "duration": ("", "s; 0 runs until stopped; empty: what params_file says"),
    "use_sim_time": ("false", "nodes that do not give the samples their time follow /clock"),
}
CHOICES = {
    "source": list(SOURCES),
    "mode": ["auto", "lockstep", "realtime"],
    "controller": ["file", *PRESETS, *next(p.choices for p in CONTROL_PARAMETERS if p.name == "controller")],
    "use_sim_time": ["true", "false"],
}
RECORDER_PATIENCE = "60"  # s until launch's next stronger signal; a slow disk may still be taking the log
_claims: list[Claim] = []  # held until launch ends


def nodes(context: LaunchContext) -> list[object]:
    """The five nodes of a session; it ends when one of them ends, and the recorder ends last."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    source = SOURCES[given["source"]]
    mode = given["mode"] if given["mode"] != "auto" else ("lockstep" if source == "plant" else "realtime")
    namespace = "/" + given["namespace"].strip("/") if given["namespace"].strip("/") else ""
    folder = given["log_folder"] or str(Path("sessions") / datetime.now().strftime("%Y-%m-%dT%H-%M-%S"))
    log = Path(folder) / "session.mcap"
    _claims.append(claim_place(None, namespace, False, f"launched, {given['source']}, {log}", valves=source != "plant"))
    names = ["road_profile", source, "estimator", "controller", "session_recorder"]
    identity = uuid.uuid4().hex
    common = {
        "mode": mode, "session_nodes": ",".join(names), "session_id": identity,
        "use_sim_time": given["use_sim_time"] == "true",
    }  # fmt: skip
    told = json.dumps({"session_id": identity, **{name: value for name, value in given.items() if value}})
    own = {
        "session_recorder": {"output": str(log), "session": told},
        "daq": {"port": given["port"], "calibration": given["calibration"]},
    }
    for node, key, value in controller_settings(given["controller"]) if given["controller"] != "file" else ():
        own.setdefault(node, {})[key] = value
    if given["duration"]:
        own.setdefault(source, {})["duration"] = float(given["duration"])
    config = given["params_file"] or str(share_file("config", "session.yaml"))
    reason = Path(tempfile.mkdtemp(prefix="pneumo-")) / "end_reason"
    # Where nodes may be found is the launching user's to say, as of every launch file.
    settings = middleware_settings(os.environ, discovery="SUBNET")
    made = {
        name: Node(
            package="pneumo_ros", executable=name, name=name, namespace=namespace, output="screen",
            parameters=[config, {**common, **own.get(name, {})}],
            remappings=[("/clock", "clock")] if namespace else [],
            ros_arguments=["--disable-rosout-logs"] if mode == "lockstep" else [],
            additional_env={**settings, SUPERVISOR: str(os.getpid()), END_REASON: str(reason)},
            sigterm_timeout=RECORDER_PATIENCE, sigkill_timeout=RECORDER_PATIENCE,
        )
        for name in names
    }  # fmt: skip
    ends = End(log, reason)
    watch = [
        RegisterEventHandler(OnProcessExit(target_action=node, on_exit=ends.handler(name)))
        for name, node in made.items()
    ]
    # Watched before they are started: a node may end at once.
    return [*watch, *made.values()]


class End:
    """The end of a session, whichever node it begins with.

    Parameters
    ----------
    log : that the recorder writes
    reason : file from which the recorder learns why the session failed
    """

    def __init__(self, log: Path, reason: Path) -> None:
        self._log, self._reason = log, reason

    def handler(self, name: str) -> object:
        """What to do when the node ``name`` has ended."""

        def on_exit(event: ProcessExited, context: LaunchContext) -> list[object]:
            done: list[object] = []
            if not context.is_shutdown:
                done = self._end(name, event.returncode)
            return [*done, LogInfo(msg=self._about_log())] if name == "session_recorder" else done

        return on_exit

    def _end(self, name: str, code: int) -> list[object]:
        if code == 0:  # the rig's node is done, or the user asked this one to end before launch heard of it
            return [EmitEvent(event=Shutdown(reason="session ended"))]
        how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
        why = f"node {name} {how}"
        self._reason.write_text(why, encoding="utf-8")
        return [LogInfo(msg=f"session failed: {why}"), EmitEvent(event=Shutdown(reason=why))]

    def _about_log(self) -> str:
        part = self._log.with_name(self._log.name + ".part")
        if self._log.exists():
            return f"log: {self._log}"
        return f"the log was cut off: pneumo log recover {part}" if part.exists() else "no log was written"


def generate_launch_description() -> LaunchDescription:
    """Arguments and the nodes they lead to."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text, choices=CHOICES.get(name))
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])
