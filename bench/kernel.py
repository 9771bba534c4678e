# SPDX-License-Identifier: Apache-2.0
"""Time per RK4 step of the compiled half car beside the same equations in plain C, one run, ratio of medians."""

from __future__ import annotations

import argparse
import ctypes
import statistics
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig

HERE = Path(__file__).parent
PERIOD, STEPS = 1e-3, 2


def build_c() -> ctypes.CDLL:
    """Compile the C twin (gcc -O3, strict IEEE) and load it."""
    library = HERE / "build" / "half_car.so"
    library.parent.mkdir(exist_ok=True)
    source = HERE / "half_car.c"
    subprocess.run(["gcc", "-O3", "-march=native", "-ffp-contract=off", "-shared", "-fPIC", str(source),
                    "-o", str(library), "-lm"], check=True)  # fmt: skip
    return ctypes.CDLL(str(library))


def c_runner(car: HalfCar, x0: np.ndarray, commands: np.ndarray, road: np.ndarray) -> Callable[[], np.ndarray]:
    """A call that simulates with the C twin."""
    run = build_c().simulate
    records = [np.array(part, dtype=float) for part in (car.body, car.front, car.rear)]
    surface = car.surface
    out = np.empty((len(commands) + 1, 10))

    def pointer(array: np.ndarray) -> ctypes.c_void_p:
        return ctypes.c_void_p(array.ctypes.data)

    def call() -> np.ndarray:
        run(pointer(x0), pointer(commands), pointer(road), ctypes.c_double(PERIOD), STEPS, len(commands),
            *(pointer(r) for r in records), pointer(surface.heights), len(surface.heights),
            pointer(surface.pressures), len(surface.pressures), pointer(surface.cubics), pointer(out))  # fmt: skip
        return out

    return call


def main() -> None:
    """Print ns per step and the ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=31)
    rounds = parser.parse_args().rounds
    car, trim = nominal_half_car(load_rig())
    rng = np.random.default_rng(7)
    count = 10_000
    road = np.cumsum(rng.normal(0.0, 5e-5, (count + 1, 2)), axis=0)
    road -= np.linspace(0.0, 1.0, count + 1)[:, None] * road[-1]
    commands = np.tile(trim.command, (count, 1)) * rng.uniform(0.5, 1.5, (count, 4))
    in_c = c_runner(car, trim.state, commands, road)

    def in_python() -> np.ndarray:
        return car.simulate(trim.state, commands, road, PERIOD)

    worst = np.max(np.abs(in_python() - in_c()) / np.std(in_c(), axis=0))
    times: dict[str, list[float]] = {"numba": [], "C": []}
    for _ in range(rounds):
        for name, call in (("numba", in_python), ("C", in_c)):
            start = time.perf_counter()
            call()
            times[name].append((time.perf_counter() - start) / (count * STEPS) * 1e9)
    medians = {name: statistics.median(values) for name, values in times.items()}
    print(f"largest difference numba - C: {worst:.1e} of a signal's std")
    for name, value in medians.items():
        print(f"{name:6s} {value:7.1f} ns per RK4 step (median of {rounds})")
    print(f"ratio  {medians['numba'] / medians['C']:7.2f} (limit 1.3)")


if __name__ == "__main__":
    main()
