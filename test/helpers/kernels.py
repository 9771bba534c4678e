# SPDX-License-Identifier: Apache-2.0
"""Compiles what the tests run, into the caches that every process of theirs reads.

Two processes that share the files of tests would each compile the same kernels, and so would every node of the first
session: once, beside the linters, costs a minute less. What is not here is compiled by the first test that needs it.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from helpers.fmus import built, frame_log, with_names
from helpers.own_logs import log
from helpers.own_rigs import cart_log, written
from pneumo_ros.casemaker.bench import bench
from pneumo_ros.casemaker.parameters import richer_rig
from pneumo_ros.casemaker.scene import Scene, play
from pneumo_ros.control.half_car import build_controller
from pneumo_ros.control.loop import close_loop
from pneumo_ros.diagnosis.half_car.where import locate
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.effects.stepping import stepped_rig
from pneumo_ros.estimation.half_car import build_estimator
from pneumo_ros.own_rig.from_files import prepared
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig

PERIOD = 2e-3  # s


def half_car() -> None:
    """The plant, its closed loop, the composed kernel, the search for places, and a rig in steps."""
    rig = load_rig()
    car, at_rest = nominal_half_car(rig)
    close_loop(car, rig, build_estimator(rig, PERIOD), build_controller(rig, PERIOD), np.zeros((20, 2)), seed=1)
    stepped = stepped_rig(rig, PERIOD)
    state = stepped.step(stepped.init(), at_rest.command, np.zeros((2, 2)))
    stepped.truth(state, at_rest.command, np.zeros(2))
    model = RigModel(rig)
    one = log(model, 1)
    locate(model, [one], one)


def cases() -> None:
    """The case maker's rig."""
    on = bench()
    scene = Scene("iso_c", 0.8, "levelling", "steps", 0.25, 5)
    play(richer_rig(on.nominal, on.references), on.nominal, scene, on.car.surface)


def own_rigs(folder: Path) -> None:
    """A rig.py, and an FMU of each version and interface."""
    prepared(written(folder), [cart_log(folder / "cart.csv", 1.0)])
    frame = frame_log(folder / "frame.csv")
    for version in (2, 3):
        for interface in ("ModelExchange", "CoSimulation"):
            prepared(with_names(built(folder / f"{interface}{version}.fmu", version, (interface,))), [frame])


if __name__ == "__main__":
    half_car()
    cases()
    with tempfile.TemporaryDirectory() as made:
        own_rigs(Path(made))
