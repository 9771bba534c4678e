# SPDX-License-Identifier: Apache-2.0
"""Carries out what launch/rig.launch.py describes, where ROS 2's launch is not installed (it has no wheels).

    python test/helpers/launcher.py source:=sim duration:=2 log_folder:=somewhere

The file is loaded as it stands; `launch` and `launch_ros` are the few names below, with the meaning that the launch
documentation gives them. Processes, parameters, signals and DDS are real. How ROS 2's own launch schedules its events
is not shown by this.
"""

from __future__ import annotations

import os
import runpy
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import yaml

FILE = Path(__file__).resolve().parents[2] / "launch" / "rig.launch.py"


@dataclass
class LaunchContext:
    """Values of the arguments, and whether everything is being ended."""

    launch_configurations: dict[str, str] = field(default_factory=dict)
    is_shutdown: bool = False


@dataclass
class LaunchConfiguration:
    """An argument's value."""

    name: str

    def perform(self, context: LaunchContext) -> str:
        return context.launch_configurations[self.name]


@dataclass
class DeclareLaunchArgument:
    """An argument with a default."""

    name: str
    default_value: str
    description: str = ""
    choices: list[str] | None = None

    def execute(self, context: LaunchContext) -> None:
        value = context.launch_configurations.setdefault(self.name, self.default_value)
        if self.choices and value not in self.choices:
            raise SystemExit(f"{self.name}:={value} is none of {self.choices}")


@dataclass
class OpaqueFunction:
    """A function that makes more of the description."""

    function: Callable[[LaunchContext], list[object]]


@dataclass
class LogInfo:
    """A line to print."""

    msg: str


@dataclass
class Shutdown:
    """The event that ends everything."""

    reason: str


@dataclass
class EmitEvent:
    """An action that raises an event."""

    event: Shutdown


@dataclass
class ProcessExited:
    """A process has ended."""

    returncode: int


@dataclass
class OnProcessExit:
    """What to do when a node has ended."""

    target_action: Node
    on_exit: Callable[[ProcessExited, LaunchContext], list[object]]


@dataclass
class RegisterEventHandler:
    """An action that adds a handler."""

    handler: OnProcessExit


@dataclass
class LaunchDescription:
    """What the file makes."""

    entities: list[object]


@dataclass(eq=False)
class Node:
    """A ROS node in a process of its own."""

    package: str
    executable: str
    name: str
    namespace: str
    output: str
    parameters: list[str | dict[str, Any]]
    remappings: list[tuple[str, str]]
    ros_arguments: list[str]
    additional_env: dict[str, str]
    sigterm_timeout: str
    sigkill_timeout: str

    def start(self, folder: Path) -> subprocess.Popen[bytes]:
        """Parameters in files, name, namespace and remappings on the command line, as launch_ros passes them."""
        command = [sys.executable, "-m", f"{self.package}.nodes.{self.executable}", "--ros-args", *self.ros_arguments]
        command += ["-r", f"__node:={self.name}"]
        command += ["-r", f"__ns:={self.namespace}"] if self.namespace else []
        for k, entry in enumerate(self.parameters):
            path = folder / f"{self.name}-{k}.yaml"
            if isinstance(entry, dict):
                path.write_text(yaml.safe_dump({f"{self.namespace}/{self.name}": {"ros__parameters": entry}}))
            command += ["--params-file", str(path if isinstance(entry, dict) else entry)]
        for old, new in self.remappings:
            command += ["-r", f"{old}:={new}"]
        return subprocess.Popen(command, env={**os.environ, **self.additional_env}, start_new_session=True)


def install() -> None:
    """The modules that the file imports."""
    places: dict[str, list[type]] = {
        "launch": [LaunchDescription],
        "launch.actions": [DeclareLaunchArgument, EmitEvent, LogInfo, OpaqueFunction, RegisterEventHandler],
        "launch.event_handlers": [OnProcessExit],
        "launch.events": [Shutdown],
        "launch.events.process": [ProcessExited],
        "launch.launch_context": [LaunchContext],
        "launch.substitutions": [LaunchConfiguration],
        "launch_ros": [],
        "launch_ros.actions": [Node],
    }
    for name, content in places.items():
        sys.modules[name] = module = ModuleType(name)
        for one in content:
            setattr(module, one.__name__, one)


class Launcher:
    """Runs a description to its end."""

    def __init__(self, context: LaunchContext, folder: Path) -> None:
        self.context, self.folder = context, folder
        self.handlers: list[OnProcessExit] = []
        self.running: dict[Node, subprocess.Popen[bytes]] = {}
        self.failed = False

    def take(self, entities: list[object]) -> None:
        """Carry out actions, those that they make included."""
        for one in entities:
            if isinstance(one, DeclareLaunchArgument):
                one.execute(self.context)
            elif isinstance(one, OpaqueFunction):
                self.take(one.function(self.context))
            elif isinstance(one, RegisterEventHandler):
                self.handlers.append(one.handler)
            elif isinstance(one, Node):
                self.running[one] = one.start(self.folder)
            elif isinstance(one, LogInfo):
                print(one.msg, flush=True)
            elif isinstance(one, EmitEvent):
                self.shut_down(one.event)
            else:
                raise TypeError(f"{type(one).__name__} is not known here")

    def shut_down(self, event: Shutdown) -> None:
        """SIGINT to every process, once."""
        if not self.context.is_shutdown:
            self.context.is_shutdown = True
            print(f"shutdown: {event.reason}", flush=True)
            for process in self.running.values():
                process.send_signal(signal.SIGINT)

    def run(self) -> int:
        """Until every process has ended; 1 if one of them failed."""
        while self.running:
            for node, code in list(self._ended()):
                del self.running[node]
                self.failed |= code != 0
                for handler in self.handlers:
                    if handler.target_action is node:
                        self.take(handler.on_exit(ProcessExited(code), self.context))
            time.sleep(0.02)
        return int(self.failed)

    def _ended(self) -> Iterator[tuple[Node, int]]:
        for node, process in self.running.items():
            code = process.poll()
            if code is not None:
                yield node, code


def main() -> int:
    """Arguments as `ros2 launch` takes them, name:=value."""
    install()
    given = dict(text.split(":=", 1) for text in sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        launcher = Launcher(LaunchContext(given), Path(folder))
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: launcher.shut_down(Shutdown("asked to end")))
        launcher.take(runpy.run_path(str(FILE))["generate_launch_description"]().entities)
        return launcher.run()


if __name__ == "__main__":
    sys.exit(main())
