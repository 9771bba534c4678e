# SPDX-License-Identifier: Apache-2.0
"""The true budget of a case: adds up, gives to each what it makes; curves are those of the law that acts."""

from __future__ import annotations

import numpy as np
import pytest

from pneumo_ros.casemaker import budget as b
from pneumo_ros.casemaker.bench import bench
from pneumo_ros.casemaker.case import simulated
from pneumo_ros.casemaker.curves import curve_of
from pneumo_ros.casemaker.form import STATED, WANTED
from pneumo_ros.casemaker.gap_size import NUISANCE
from pneumo_ros.casemaker.laws import slots
from pneumo_ros.casemaker.open_loop import shown
from pneumo_ros.casemaker.parameters import RicherRig, richer_rig
from pneumo_ros.casemaker.planned import Planned
from pneumo_ros.casemaker.registry import at_ends, in_frame, with_law
from pneumo_ros.casemaker.scene import Scene, Session, observation, play

ON = bench()
RICHER = richer_rig(ON.nominal, ON.references)
SCENES = (Scene("iso_c", 0.8, "levelling", "steps", 0.25, 5), Scene("sweep", 0.8, "levelling", "waves", 0.2, 6))


def both(rig: RicherRig) -> tuple[Session, Session]:
    """Fit and held-out session of a rig."""
    one, two = (play(rig, ON.nominal, scene, ON.car.surface) for scene in SCENES)
    return one, two


def test_shapley_values_add_up_and_give_a_lone_player_everything() -> None:
    value = {frozenset(): 1.0, frozenset({0}): 0.4, frozenset({1}): 0.9, frozenset({0, 1}): 0.1}
    one, two = (b._shapley(i, 2, value) for i in (0, 1))
    assert one == pytest.approx(0.5 * (0.6 + 0.8))
    assert one + two == pytest.approx(0.9)


def test_true_logs_are_the_rulers_parameters() -> None:
    names = ("sprung_mass", "pitch_inertia", "unsprung_mass_front", "unsprung_mass_rear", "tyre_stiffness_front",
             "tyre_stiffness_rear", "bushing_damping", "supply_pressure", "outlet_area_front", "outlet_area_rear",
             "effective_area_scale", "volume_scale", "discharge_coefficient")  # fmt: skip
    logs = b.true_logs({name: (1.0 if name == "volume_scale" else 0.0) for name in names})
    assert {NUISANCE[i][1] for i in np.flatnonzero(logs)} == {"volume"}
    assert logs.max() == pytest.approx(np.log(1.01))


@pytest.mark.parametrize("supply", [(2, 1e10, 5e-6), (3, 1e-7, 8e3, 0.01)], ids=["hose", "sticking_regulator"])
def test_a_rig_driven_by_its_own_log_repeats_it(supply: tuple[int, float, float]) -> None:
    rig = in_frame(at_ends(RICHER, "front", sprung_offset=1e-3, pressure_scale=1.02, leak=2e-13, open_energy=0.3),
                   tank_volume=1e-3, regulator=6e-8)  # fmt: skip
    rig = with_law(with_law(rig, "rear", slots.FRICTION, 4, 4.0, 3e-4), None, slots.SUPPLY, *supply)
    session = play(rig, ON.nominal, SCENES[0], ON.car.surface)
    seen = observation(session, ON.nominal)
    left = seen.measured - shown(rig, rig, session, ON.car.surface)
    assert np.all(np.sqrt(np.mean(left**2, axis=0)) < 1.1 * seen.noise)


@pytest.mark.slow
def test_two_effects_share_what_the_refit_leaves() -> None:
    friction = with_law(RICHER, "front", slots.FRICTION, 4, 6.0, 2e-4)

    def rig_with(members: frozenset[int]) -> RicherRig:
        rig = friction if 0 in members else RICHER
        return at_ends(rig, "rear", tyre_damping=30.0) if 1 in members else rig

    logs = both(rig_with(frozenset({0, 1})))
    seen = (observation(logs[0], ON.nominal), observation(logs[1], ON.nominal))
    found = b.budget_of(2, rig_with, logs, seen, np.zeros(len(NUISANCE)), ON.car, ON.car.surface)
    assert sum(found.shares) + found.refit == pytest.approx(1.0)
    assert min(found.shares) > 0.05
    assert found.complete < 1.1 * np.sqrt(np.mean((seen[1].noise / seen[1].measured.std(axis=0)) ** 2))
    alone = b.budget_of(2, rig_with, logs, seen, np.zeros(len(NUISANCE)), ON.car, ON.car.surface, orders=False)
    assert alone.left_out == pytest.approx(found.left_out)


def test_curves_are_the_laws_that_act() -> None:
    damped = with_law(RICHER, "front", slots.DAMPING, 2, 80.0, 0.25)
    session = play(damped, ON.nominal, SCENES[0], ON.car.surface)
    curve = curve_of("viscous_damping", "front", ("front_force",), damped, RICHER, session, ON.car.surface)
    assert curve is not None
    rate, force, weight = np.array(curve["points"]).T
    assert np.allclose(force, np.where(rate > 0.0, -80.0, -20.0) * rate, atol=0.12)
    assert 0.95 < weight.sum() <= 1.0
    bent = with_law(RICHER, "rear", slots.GAUGE, 2, 0.1, RICHER.rear.reference_pressure, 1.0)
    session = play(bent, ON.nominal, SCENES[0], ON.car.surface)
    place = ("sensor:rear_pressure",)
    curve = curve_of("pressure_scale", "rear", place, bent, RICHER, session, ON.car.surface)
    assert curve is not None
    value, error, _ = np.array(curve["points"]).T
    assert np.allclose(error, 0.1 * np.maximum(value - RICHER.rear.reference_pressure, 0.0), atol=150.0)
    assert curve_of("payload", None, ("body_heave",), bent, RICHER, session, ON.car.surface) is None


@pytest.mark.slow
def test_form_error_is_what_the_label_says_and_the_config_owns_it() -> None:
    case = Planned("x", "none", (), 0.0, (), 12, False, form=True, budgeted=True)
    label, _, configs = simulated(case, ON)
    assert label["model_form"]["stated"] == STATED
    assert label["model_form"]["true"] == pytest.approx(WANTED, rel=0.1)
    assert configs[0].model_form.value == STATED
    assert label["truth"] == []
