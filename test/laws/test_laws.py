# SPDX-License-Identifier: Apache-2.0
"""Laws of mechanisms: what they are by hand and by another integrator, and that both libraries are made of them."""

from __future__ import annotations

import ast
import importlib
import inspect
from pathlib import Path

import numpy as np
import pytest
from helpers.folders import ROOT
from scipy.integrate import solve_ivp

from pneumo_ros import laws
from pneumo_ros.effects import composition
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.laws import contact, damping, filters, flow, friction, hysteresis, memory, ringing, signal
from pneumo_ros.rig import load_rig
from pneumo_ros.slots.half_car import SLOT_FAMILIES
from pneumo_ros.units import ATMOSPHERE

EFFECTS, SLOTS = ROOT / "pneumo_ros" / "effects", ROOT / "pneumo_ros" / "slots"


@pytest.mark.parametrize("growth", [-0.9, 0.0, 0.5, 1.0, 1.375])
def test_a_bouc_wen_memory_is_exact_over_a_monotonic_move(growth: float) -> None:
    """The closed form solves the one equation, with a corner of sharpness 1."""
    rng = np.random.default_rng(3)
    for start, moved in rng.uniform(-2.0, 2.0, (5, 2)).tolist():
        side = float(np.sign(moved))

        def rate(_: float, z: np.ndarray, side: float = side) -> list[float]:
            return [side * hysteresis.slope(float(z[0]), side, 1.0, 1.0 - growth, 1.0 + growth)]

        other = solve_ivp(rate, (0.0, abs(moved)), [start], rtol=1e-10, atol=1e-12).y[0, -1]
        assert hysteresis.moved_on(start, moved, growth) == pytest.approx(other, abs=1e-7)


def test_both_ways_along_a_hysteresis_are_one_law() -> None:
    """Substeps of a corner of any sharpness end where the closed form does, where that has one."""
    z = closed = 0.0
    for move in (0.8, -0.5, -1.2, 2.0, -0.1):
        z, closed = hysteresis.stepped(z, move / 20000, 1.0, 1.0, 20000), hysteresis.moved_on(closed, move, 0.0)
        assert z == pytest.approx(closed, abs=1e-4)


def test_a_gap_is_one_law_in_both_forms() -> None:
    """A gap's flow, and the same over a choked hole's, differ by what makes them alike at the reference only."""
    per = flow.alike_at(3e5, ATMOSPHERE)
    for up in (2.2e5, 3e5, 6e5):
        over = flow.gap_over_hole(up, ATMOSPHERE, per)
        ratio = flow.through_gap(up, ATMOSPHERE, True, 1e5) / flow.through_gap(3e5, ATMOSPHERE, True, 1e5)
        assert over * flow.through_hole(up, ATMOSPHERE, True) / 3e5 == pytest.approx(ratio, rel=1e-12)


def test_a_gas_chokes_and_a_liquid_does_not() -> None:
    assert flow.through_hole(6e5, 1e5, True) == flow.through_hole(6e5, 3e5, True) == 6e5
    assert flow.through_hole(4.0, 0.0, False) == 2.0
    assert flow.through_hole(1e5, 6e5, True) == -6e5
    near = [flow.through_hole(1e5 * (1.0 + d), 1e5, True) for d in (1e-9, 1e-6, 1e-3)]
    assert near == sorted(near) and near[0] < 1.0


def test_a_stop_never_pulls_and_a_contact_that_cannot_pull_only_pushes() -> None:
    assert contact.stop(0.002, 1e4, 100.0, 0.0) == pytest.approx(24.0)
    assert contact.stop(0.002, 1e4, 0.0, -3.0) == 0.0
    assert 50.0 + contact.missing_pull(50.0, 1.0) == 50.0 and -50.0 + contact.missing_pull(-50.0, 1.0) == 0.0
    assert contact.in_play(0.003, 0.002) == 0.002


def test_damping_that_grows_is_its_two_parts() -> None:
    for rate in (-0.3, 0.2):
        parts = damping.linear(rate, 20.0) + damping.squared(rate, 20.0 * 0.5)
        assert damping.growing(rate, 20.0, 0.5) == pytest.approx(parts)
        assert damping.degressive(rate, 20.0, 1e9) == pytest.approx(damping.one_sided(rate, 20.0, 20.0))
    assert damping.one_sided(0.1, 20.0, 5.0) == 2.0 and damping.one_sided(-0.1, 20.0, 5.0) == -0.5


def test_a_bristle_ends_at_the_steady_friction() -> None:
    """After many lengths at one rate; a slider at its own; both against the rate's sign turned."""
    steady, z, s = friction.stribeck(0.01, 0.012, 0.25), 0.0, 0.0
    for _ in range(2000):
        z, s = friction.bristle(z, 0.01, 2e-4, steady, 1e-3), friction.slid(s, 0.01)
    assert z == pytest.approx(steady) and s == 1.0
    assert friction.bristle_force(z, 0.01, 6.0, 15.0) == pytest.approx(6.0 * steady)
    assert friction.stribeck(0.0, 0.012, 0.25) == 1.25 and friction.stribeck(1.0, 0.012, 0.25) == 1.0
    assert friction.turned(-1.0, 0.01) == -1.0


