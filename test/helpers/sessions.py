# SPDX-License-Identifier: Apache-2.0
"""Run real sessions in tests, each in a DDS domain of its own."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

_next = itertools.count()


def own_domain() -> int:
    """A domain id no other test of this process uses, 1 to 100 (higher ones reach the ephemeral ports)."""
    return 1 + (os.getpid() * 13 + next(_next) * 7) % 100


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


def set_parameter(domain: int, node: str, name: str, value: object, timeout: float = 20.0) -> str:
    """Set a parameter of a running node as `ros2 param set` does; '' or the reason it was refused."""
    import rclpy
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.parameter import Parameter
    from rclpy.parameter_client import AsyncParameterClient

    context = Context()
    rclpy.init(context=context, domain_id=domain)
    try:
        asker = rclpy.create_node("asker", context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(asker)
        client = AsyncParameterClient(asker, node)
        assert client.wait_for_services(timeout), f"{node} has no parameter services"
        future = client.set_parameters([Parameter(name, value=value)])
        executor.spin_until_future_complete(future, timeout)
        result = future.result()
        assert result is not None, f"{node} did not answer"
        return "" if result.results[0].successful else str(result.results[0].reason)
    finally:
        context.try_shutdown()
