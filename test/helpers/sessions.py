# SPDX-License-Identifier: Apache-2.0
"""Run real sessions in tests, each in a DDS domain of its own."""

from __future__ import annotations

import fcntl
import gc
import itertools
import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pneumo_ros.session.claim import runtime_folder

DOMAINS = 100  # 1 to 100; higher ones reach the ephemeral ports
HELD = 20  # locks a process keeps: a test needs three at most, and what it started is long over 20 domains later
_next = itertools.count()
_locks: deque[int] = deque()


def own_domain() -> int:
    """A domain id that no other test of this computer uses, whatever process it runs in, and no session has claimed."""
    for k in itertools.islice(_next, DOMAINS):
        domain = 1 + (os.getpid() * 13 + k * 7) % DOMAINS
        lock = _locked(runtime_folder() / f"test-{domain}.lock")
        if lock is None:
            continue
        session = _locked(runtime_folder() / f"domain-{domain}.lock")
        if session is None:
            os.close(lock)
            continue
        os.close(session)
        _locks.append(lock)
        if len(_locks) > HELD:
            os.close(_locks.popleft())
        return domain
    raise AssertionError("tests or sessions have every domain of this computer")


def _locked(path: Path) -> int | None:
    """Descriptor of a file that nobody else has locked; the lock ends with it."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        return None
    return descriptor


def environment() -> dict[str, str]:
    """Of a command whose words are read as on a terminal of 80 columns."""
    return {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "MPLBACKEND": "Agg", "COLUMNS": "80"}


def start(*options: str, domain: int | None = None) -> subprocess.Popen[str]:
    """`pneumo run` with options, in a domain of its own; -1 for the one that the options ask for."""
    domain = own_domain() if domain is None else domain
    place = [] if domain < 0 else ["--domain", str(domain)]
    command = [sys.executable, "-m", "pneumo_ros.cli.main", "run", *place, *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def run(*options: str, timeout: float = 120.0) -> tuple[int, str]:
    """(exit code, what it printed)."""
    process = start(*options)
    try:
        said, _ = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        process.kill()
        said, _ = process.communicate()
        raise AssertionError(f"session did not end within {timeout} s; it said:\n{said}") from None
    return process.returncode, said


def wait_for(process: subprocess.Popen[str], path: Path, size: int, timeout: float = 60.0) -> None:
    """Until a session's file has grown to ``size`` bytes; ends the session if it does not."""
    end = time.monotonic() + timeout
    while not path.exists() or path.stat().st_size < size:
        if time.monotonic() > end or process.poll() is not None:
            process.terminate()
            said, _ = process.communicate(timeout=30)
            raise AssertionError(f"{path} did not grow to {size} bytes; the session said:\n{said}")
        time.sleep(0.02)


def children(parent: int) -> dict[str, int]:
    """Node module name -> process id of a session's processes."""
    found = {}
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0")
            owner = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except (OSError, IndexError):
            continue
        if owner == parent and b"-m" in words:
            found[words[words.index(b"-m") + 1].decode().rsplit(".", 1)[-1]] = int(entry.name)
    return found


def kill(pid: int) -> None:
    """SIGKILL."""
    os.kill(pid, signal.SIGKILL)


@contextmanager
def own_context(domain: int | None = None, arguments: list[str] | None = None) -> Iterator[Any]:
    """A Context for nodes within the test's process, in a domain of its own or in that of a session.

    The arguments are those of ROS that a program of its own would get. Its nodes end with it: one that the garbage
    collector ends later, in the middle of another test, takes the publisher of /rosout from every node of its name.
    """
    import rclpy
    from rclpy.context import Context
    from rclpy.node import Node
    from rclpy.signals import SignalHandlerOptions

    context = Context()
    used = own_domain() if domain is None else domain
    rclpy.init(args=arguments, context=context, domain_id=used, signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield context
    finally:
        for node in [o for o in gc.get_objects() if issubclass(type(o), Node) and o.context is context]:
            node.destroy_node()
        context.try_shutdown()


@contextmanager
def parameters_of(domain: int, node: str, timeout: float = 20.0) -> Iterator[Callable[[str, object], str]]:
    """Sets parameters of a running node as `ros2 param set` does: (name, value) -> '' or the reason it was refused.

    One node asks for all of them: each new one would first have to be found, which may take longer than the session.
    """
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.parameter import Parameter
    from rclpy.parameter_client import AsyncParameterClient

    with own_context(domain) as context:
        asker = rclpy.create_node("asker", context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(asker)
        client = AsyncParameterClient(asker, node)
        assert client.wait_for_services(timeout), f"{node} has no parameter services"

        def ask(name: str, value: object) -> str:
            future = client.set_parameters([Parameter(name, value=value)])
            executor.spin_until_future_complete(future, timeout)
            result = future.result()
            assert result is not None, f"{node} did not answer"
            return "" if result.results[0].successful else str(result.results[0].reason)

        yield ask
