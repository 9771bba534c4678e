# SPDX-License-Identifier: Apache-2.0
"""Live replay on a terminal: plays a log to its end, listens to the keyboard, says how punctual it was."""

from __future__ import annotations

import contextlib
import os
import select
import sys
import termios
import time
import tty
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.signals import SignalHandlerOptions

from pneumo_ros.cli.terminal import Console
from pneumo_ros.log.decoded import Log
from pneumo_ros.nodes.replay import Player, spinning, transport_of
from pneumo_ros.nodes.spin import SignalStop

DISCOVERY = 1.0  # s for subscribers to find the publishers before the first message
KEYS = "space: pause/go on   . : one sample   , / ; : 1 s back/ahead   + - : faster/slower   q: end"


def play(
    log: Log, rate: float, start: float, paused: bool, loop: bool, everything: bool, domain_id: int | None
) -> None:
    """Play a log to its end, or until stopped; says at the end how punctual it was."""
    console = Console(highlight=False, soft_wrap=True)
    stop = SignalStop()
    context = Context()
    rclpy.init(context=context, domain_id=domain_id, signal_handler_options=SignalHandlerOptions.NO)
    player = Player(log, transport_of(log, rate, loop, paused), everything, context)
    for note in player.notes:
        console.print(f"[cyan]note[/] {note}")
    try:
        with spinning(player.node, context), _keyboard() as keys:
            console.print(f"replaying {log.path.name} at {rate:g} x" + (f"   {KEYS}" if keys is not None else ""))
            time.sleep(DISCOVERY)  # a publisher that speaks at once is not heard
            player.seek(start)
            while not stop.set and not player.transport.finished(time.monotonic_ns()):
                pause = player.advance()
                if keys is not None and _on_key(player, keys):
                    break
                time.sleep(pause)
            player.advance()
            player.flush()
    finally:
        player.node.destroy_node()
        rclpy.try_shutdown(context=context)
    console.print(describe_lateness(player.lateness))


def describe_lateness(lateness: Sequence[int]) -> str:
    """How punctual the messages were."""
    if not lateness:
        return "nothing was published"
    p50, p99 = np.percentile(lateness, [50, 99]) * 1e-6
    return f"{len(lateness)} messages, late by p50 {p50:.3f} ms, p99 {p99:.3f} ms, max {max(lateness) * 1e-6:.3f} ms"


@contextlib.contextmanager
def _keyboard() -> Iterator[Any]:
    """Single key presses where there is a terminal, else None."""
    if not sys.stdin.isatty():
        yield None
        return
    before = termios.tcgetattr(sys.stdin)
    try:
        tty.setcbreak(sys.stdin)
        yield sys.stdin
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def _on_key(player: Player, keys: Any) -> bool:
    """Act on a pressed key; True to end."""
    if not select.select([keys], [], [], 0)[0]:
        return False
    # Past the text layer, which would take further keys into a buffer that select() does not see.
    key, transport = os.read(keys.fileno(), 1).decode("ascii", "ignore"), player.transport
    wall = time.monotonic_ns()
    if key == " ":
        transport.pause(wall, not transport.paused)
    elif key == ".":
        player.step()
    elif key in ",;":
        player.seek(player.position + (1.0 if key == ";" else -1.0))
    elif key in "+-":
        transport.set_rate(wall, transport.rate * (2.0 if key == "+" else 0.5))
    return key == "q"
