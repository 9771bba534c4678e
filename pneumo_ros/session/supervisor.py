# SPDX-License-Identifier: Apache-2.0
"""Start the processes of a session, watch them, and end them in an order that loses nothing. Knows no ROS."""

from __future__ import annotations

import os
import queue
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import IO

import yaml

from pneumo_ros.errors import PneumoError
from pneumo_ros.parameters import Value
from pneumo_ros.session.middleware import middleware_settings

SUPERVISOR = "PNEUMO_SUPERVISOR"  # environment variable: process whose end ends the nodes as well
PROGRESS = "PROGRESS "
POLL = 0.02  # s
FATAL = "Fatal Python error"  # begins what the interpreter prints of a crash: threads and modules follow
LOGGED = re.compile(r"\[(DEBUG|INFO|WARN|ERROR|FATAL)\] \[")  # how rcl's logger begins a line
STOP_PATIENCE = 10.0  # s a process has to end after SIGINT before it is killed; its last messages may take 7 s
RECORDER_PATIENCE = 60.0  # s; a slow disk may still be taking the log
START_PATIENCE = 60.0  # s until the first sample; the first start on a machine compiles the plant
RECORDER = "session_recorder"
END_REASON = "PNEUMO_END_REASON"  # environment variable: file in which the supervisor says why a session failed


def noted_failure() -> str:
    """Why the session failed, as its supervisor (or launch) left it to this node; '' if it did not."""
    note = os.environ.get(END_REASON)
    return Path(note).read_text(encoding="utf-8") if note and Path(note).exists() else ""


class SessionError(PneumoError):
    """A node of the session ended by itself."""


class StopAsked(Exception):  # noqa: N818  it is a wish, not an error
    """Somebody asked the session to end: Ctrl-C, SIGTERM, or a terminal that was closed."""


STOPPING = {signal.SIGINT: "the user", signal.SIGTERM: "SIGTERM", signal.SIGHUP: "SIGHUP (closed terminal)"}


@dataclass(frozen=True)
class Place:
    """Where in the ROS graph a session runs.

    Attributes
    ----------
    domain_id : DDS domain
    namespace : of its nodes and topics, '' or of the form /rig1
    descriptors : files that stay open in every node, so that the place counts as taken until the last one has ended
    """

    domain_id: int | None = None
    namespace: str = ""
    descriptors: tuple[int, ...] = ()

    def arguments(self) -> list[str]:
        """ROS arguments of a node. /clock is absolute by convention; each session has its own."""
        if not self.namespace:
            return []
        return ["--remap", f"__ns:={self.namespace}", "--remap", "/clock:=clock"]


@dataclass
class NodeProcess:
    """A process of the session: which nodes it holds, how it is called, and what it said last."""

    name: str
    module: str
    process: subprocess.Popen[str] | None = None
    said: list[str] = field(default_factory=list)

    def last_words(self) -> str:
        """Its last line, or the first of a crash's dump; what its logger says is of the way, not of the end."""
        lines = [line for line in self.said if line.strip() and not line.startswith(PROGRESS)]
        plain = [line for line in lines if not LOGGED.match(line)]
        fatal = [line for line in plain if line.startswith(FATAL)]
        return (fatal[:1] or plain[-1:] or [""])[0].strip()


def write_parameters(values: Mapping[str, Mapping[str, Value]], folder: Path) -> Path:
    """A ROS 2 parameter file: node -> name -> value."""
    path = folder / "parameters.yaml"
    # In whatever namespace the nodes are.
    document = {f"/**/{node}": {"ros__parameters": dict(own)} for node, own in values.items()}
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


