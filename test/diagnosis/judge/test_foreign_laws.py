# SPDX-License-Identifier: Apache-2.0
"""Laws that the library does not hold, several effects at once, and what no family holds: verdict, budget, curve."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.own_logs import QUICK, drawn, log

from pneumo_ros.diagnosis.diagnose import Options, diagnose
from pneumo_ros.diagnosis.half_car.from_logs import flexible_search
from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.rig import load_rig

REBOUND = 60.0  # N s/m, in extension only: the library's damper is the same both ways


@pytest.fixture(scope="module")
def model() -> RigModel:
    return RigModel(load_rig())


def atoms(model: RigModel, effect: str, site: str, **amplitudes: float) -> Active:
    """Some atoms of a place by the first word of their names: a law of another rig's own."""
    parameters = model.library[effect].parameters
    names = [p.name.replace(" ", "_").replace(".", "_") for p in parameters]
    unknown = set(amplitudes) - set(names)
    assert not unknown, f"{unknown} not among {names}"
    return Active(effect, site, tuple(amplitudes.get(name, 0.0) for name in names))


def found_on(model: RigModel, *truth: Active) -> Diagnosis:
    nuisance = drawn(model, 8)
    return diagnose(
        model,
        [log(model, 1, nuisance, truth)],
        log(model, 2, nuisance, truth),
        Options(effort=QUICK, locate=flexible_search),
    )


@pytest.fixture(scope="module")
def one_sided(model: RigModel) -> Diagnosis:
    return found_on(model, atoms(model, "anything.force", "rear", damping_out=REBOUND))


@pytest.mark.slow
def test_a_damper_that_works_in_rebound_only_is_a_damper_of_another_law(one_sided: Diagnosis) -> None:
    assert one_sided.verdict == "viscous_damping"
    (entry,) = one_sided.budget
    assert entry.side == "rear" and entry.places[0] == "rear_force" and entry.law == "differs"
    assert one_sided.gap.best < 1.5 * one_sided.gap.noise_floor


@pytest.mark.slow
def test_its_measured_curve_is_the_law(one_sided: Diagnosis) -> None:
    curve = one_sided.budget[0].curve
    assert curve is not None and (curve.x.unit, curve.y.unit) == ("m/s", "N")
    rate, force, low, high, weight = curve.points.T
    dense = weight > 0.25 * weight.max()
    law = -REBOUND * np.maximum(rate, 0.0)
    # The bushing's own tolerance, 7.5 N s/m, is a part of any damper: the law is known to that.
    assert np.max(np.abs(force - law)[dense]) < 0.15 * np.ptp(law[dense])
    # The band is of the parameters; a bin of finite width holds a corner as a mean.
    assert np.mean((low <= law + 0.2) & (law - 0.2 <= high), where=dense) > 0.8


@pytest.mark.slow
def test_three_at_once_with_shares_that_add_up(model: RigModel) -> None:
    truth = (Active("coulomb_friction", "both", (10.0, 2e-4, 0.2)), Active("leak", "front", (3e-7, 0.0)),
             Active("lvdt_scale", "sprung_rear", (0.04,)))  # fmt: skip
    found = found_on(model, *truth)
    assert found.verdict == "coulomb_friction+leak+lvdt_scale"
    assert all(entry.probability > 0.5 for entry in found.budget)
    rest = 0.0 if found.remainder is None else found.remainder.share
    whole = sum(entry.share for entry in found.budget) + found.refit_share + rest + found.floor_share
    assert whole == pytest.approx(1.0, abs=0.01)


@pytest.mark.slow
def test_a_force_that_no_family_makes_is_not_named(model: RigModel) -> None:
    """A strap that pulls above a height: force at the strut, of no family's shape."""
    strap = atoms(model, "anything.force", "front", strap_0_0485_m=3e4, constant=6.0)
    found = found_on(model, strap)
    assert found.verdict == "unknown" or found.probability < 0.5


def test_model_form_that_owns_the_gap_leaves_nothing_to_name(model: RigModel) -> None:
    """The same leak, once as an effect and once as what the maker holds his model form to be worth."""
    owned = RigModel(load_rig().with_values(model_form=0.2))
    nuisance, leak = drawn(model, 8), (Active("leak", "front", (2e-8, 0.0)),)
    records = [log(owned, seed, nuisance, leak) for seed in (1, 2)]
    assert diagnose(owned, records[:1], records[1], Options(effort=QUICK, pairs=False)).verdict == "none"