def test_what_rings_does_so_by_the_law_that_pulls_at_it() -> None:
    """The exact step about a suspension at held speed is the solution of the acceleration that it is pulled with."""
    w, ratio, free, dt, rate = 60.0, 0.1, 0.3, 2e-3, 0.2
    x, v, to = 0.001, 0.05, 0.004  # the suspension half a step later

    def slope(t: float, y: np.ndarray) -> list[float]:
        stretch, own = to + (t - 0.5 * dt) * rate - y[0], rate - y[1]
        between = ringing.pulled(stretch, own, w, ratio, 1.0 - free)
        return [y[1], between - 2.0 * ratio * w * free * y[1]]

    until = solve_ivp(slope, (0.0, dt), [x, v], rtol=1e-11, atol=1e-14).y[:, -1]
    # The step's suspension stands half a step back at the state's instant and ends half a step on.
    assert ringing.swung(x, v, to, rate, w, ratio, free, dt) == pytest.approx(tuple(until), rel=1e-7)


def test_memories_relax_and_openings_open() -> None:
    assert memory.relaxed(1.0, 0.0, 2.0, 2.0) == pytest.approx(np.exp(-1.0))
    assert flow.relieved(2.0, 3.0) == 0.0 and flow.relieved(5.0, 3.0) == 2.0
    assert flow.through_opening(4.0, 0.0, 4.0, 1.0) == pytest.approx(4.0)
    assert flow.in_excess(2.0, 0.1, 0.5, 0.2) == pytest.approx(0.22)
    assert flow.settling(0.5, 10.0) == 0.05


def test_a_vessel_fills_with_the_root_of_the_difference_either_way() -> None:
    """W goes with sqrt(dP) where differences are small against the pressure; near none it is linear."""
    at_scale = flow.filling(3e5 + 1e3, 3e5, 1e3, 0.05)
    assert at_scale == pytest.approx(1e3 / 0.05, rel=0.03)
    assert flow.filling(3e5 + 4e3, 3e5, 1e3, 0.05) == pytest.approx(2.0 * at_scale, rel=0.03)
    assert flow.filling(3e5, 3e5 + 1e3, 1e3, 0.05) == -at_scale
    assert flow.filling(3e5 + 0.1, 3e5, 1e3, 0.05) == pytest.approx(5.0 * 0.1 / 0.05, rel=0.01)


def test_errors_of_a_signal_undo_and_agree() -> None:
    u = np.linspace(-2.0, 2.0, 41)
    assert np.allclose(signal.scaled(u, 0.1), signal.scaled_about(u, 0.1, 0.0), rtol=1e-15)
    assert np.allclose(signal.unscaled(signal.scaled(u, 0.1), 0.1), u, rtol=1e-15)
    assert np.allclose(signal.unscaled_about(signal.scaled_about(u, 0.1, 0.7), 0.1, 0.7), u, atol=1e-15)
    assert signal.scaled_about(np.array([0.7]), 0.1, 0.7)[0] == 0.7
    assert np.array_equal(signal.bent(u, (2,), (0.5,)), 0.5 * u**2)
    assert np.array_equal(u - signal.dead(u, 0.5), np.sign(u) * np.maximum(np.abs(u) - 0.5, 0.0))
    assert signal.crept(np.array([0.0, 3.0]), 3.0) == pytest.approx([0.0, 1.0 - np.exp(-1.0)])


def test_two_lags_in_a_row_are_one_of_the_second_order() -> None:
    u = np.cumsum(np.random.default_rng(1).normal(size=2000)) * 1e-2
    once = filters.lagged_line(u, 1e-3, 0.02, 1.0)[0]
    twice = filters.first_order_line(filters.first_order_line(u, 1e-3, 0.02)[0], 1e-3, 0.02)[0]
    assert np.max(np.abs(once - twice)) < 1e-4 * np.std(u)
    assert np.allclose(filters.delayed_line(u, 1e-3, 0.005)[5:], u[:-5])
    half, kept = filters.play(u[:700], 0.1)
    assert np.array_equal(np.concatenate([half, filters.play(u[700:], 0.1, kept)[0]]), filters.play(u, 0.1)[0])


def names_used(path: Path) -> set[str]:
    """``module.function`` of the laws that a file imports."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return {
        f"{node.module.rpartition('.')[2]}.{name.name}"
        for node in nodes
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("pneumo_ros.laws.")
        for name in node.names
    }


@pytest.mark.parametrize("effect", SLOT_FAMILIES)
def test_what_an_effect_and_a_family_share_is_one_function(effect: str) -> None:
    """As docs/families.md has it: the half car's file and the slots' import the same, and what it names exists."""
    one = SLOT_FAMILIES[effect]
    of_slots = {name for path in SLOTS.glob("*.py") for name in names_used(path)}
    shapes = {name for path in (EFFECTS / "shapes").glob("*.py") for name in names_used(path)}
    assert set(one.laws) <= of_slots
    called = names_used(EFFECTS / "library" / f"{effect}.py") | shapes
    growing = {"damping.linear"} if "damping.growing" in called else set()  # made of it
    assert set(one.laws) <= called | growing
    assert one.laws or one.differs, "what nothing is shared of says why"
    quoted = one.differs.split("`")[1::2]
    for name in (*one.laws, *(q for q in quoted if "." in q)):
        module, function = name.split(".")
        assert callable(getattr(importlib.import_module(f"pneumo_ros.laws.{module}"), function))


def test_no_kernel_of_a_family_is_compiled_past_a_change_of_a_law() -> None:
    """What is kept of a compiled kernel is named by the content of every law's file."""
    slots = RigModel(load_rig()).slots
    assert set(laws.sources()) <= set(composition._files(slots))
    assert {Path(inspect.getsourcefile(hysteresis) or "").name, "signal.py"} <= {Path(p).name for p in laws.sources()}
