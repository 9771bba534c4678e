# SPDX-License-Identifier: Apache-2.0
"""Time per RK4 step of the composed kernel (whole library, any two effects on) beside plain C, one run, ratios of
medians.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from itertools import combinations

import numpy as np
from kernel import PERIOD, STEPS, c_runner

from pneumo_ros.effects.composition import CORRECTIONS
from pneumo_ros.effects.parameters import is_law
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig


def main() -> None:
    """Print the ratio of the nominal path, of the composed kernel without effects, and of every pair of plant terms."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=9)
    rounds = parser.parse_args().rounds
    model = RigModel(load_rig())
    car, trim = nominal_half_car(model.rig)
    rng = np.random.default_rng(7)
    count = 4_000
    road = np.cumsum(rng.normal(0.0, 5e-5, (count + 1, 2)), axis=0)
    road -= np.linspace(0.0, 1.0, count + 1)[:, None] * road[-1]
    commands = np.tile(trim.command, (count, 1)) * rng.uniform(0.5, 1.5, (count, 4))
    none = np.zeros((0, len(CORRECTIONS)))
    slots = model.slots
    typical = np.ones((len(slots), 2, max(slot.parameters for slot in slots)))
    for k, slot in enumerate(slots):
        for effect in model.library.values():
            if effect.term is not None and effect.place_in_kernel == slot.name:
                columns = effect.columns or range(len(effect.parameters))
                typical[k, :, list(columns)] = np.array([[p.typical] for p in effect.parameters])

    def composed(active: tuple[int, ...]) -> Callable[[], np.ndarray]:
        on = np.zeros((len(slots), 2), dtype=bool)
        on[list(active)] = True
        return lambda: model.kernel(trim.state, commands, road, none, PERIOD, STEPS, car.body, car.front, car.rear,
                                    car.surface, on, typical, model.inner(), False)  # fmt: skip

    runs: dict[str, Callable[[], np.ndarray]] = {
        "plain C": c_runner(car, trim.state, commands, road),
        "nominal": lambda: car.simulate(trim.state, commands, road, PERIOD),
        "composed, no effect": composed(()),
    }
    laws = [k for k, slot in enumerate(slots) if slot.name in model.library and is_law(slot.name)]
    for pair in combinations(laws, 2):
        runs[" + ".join(slots[k].name for k in pair)] = composed(pair)
    times: dict[str, list[float]] = {name: [] for name in runs}
    for number in range(rounds + 1):
        for name, run in runs.items():
            start = time.perf_counter()
            run()
            if number:  # the first round compiles and warms
                times[name].append((time.perf_counter() - start) / (count * STEPS) * 1e9)
    medians = {name: statistics.median(values) for name, values in times.items()}
    base = medians["plain C"]
    for name in list(runs)[:3]:
        print(f"{name:45s} {medians[name]:7.1f} ns  ratio {medians[name] / base:5.2f}")
    pairs = sorted(list(runs)[3:], key=lambda name: -medians[name])
    print(f"{len(pairs)} pairs of plant terms at both ends, slowest first (limit 2.0):")
    for name in pairs[:5]:
        print(f"{name:45s} {medians[name]:7.1f} ns  ratio {medians[name] / base:5.2f}")


if __name__ == "__main__":
    main()
