# SPDX-License-Identifier: Apache-2.0
"""The recorded road through the rig's model, in closed loop with today's estimator and controller: the plant reacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from pneumo_ros.control.half_car import PROFILE, build_controller
from pneumo_ros.control.loop import close_loop
from pneumo_ros.errors import InputError
from pneumo_ros.estimation.half_car import build_estimator
from pneumo_ros.log import topics
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.inspection import read_setups, seed_of
from pneumo_ros.plant.stepping import SteppedRig, plain_rig
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.printable import printable
from pneumo_ros.rig import Rig, load_rig
from pneumo_ros.rig.channels import CHANNELS, UNITS
from pneumo_ros.session.picture import save_figure
from pneumo_ros.session.replay import Overrides, control_period, has, measurements, plan, track
from pneumo_ros.session.stages import ControllerStage, EstimatorStage, Stage

Build = Callable[[Rig, float], SteppedRig]  # a rig and its period, s


@dataclass(frozen=True)
class Rerun:
    """A closed-loop run on the recorded road.

    Attributes
    ----------
    time : (N,) s from the first road sample used
    channels : (N, 6) measured channels as simulated, :data:`~pneumo_ros.rig.channels.CHANNELS`
    command : (N, 4) m2
    recorded_time, recorded : (M,), (M, 6) the log's own, on the same clock
    notes : what was assumed
    """

    time: NDArray[np.float64]
    channels: NDArray[np.float64]
    command: NDArray[np.float64]
    recorded_time: NDArray[Any]
    recorded: NDArray[np.float64]
    notes: tuple[str, ...]


def rerun(
    log: Log,
    overrides: Overrides | None = None,
    rig: Rig | None = None,
    build: Build | None = None,
    valves: Path | None = None,
) -> Rerun:
    """Run the recorded road through a rig, from rest.

    Parameters
    ----------
    log : with /road/profile and the measurements
    overrides : node -> parameter -> value, over the recorded parameters
    rig : in place of the log's
    build : makes the rig to step, for one with effects; without it the nominal equations run
    valves : the profile that the session played, if it played one

    Raises
    ------
    InputError
        if the road or the measurements are missing.
    """
    if not has(log, topics.ROAD):
        raise InputError("no road in the log", where=log.path, key=topics.ROAD.name, remedy="record /road/profile")
    notes: list[str] = []
    setups = list(read_setups(log))
    rig, period = rig or log.config or load_rig(), control_period(log, setups, notes)
    given = overrides or {}
    values = {
        node: plan(setups, node, given.get(node, {}), notes, valves).start for node in ("estimator", "controller")
    }
    measured = measurements(log)
    start = int(measured.stamp_ns[0])
    road = _road(log, start, int(measured.stamp_ns[-1]), period)
    seed = int(seed_of(log).get("plant", 0))
    if values["controller"]["controller"] == PROFILE:
        build = build or plain_rig
    if build is not None:
        stages = EstimatorStage(rig, period, values["estimator"]), ControllerStage(rig, period, values["controller"])
        noise = np.random.default_rng(seed).standard_normal((len(road) - 1, len(CHANNELS)))
        noise *= [rig.displacement_noise.value] * 4 + [rig.pressure_noise.value] * 2
        channels, commands = close_stepped(build(rig, period), stages, road, noise)
        notes += [f"the rig as diagnosed: {', '.join(one.label for one in rig.effects) or 'no effect'}"] * rig.diagnosed
    else:
        estimator = build_estimator(rig, period, values["estimator"])
        controller = build_controller(rig, period, values["controller"])
        run = close_loop(nominal_half_car(rig)[0], rig, estimator, controller, road, seed=seed)
        channels, commands = run.measurements, run.commands
    notes.append("the run starts from rest at the trim, whatever the rig was doing when the log began")
    notes.append(
        "sensor noise steers the valves: with other noise than the session's, motions differ in detail, not size"
    )
    return Rerun(
        np.arange(len(channels), dtype=np.float64) * period,
        channels,
        commands,
        (measured.stamp_ns - start) * 1e-9,
        measured.values,
        tuple(notes),
    )


def open_loop(log: Log, rig: Rig, build: Build = plain_rig) -> Rerun:
    """The recorded road and the recorded openings through a rig, from its rest: nothing reacts to anything.

    The openings that were applied count where the log has them (hardware), else the commanded ones.

    Raises
    ------
    InputError
        if road, valves or measurements are missing.
    """
    valves = topics.APPLIED if has(log, topics.APPLIED) else topics.COMMAND
    for needed in (topics.ROAD, valves):
        if not has(log, needed):
            raise InputError("not in the log, so nothing can be played", where=log.path, key=needed.name,
                             remedy=f"record {needed.name}")  # fmt: skip
    notes: list[str] = []
    period = control_period(log, list(read_setups(log)), notes)
    measured, sent = measurements(log), track(log, valves)
    start = int(measured.stamp_ns[0])
    road = _road(log, start, int(measured.stamp_ns[-1]), period)
    times = np.arange(len(road), dtype=np.float64) * period
    held = np.searchsorted((sent.stamp_ns - start) * 1e-9, times + 1e-9, side="right") - 1
    commands = sent.values[np.clip(held, 0, None)]
    stepped = build(rig, period)
    state, channels = stepped.init(), np.empty((len(road), len(CHANNELS)))
    for i in range(len(road)):
        channels[i] = stepped.read(state)
        if i + 1 < len(road):
            state = stepped.step(state, commands[i], road[i : i + 2])
    notes.append(f"open loop: the recorded road and {valves.name}; the run starts from rest at the trim, without noise")
    recorded = (measured.stamp_ns - start) * 1e-9
    return Rerun(times, channels, commands, recorded, measured.values, tuple(notes))


def close_stepped(
    rig: SteppedRig, stages: tuple[Stage, Stage], road: NDArray[np.float64], noise: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Channels (N, 6) and commands (N, 4) of a rig in closed loop, period by period.

    Parameters
    ----------
    stages : estimator and controller
    road : (N, 2) or (N + 1, 2) heights at the control periods, m
    noise : (N, 6) of the sensors
    """
    estimator, controller = stages
    channels, commands = np.empty_like(noise), np.empty((len(noise), 4))
    state, seen, commanded = rig.init(), None, None
    for i, row in enumerate(noise):
        channels[i] = np.asarray(rig.read(state)) + row
        seen, estimate = estimator.step(estimator.first(channels[i]) if seen is None else seen, channels[i])
        before = controller.first(estimate.values) if commanded is None else commanded
        commanded, command = controller.step(before, estimate.values)
        commands[i] = command.values
        if i + 1 < len(road):
            state = rig.step(state, commands[i], road[i : i + 2])
    return channels, commands


