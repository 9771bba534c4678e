# SPDX-License-Identifier: Apache-2.0
"""Start the processes of a session, watch them, and end them in an order that loses nothing. Knows no ROS."""

from __future__ import annotations

import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import yaml

from pneumo_ros.errors import PneumoError
from pneumo_ros.parameters import Value

SUPERVISOR = "PNEUMO_SUPERVISOR"  # environment variable: process whose end ends the nodes as well
PROGRESS = "PROGRESS "
POLL = 0.02  # s
STOP_PATIENCE = 5.0  # s a process has to end after SIGINT before it is killed
RECORDER_PATIENCE = 60.0  # s; a slow disk may still be taking the log
START_PATIENCE = 60.0  # s until the first sample; the first start on a machine compiles the plant
RECORDER = "session_recorder"
END_REASON = "PNEUMO_END_REASON"  # environment variable: file in which the supervisor says why a session failed


class SessionError(PneumoError):
    """A node of the session ended by itself."""


@dataclass
class NodeProcess:
    """A process of the session: which nodes it holds, how it is called, and what it said last."""

    name: str
    module: str
    process: subprocess.Popen[str] | None = None
    said: list[str] = field(default_factory=list)

    def last_words(self) -> str:
        """The last line it printed."""
        lines = [line for line in self.said if line.strip() and not line.startswith(PROGRESS)]
        return lines[-1].strip() if lines else ""


def write_parameters(values: Mapping[str, Mapping[str, Value]], folder: Path) -> Path:
    """A ROS 2 parameter file: node -> name -> value."""
    path = folder / "parameters.yaml"
    document = {node: {"ros__parameters": dict(own)} for node, own in values.items()}
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


class Supervisor:
    """The processes of one session.

    Parameters
    ----------
    nodes : one process each, in the order they are stopped; the recorder is always stopped last
    parameters : node -> name -> value
    lead : process whose end with exit code 0 ends the session
    domain_id : DDS domain, or None for the environment's
    on_progress : called with the simulated time in s

    A context manager: leaving it ends every process.
    """

    def __init__(
        self,
        nodes: Sequence[NodeProcess],
        parameters: Mapping[str, Mapping[str, Value]],
        lead: str,
        domain_id: int | None = None,
        on_progress: Callable[[float], None] = lambda _: None,
    ) -> None:
        self.nodes = list(nodes)
        self.lead = next(n for n in self.nodes if n.name == lead)
        self._parameters = parameters
        self._on_progress = on_progress
        self._folder = tempfile.TemporaryDirectory(prefix="pneumo-")
        self._lines: queue.SimpleQueue[tuple[NodeProcess, str]] = queue.SimpleQueue()
        self._environment = dict(os.environ)
        # A session stays on this computer unless the user opened it to the network.
        self._environment.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        if domain_id is not None:
            self._environment["ROS_DOMAIN_ID"] = str(domain_id)
        self._environment[END_REASON] = str(Path(self._folder.name) / "end_reason")
        self._environment[SUPERVISOR] = str(os.getpid())
        self._progress = -1.0

    def __enter__(self) -> Supervisor:
        file = write_parameters(self._parameters, Path(self._folder.name))
        for node in self.nodes:
            node.process = subprocess.Popen(
                [sys.executable, "-m", node.module, "--ros-args", "--params-file", str(file)],
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=self._environment,
                start_new_session=True,  # Ctrl-C reaches this process alone; it then ends the others in order
            )  # fmt: skip
            assert node.process.stdout is not None
            threading.Thread(target=self._listen, args=(node, node.process.stdout), daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: object) -> None:
        self.stop(str(error) if isinstance(error, SessionError) else "")
        self._folder.cleanup()

    def wait(self) -> None:
        """Until the lead has done its work.

        Raises
        ------
        SessionError
            naming the node that ended too early, with its exit code and last words.
        """
        start = time.monotonic()
        while True:
            self._hear()
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
                raise SessionError(f"no first sample within {START_PATIENCE:.0f} s; is another session on this domain?")
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
            if line.startswith(PROGRESS):
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


def _wait_or_kill(node: NodeProcess, end: float) -> None:
    if node.process is None:
        return
    try:
        node.process.wait(max(0.0, end - time.monotonic()))
    except subprocess.TimeoutExpired:
        node.process.kill()
        node.process.wait()
