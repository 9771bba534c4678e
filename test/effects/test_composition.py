# SPDX-License-Identifier: Apache-2.0
"""The composed kernel integrates the half car's own equations, and its generated text computes nothing."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

from pneumo_ros.effects import kernel
from pneumo_ros.effects.composition import _source
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.equations import derivative
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import load_rig

PERIOD, STEPS, COUNT = 2e-3, 4, 12
NONE = np.zeros((0, 9))


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig())


def driven(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """State, commands and road anywhere the rig goes, bump stop included."""
    rng, (_, trim) = np.random.default_rng(seed), nominal_half_car(load_rig())
    size = [4e-3, 0.02, 3e-3, 3e-3, 0.3, 1.0, 0.3, 0.3, 4e4, 4e4]
    commands = np.abs(trim.command * rng.uniform(-1.0, 4.0, (COUNT, 4)))
    return trim.state + size * rng.standard_normal(10), commands, rng.normal(0.0, 2e-3, (COUNT + 1, 2))


def by_derivative(x: np.ndarray, commands: np.ndarray, road: np.ndarray) -> np.ndarray:
    """The textbook's RK4 over :func:`pneumo_ros.plant.equations.derivative`."""
    car, dt, out = nominal_half_car(load_rig())[0], PERIOD / STEPS, [x]
    parts = car.body, car.front, car.rear, car.surface

    def slope(state: np.ndarray, command: np.ndarray, height: np.ndarray) -> np.ndarray:
        return np.array(derivative(tuple(map(float, state)), *map(float, command), *map(float, height), *parts))

    for i, command in enumerate(commands):
        rise = (road[i + 1] - road[i]) / STEPS
        for j in range(STEPS):
            begin = road[i] + j * rise
            k1 = slope(x, command, begin)
            k2 = slope(x + 0.5 * dt * k1, command, begin + 0.5 * rise)
            k3 = slope(x + 0.5 * dt * k2, command, begin + 0.5 * rise)
            k4 = slope(x + dt * k3, command, begin + rise)
            x = x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        out.append(x)
    return np.array(out)


@pytest.mark.parametrize("seed", range(6))
def test_the_kernel_without_effects_integrates_the_derivative_of_the_half_car(model: RigModel, seed: int) -> None:
    car = nominal_half_car(model.rig)[0]
    on, values = np.zeros((len(model.slots), 2), bool), np.ones((len(model.slots), 2, 4))
    x, commands, road = driven(seed)
    arguments = (x, commands, road, NONE, PERIOD, STEPS, car.body, car.front, car.rear, car.surface)
    wanted = by_derivative(x, commands, road)
    found = model.kernel(*arguments, on, values, model.inner(), False)
    assert np.all(np.abs(found - wanted) <= 1e-12 * np.abs(wanted).max(0))
    if seed == 0:  # the kernel over no terms at all is the same one; compiled once, so one seed
        empty = kernel.simulate(*arguments, on[:0], values[:0], model.inner()[:0], False)
        assert np.array_equal(empty, found)


def test_the_generated_text_only_composes(model: RigModel) -> None:
    """No operator but the sum of what terms add, no number but indices and the zero of a term at rest."""
    tree = ast.parse(_source(model.slots))
    functions = {f.name: f for f in tree.body if isinstance(f, ast.FunctionDef)}
    loop = functions.pop("simulate")
    assert len(functions) == 9
    for function in functions.values():
        for node in ast.walk(function):
            assert not isinstance(node, ast.BinOp | ast.UnaryOp | ast.For | ast.While | ast.Compare), ast.unparse(node)
            if isinstance(node, ast.Constant) and isinstance(node.value, float):
                assert node.value == 0.0
    text = Path(kernel.__file__).read_text(encoding="utf-8")
    written = {f.name: f for f in ast.parse(text).body if isinstance(f, ast.FunctionDef)}
    assert ast.dump(loop) == ast.dump(written["simulate"])