class Supervisor:
    """The processes of one session.

    Parameters
    ----------
    nodes : one process each, in the order they are stopped; the recorder is always stopped last
    parameters : node -> name -> value
    lead : process whose end with exit code 0 ends the session
    place : where its nodes are in the ROS graph
    on_progress : called with the simulated time in s
    on_line : called with every other line that a node prints

    A context manager: leaving it ends every process. Between, SIGINT, SIGTERM and SIGHUP end :meth:`wait`; further ones
    change nothing, so that the log is finished however often somebody asks.
    """

    def __init__(
        self,
        nodes: Sequence[NodeProcess],
        parameters: Mapping[str, Mapping[str, Value]],
        lead: str,
        place: Place | None = None,
        on_progress: Callable[[float], None] = lambda _: None,
        on_line: Callable[[str, str], None] = lambda _, __: None,
    ) -> None:
        self._place = place or Place()
        self.nodes = list(nodes)
        self.lead = next(n for n in self.nodes if n.name == lead)
        self._parameters = parameters
        self._on_progress, self._on_line = on_progress, on_line
        self._asked_by = ""
        self._rosout = not any(own.get("mode") == "lockstep" for own in parameters.values())
        self._folder = tempfile.TemporaryDirectory(prefix="pneumo-")
        self._lines: queue.SimpleQueue[tuple[NodeProcess, str]] = queue.SimpleQueue()
        self._environment = dict(os.environ)
        self._environment |= middleware_settings(self._environment)
        if self._place.domain_id is not None:
            self._environment["ROS_DOMAIN_ID"] = str(self._place.domain_id)
        self._environment[END_REASON] = str(Path(self._folder.name) / "end_reason")
        self._environment[SUPERVISOR] = str(os.getpid())
        self._progress = -1.0

    def __enter__(self) -> Supervisor:
        file = write_parameters(self._parameters, Path(self._folder.name))
        arguments = ["--ros-args", "--params-file", str(file), *self._place.arguments()]
        if not self._rosout:  # thousands of samples a second leave no time for a topic nobody reads
            arguments.append("--disable-rosout-logs")
        for number in STOPPING:  # each of them: a background job inherits an ignored SIGINT
            signal.signal(number, self._on_signal)
        for node in self.nodes:
            node.process = subprocess.Popen(
                [sys.executable, "-m", node.module, *arguments], pass_fds=self._place.descriptors,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=self._environment,
                start_new_session=True,  # Ctrl-C reaches this process alone; it then ends the others in order
            )  # fmt: skip
            assert node.process.stdout is not None
            threading.Thread(target=self._listen, args=(node, node.process.stdout), daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: object) -> None:
        self.stop(str(error) if isinstance(error, SessionError) else "")
        self._folder.cleanup()

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self._asked_by = self._asked_by or STOPPING[signal.Signals(number)]

    def wait(self) -> None:
        """Until the lead has done its work.

        Raises
        ------
        SessionError
            naming the node that ended too early, with its exit code and last words.
        StopAsked
            naming who asked for the end.
        """
        start = time.monotonic()
        while True:
            self._hear()
            if self._asked_by:
                raise StopAsked(self._asked_by)
            for node in self.nodes:
                assert node.process is not None
                code = node.process.poll()
                if code == 0 and node is self.lead:
                    return
                if code is not None:
                    time.sleep(POLL)
                    self._hear()
                    raise SessionError(describe_end(node, code))
            if self._progress < 0.0 and time.monotonic() - start > START_PATIENCE:
                raise SessionError(f"no first sample within {START_PATIENCE:.0f} s; the nodes did not find each other")
            time.sleep(POLL)

    def stop(self, failure: str = "") -> None:
        """End every process: a signal, patience, SIGKILL; the recorder after the others, so that it hears them out.

        ``failure`` says why the session failed; the recorder writes it into the log.
        """
        if failure:
            Path(self._environment[END_REASON]).write_text(failure, encoding="utf-8")
        number = signal.SIGTERM if failure else signal.SIGINT
        others = [n for n in self.nodes if n.name != RECORDER]
        recorders = [n for n in self.nodes if n.name == RECORDER]
        for group, patience in ((others, STOP_PATIENCE), (recorders, RECORDER_PATIENCE)):
            for node in group:
                _signal(node, number)
            end = time.monotonic() + patience
            for node in group:
                _wait_or_kill(node, end)
        self._hear()

    def failure_of_lead(self) -> str:
        """What the lead had to say if it did not end well when it was stopped, else ''.

        A node that still begins has nothing that takes a signal: that it dies of the one sent here is as it was asked.
        """
        code = self.lead.process.poll() if self.lead.process is not None else None
        begun = self._progress >= 0.0
        return describe_end(self.lead, code) if code and (begun or code != -signal.SIGINT) else ""

    def _listen(self, node: NodeProcess, stream: IO[str]) -> None:
        for line in stream:
            self._lines.put((node, line))

    def _hear(self) -> None:
        while True:
            try:
                node, line = self._lines.get_nowait()
            except queue.Empty:
                return
            node.said.append(line)
            del node.said[:-200]
            if not line.startswith(PROGRESS):
                self._on_line(node.name, line.rstrip("\n"))
            else:
                self._progress = float(line[len(PROGRESS) :])
                self._on_progress(self._progress)


def describe_end(node: NodeProcess, code: int) -> str:
    """One line: which node, how it ended, what it said."""
    how = f"was killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
    words = node.last_words()
    return f"node {node.name} {how}" + (f": {words}" if words else "")


def _signal(node: NodeProcess, number: signal.Signals) -> None:
    if node.process is not None and node.process.poll() is None:
        node.process.send_signal(number)
        node.process.send_signal(signal.SIGCONT)  # a stopped process could not obey


def _wait_or_kill(node: NodeProcess, end: float) -> None:
    if node.process is None:
        return
    try:
        node.process.wait(max(0.0, end - time.monotonic()))
    except subprocess.TimeoutExpired:
        node.process.kill()
        node.process.wait()