def _road(log: Log, begin_ns: int, end_ns: int, period: float) -> NDArray[np.float64]:
    """Heights (N, 2) at the control periods, linear between the recorded samples."""
    recorded = track(log, topics.ROAD)
    order = np.argsort(recorded.stamp_ns, kind="stable")
    known = (recorded.stamp_ns[order] - begin_ns) * 1e-9
    wanted = np.arange(0.0, (end_ns - begin_ns) * 1e-9 + 0.5 * period, period)
    return np.column_stack([np.interp(wanted, known, recorded.values[order, k]) for k in range(2)])


def compare_channels(result: Rerun) -> list[tuple[str, str, float, float, float]]:
    """(channel, unit, std as recorded, std of the run, rms difference over the recorded std) of each channel."""
    rows = []
    for k, (name, unit) in enumerate(zip(CHANNELS, UNITS, strict=True)):
        ours = np.interp(result.recorded_time, result.time, result.channels[:, k])
        recorded = result.recorded[:, k]
        spread = float(recorded.std())
        gap = float(np.sqrt(np.mean((ours - recorded) ** 2)))
        rows.append((name, unit, spread, float(result.channels[:, k].std()), gap / spread if spread else float("nan")))
    return rows


def draw_rerun(result: Rerun, path: Path, title: str, label: str = "closed loop, model") -> None:
    """The measured channels as recorded and as run again, as a PNG."""
    figure, axes = plt.subplots(len(CHANNELS), 1, figsize=(11, 13), sharex=True, constrained_layout=True)
    for k, (axis, name, unit) in enumerate(zip(axes, CHANNELS, UNITS, strict=True)):
        factor, shown = (1e3, "mm") if unit == "m" else (1e-3, "kPa")
        axis.plot(result.recorded_time, result.recorded[:, k] * factor, color="#999999", lw=1.8, label="recorded")
        axis.plot(result.time, result.channels[:, k] * factor, color="#d62728", lw=0.8, label=label)
        axis.set_ylabel(f"{name}\n({shown})")
        axis.grid(alpha=0.3)
        axis.margins(x=0)
    axes[0].legend(loc="upper right", ncols=2)
    axes[-1].set_xlabel("time (s)")
    figure.suptitle(printable(title), fontsize=10, parse_math=False)
    save_figure(figure, path)
