# SPDX-License-Identifier: Apache-2.0
"""What estimator and controller steps cost, called from Python, beside a plant period: python bench/control_step.py.

Medians of interleaved rounds in one run; the ratios are what compares between machines.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np

from pneumo_ros.control.half_car import build_controller
from pneumo_ros.estimation.half_car import build_estimator
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig

PERIOD, ROUNDS, CALLS = 0.002, 21, 2000


def main() -> None:
    """Print microseconds per call and the ratio to the plant."""
    rig = load_rig()
    car, at_rest = nominal_half_car(rig)
    estimator, controller = build_estimator(rig, PERIOD), build_controller(rig, PERIOD)
    x = at_rest.state
    sample = np.array([*(x[0] + arm * x[1] for arm in (rig.front_arm.value, -rig.rear_arm.value)), *x[2:4], *x[8:]])
    state, estimate = estimator.step(estimator.init(sample), sample)
    control, road, command = controller.init(), np.zeros((2, 2)), at_rest.command
    calls: dict[str, Callable[[], object]] = {
        "plant, one period": lambda: car.advance(x, command, road, PERIOD),
        "estimator step": lambda: estimator.step(state, sample),
        "controller step": lambda: controller.step(control, estimate),
    }
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            start = time.perf_counter()
            for _ in range(CALLS):
                call()
            times[name].append((time.perf_counter() - start) / CALLS)
    medians = {name: statistics.median(values) for name, values in times.items()}
    for name, value in medians.items():
        print(f"{name:20s} {1e6 * value:6.2f} us   {value / medians['plant, one period']:5.2f} of the plant")


if __name__ == "__main__":
    main()
