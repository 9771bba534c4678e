# SPDX-License-Identifier: Apache-2.0
"""Launch a session under a full ROS 2: `ros2 launch pneumo_ros rig.launch.py source:=sim`."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, LogInfo, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.launch_context import LaunchContext
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from pneumo_ros.paths import share_file

SOURCES = {"sim": "plant", "serial": "daq"}
ARGUMENTS = {
    "source": ("sim", "sim: the simulated rig; serial: the hardware"),
    "port": ("/dev/ttyACM0", "serial port of the hardware"),
    "calibration": ("appendix_c", "of the hardware: name in config/calibration, or a YAML file"),
    "config": ("", "parameter file; config/session.yaml by default"),
    "mode": ("", "lockstep or realtime; empty: lockstep for sim, realtime for serial"),
    "output": ("", "log to write; sessions/<time>/session.mcap by default"),
}


def nodes(context: LaunchContext) -> list[object]:
    """The five nodes of a session; it ends when the source ends."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    source = SOURCES[given["source"]]
    output = given["output"] or str(Path("sessions") / datetime.now().strftime("%Y-%m-%dT%H-%M-%S") / "session.mcap")
    mode = given["mode"] or ("lockstep" if source == "plant" else "realtime")
    names = ["road_profile", source, "estimator", "controller", "session_recorder"]
    common = {"mode": mode, "session_nodes": ",".join(names)}
    own = {"session_recorder": {"output": output}, "daq": {"port": given["port"], "calibration": given["calibration"]}}
    config = given["config"] or str(share_file("config", "session.yaml"))
    made = {
        name: Node(
            package="pneumo_ros", executable=name, name=name, output="screen",
            parameters=[config, {**common, **own.get(name, {})}],
        )
        for name in names
    }  # fmt: skip
    end = RegisterEventHandler(
        OnProcessExit(
            target_action=made[source],
            on_exit=[LogInfo(msg=f"session ended; log: {output}"), EmitEvent(event=Shutdown(reason="session ended"))],
        )
    )
    return [*made.values(), end]


def generate_launch_description() -> LaunchDescription:
    """Arguments and the nodes they lead to."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])
