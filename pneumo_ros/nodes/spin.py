# SPDX-License-Identifier: Apache-2.0
"""Run nodes until they finish or a signal asks to stop; errors end with one line and an exit code."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from types import FrameType

import rclpy
from rclpy.context import Context
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from pneumo_ros.daq.priority import freeze_startup_objects
from pneumo_ros.errors import PneumoError
from pneumo_ros.nodes.base import FAILED, RigNode, StopRequest, say
from pneumo_ros.session.supervisor import SUPERVISOR

SPIN_TIMEOUT = 0.05  # s; EventsExecutor without one holds the interpreter in the PyPI wheels: no timer ticks
LOOK_PERIOD = 0.01  # s between looks whether a stop was asked for
TICK_TIMEOUT = 2.0  # s within which a timer must tick on a working executor
BAD_INPUT = 2
ASKING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
PR_SET_PDEATHSIG = 1  # of Linux's prctl


class SignalStop(StopRequest):
    """Set by SIGINT (the session is over), SIGTERM and SIGHUP (something broke); repeating them changes nothing."""

    def __init__(self) -> None:
        super().__init__()
        for number in ASKING:
            signal.signal(number, self._on_signal)
        end_with_supervisor()

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if number != signal.SIGINT and not self.set:
            alone = SUPERVISOR in os.environ and os.getppid() != int(os.environ[SUPERVISOR])
            why = "the session's supervisor was killed" if alone else f"stopped by {signal.Signals(number).name}"
            self.failed, self.reason = True, why
        self.set = True


def ask_no_more() -> None:
    """Everything is done: who asks again must not turn an orderly end into a killed process.

    Python hands signals back to the kernel's default, which kills, while the interpreter ends; ignored ones stay so.
    """
    for number in ASKING:
        signal.signal(number, signal.SIG_IGN)


def end_with_supervisor() -> None:
    """Be sent SIGTERM at once when the supervisor's process ends, however it ends; also if it has ended already."""
    supervisor = os.environ.get(SUPERVISOR)
    if supervisor:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
        if os.getppid() != int(supervisor):
            os.kill(os.getpid(), signal.SIGTERM)


def make_executor(kind: str, context: Context | None) -> Executor:
    """``events`` or ``single``."""
    return EventsExecutor(context=context) if kind == "events" else SingleThreadedExecutor(context=context)


def check_timer_ticks(node: RigNode, executor: Executor) -> bool:
    """Whether a timer of ``node`` fires on ``executor`` within :data:`TICK_TIMEOUT`."""
    ticks: list[int] = []
    timer = node.steady_timer(0.001, lambda: ticks.append(1))
    end = time.monotonic() + TICK_TIMEOUT
    while not ticks and time.monotonic() < end:
        executor.spin_once(timeout_sec=SPIN_TIMEOUT)
    node.destroy_timer(timer)
    return bool(ticks)


def working_executor(nodes: Sequence[RigNode], context: Context | None) -> Executor:
    """The wished executor, or the single-threaded one if no timer ticks on it."""
    executor = make_executor(str(nodes[0].values["executor"]), context)
    for node in nodes:
        executor.add_node(node)
    if check_timer_ticks(nodes[0], executor):
        return executor
    nodes[0].get_logger().warning("no timer ticks on this executor; falling back to SingleThreadedExecutor")
    for node in nodes:
        executor.remove_node(node)
    executor.shutdown()
    executor = make_executor("single", context)
    for node in nodes:
        executor.add_node(node)
    return executor


def spin(nodes: Sequence[RigNode], stop: StopRequest, context: Context | None = None) -> int:
    """Spin until every node has finished or a stop is asked for; returns the worst exit code."""
    for node in nodes:
        node.stop = stop
    executor = working_executor(nodes, context)
    freeze_startup_objects()
    _spin_until(stop, nodes[0], executor)
    for node in nodes:
        node.on_stop(executor)
    code = max(node.exit_code for node in nodes)
    if stop.failed and not code:  # ended from outside
        say(f"error: {stop.reason}", sys.stderr)
    return code or (FAILED if stop.failed else 0)


def _spin_until(stop: StopRequest, node: RigNode, executor: Executor) -> None:
    """Run callbacks until a stop is asked for.

    All events in one call of the executor: on a busy computer a session is 1.5 to 2 times as fast as by spin_once
    (docs/performance.md). The call may go on as long as events come, so a timer looks for the stop; a handler of
    signals may not complete a future, whose lock the interrupted code may hold. The future is new each time because the
    executor leaves a callback in it.
    """
    asked: Future = Future()

    def look() -> None:
        if stop.set and not asked.done():
            asked.set_result(None)

    timer = node.steady_timer(LOOK_PERIOD, look)
    while not stop.set:
        asked = Future()
        executor.spin_until_future_complete(asked, SPIN_TIMEOUT)
    node.destroy_timer(timer)


def node_main(build: Callable[[], RigNode], args: list[str] | None = None) -> int:
    """Entry point of a node's executable."""
    stop = SignalStop()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = build()
        code = spin([node], stop)
        node.destroy_node()
    except PneumoError as error:
        print(f"error: {error}", file=sys.stderr)
        code = BAD_INPUT
    except ParameterException as error:
        print(
            f"error: {' '.join(str(error).split())}; see the node's parameters in docs/parameters.md", file=sys.stderr
        )
        code = BAD_INPUT
    finally:
        ask_no_more()
        rclpy.try_shutdown()
    return code
