# SPDX-License-Identifier: Apache-2.0
"""Closed loop over the serial path for as long as you like: lost frames, stamps, and the ride beside the plant's own.

``python bench/serial_loop.py [--duration 60] [--seed 1] [--calibration appendix_c_corrected]`` starts an emulated rig
on a pseudo-terminal, drives it at 1 kHz sampling and 500 Hz control, and compares the ride with the same controller,
road and plant in one compiled loop. Exit code 1 if a frame was lost, the ride is off by more than 5 %, or stamps by
more than 1 ms. ``--simulated`` runs the same frames, board, driver and control loop on a simulated clock instead:
every figure repeats to the digit, however busy the computer is, and no line or thread is involved.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "test"))

from helpers.serial_rig import PERIOD, Loop, SerialRig
from helpers.simulated_rig import Bench

from pneumo_ros.control.loop import close_loop
from pneumo_ros.daq.actuation import Mode
from pneumo_ros.daq.emulator.board import board_identity
from pneumo_ros.daq.priority import prefer_this_process
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.ride.comfort import rms
from pneumo_ros.rig import load_rig
from pneumo_ros.road import build_road

NOISES = range(1, 6)  # seeds of the sensor noise that the reference is averaged over
JUDGED = (
    "heave acceleration rms (m/s2)",
    "pitch acceleration rms (rad/s2)",
)  # heights vary by 10 % with the noise alone
TOLERANCE = 0.05
START_UP = 1.0  # s after arming that are not judged: ramp and estimator


def ride(states: np.ndarray, period: float) -> dict[str, float]:
    """rms accelerations and spring travel of a run of plant states (N, 10)."""
    rig = load_rig()
    heave = np.diff(states[:, 4]) / period
    pitch = np.diff(states[:, 5]) / period
    front = states[:, 0] + rig.front_arm.value * states[:, 1] - states[:, 2]
    rear = states[:, 0] - rig.rear_arm.value * states[:, 1] - states[:, 3]
    return {
        "heave acceleration rms (m/s2)": rms(heave),
        "pitch acceleration rms (rad/s2)": rms(pitch),
        "front height std (mm)": float(np.std(front)) * 1e3,
        "rear height std (mm)": float(np.std(rear)) * 1e3,
    }


def reference(duration: float, seed: int, loop: Loop) -> dict[str, tuple[float, float]]:
    """(mean, spread) of each figure of the same loop without a line between, over :data:`NOISES` of sensor noise.

    Spread is half of largest minus smallest, relative to the mean: what a ride varies by though nothing else changes.
    """
    rig = load_rig()
    car, _ = nominal_half_car(rig)
    heights, _ = build_road({"seed": seed}, wheelbase=rig.wheelbase).sample(
        np.arange(round(duration / PERIOD) + 1) * PERIOD
    )
    runs = [close_loop(car, rig, loop.estimator, loop.controller, heights, seed=n) for n in NOISES]
    rides = [ride(run.states[round(START_UP / PERIOD) :], PERIOD) for run in runs]
    columns = {name: np.array([r[name] for r in rides]) for name in rides[0]}
    return {name: (float(c.mean()), float(np.ptp(c) / 2 / c.mean())) for name, c in columns.items()}


def simulated(options: argparse.Namespace, loop: Loop) -> dict[str, float]:
    """The ride of driver core and board on a simulated clock."""
    road = build_road({"seed": options.seed}, wheelbase=load_rig().wheelbase)
    bench = Bench(board_identity(adc_bits=options.adc_bits), options.calibration, road=road)
    bench.controller = lambda item: bench.core.command(loop.step(item.values), item.stamp_ns, bench.now)
    loop.reset()
    bench.run(700)
    assert bench.core.arm(bench.now) == []
    bench.run(5).simulation.start_road()
    states = [bench.run(1).simulation.state for _ in range(round(options.duration * 1e3))]
    core = bench.core
    print(f"mode {core.mode.value}, lost frames {core.lost_frames}, refused commands {core.actuation.refused}")
    return ride(np.array(states)[round(START_UP * 1e3) :], 1e-3)


def compare(found: dict[str, float], wanted: dict[str, tuple[float, float]]) -> float:
    """Print both rides; the largest deviation of the figures in :data:`JUDGED`."""
    worst = 0.0
    for name, value in found.items():
        mean, spread = wanted[name]
        ratio = value / mean
        if name in JUDGED:
            worst = max(worst, abs(ratio - 1.0))
        print(f"{name:34s} serial {value:8.4f}  plant {mean:8.4f} (noise alone +-{spread:.1%})  ratio {ratio:.4f}")
    return worst


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--duration", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--calibration", default="appendix_c_corrected")
    parser.add_argument("--drift", type=float, default=100.0, help="ppm of the board's clock")
    parser.add_argument("--adc-bits", type=int, default=16)
    parser.add_argument("--simulated", action="store_true", help="on a simulated clock")
    options = parser.parse_args()
    loop = Loop()
    wanted = reference(options.duration, options.seed, loop)
    if options.simulated:
        return 1 if compare(simulated(options, loop), wanted) > TOLERANCE else 0
    print(f"raised priority: {prefer_this_process()}")
    arguments = ["--seed", str(options.seed), "--adc-bits", str(options.adc_bits)]
    with tempfile.TemporaryDirectory() as folder:
        faults = [f"drift:ppm={options.drift}"]
        with SerialRig(Path(folder), faults, arguments, loop, options.calibration) as rig:
            rig.arm()
            rig.wait(lambda core: core.mode is not Mode.ARMED, options.duration)  # a trip ends it early
            core = rig.driver.core
            trip, lost, dropped = core.trip, core.lost_frames, rig.driver.dropped_writes
            latency = np.percentile(core.intake.latencies_ns, [50, 99]) / 1e3  # type: ignore[union-attr]
        return report(rig, wanted, options, trip.message if trip else "", lost + dropped, latency)


def report(
    rig: SerialRig,
    wanted: dict[str, tuple[float, float]],
    options: argparse.Namespace,
    trip: str,
    lost: int,
    latency: np.ndarray,
) -> int:
    truth = rig.truth
    armed = truth.when("state", "armed")
    first, last = armed + START_UP * 1e9, armed + options.duration * 1e9
    inside = (truth.time_ns > first) & (truth.time_ns < last)
    found = ride(truth.states[inside], 1e-3)
    late = [m for m in rig.measurements if m.arrival_ns > min(armed + 5e9, rig.measurements[-100].arrival_ns)]
    errors = np.abs(truth.stamp_errors(late)) / 1e3
    print(
        f"samples {len(rig.measurements)}, lost or not sent {lost}, wrong values {truth.wrong_values(rig.measurements)}"
    )
    print(f"trip: {trip or 'none'}; board late p99 {np.percentile(truth.lateness_ns, 99) / 1e3:.0f} us, "
          f"max {truth.lateness_ns.max() / 1e3:.0f} us")  # fmt: skip
    p50, p99 = np.percentile(errors, [50, 99])
    print(f"frame latency p50 {latency[0]:.0f} us, p99 {latency[1]:.0f} us")
    print(f"stamp error 5 s after arming: p50 {p50:.0f} us, p99 {p99:.0f} us, max {errors.max():.0f} us")
    worst = compare(found, wanted)
    return 1 if trip or lost or worst > TOLERANCE or p99 > 1000.0 else 0


if __name__ == "__main__":
    sys.exit(main())
