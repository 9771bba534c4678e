# SPDX-License-Identifier: Apache-2.0
"""Which structure the logs prefer: of as many effects the likeliest, of others the most that are evident."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.structures import scored

from pneumo_ros.diagnosis.search.selection import Scored, Thresholds, best_of_same, log_weight, select

LIMITS = Thresholds()


def test_tolerances_that_are_stretched_count_as_the_maker_states_them() -> None:
    """What leaves a little less by moving five numbers of the rig by two sigmas each is the less likely one."""
    refit = scored(900.0, 1000.0)
    leak = scored(1.0, 300.0, "leak")
    heat = replace(scored(0.9, 295.0, "heat_transfer"), stretch=5 * 2.0**2)
    assert log_weight(heat, refit) - log_weight(replace(heat, stretch=0.0), refit) == pytest.approx(-10.0)
    assert select(refit, [leak, heat], Thresholds()) is leak
    assert select(refit, [leak, replace(heat, stretch=0.0)], Thresholds()) is not leak


def test_of_laws_that_cost_as_much_the_kept_blocks_choose() -> None:
    """Two laws of friction whose fits end a tenth apart, one of them in a local minimum that the kept blocks see."""
    refit, stuck = scored(380.0, 3000.0), scored(2.93, -600.1, "coulomb_friction.presliding")
    right = scored(0.25, -600.0, "coulomb_friction.soft")
    assert select(refit, [stuck, right], LIMITS) is right
    assert select(refit, [scored(2.93, -605.0, "coulomb_friction.presliding"), right], LIMITS) is not right


def test_of_the_same_laws_a_dearer_fit_is_taken_where_it_is_likelier_by_far() -> None:
    """A delay whose fit ends 110 cheaper on the fitted samples leaves 72 sigma squared of the kept ones, another 29."""
    refit = scored(900.0, 9000.0)
    cheap = replace(scored(72.0, 937.0, "transport_delay"), fitted=4.0)
    kept = replace(scored(29.5, 1048.0, "transport_delay"), fitted=4.6)
    assert best_of_same(refit, [cheap, kept]) is kept
    close = replace(kept, level=68.0)
    assert best_of_same(refit, [close, cheap]) is cheap


def test_of_the_same_laws_the_law_alone_is_taken_where_its_shape_does_no_better() -> None:
    refit, law = scored(900.0, 9000.0), scored(2.0, 100.0, "leak")
    shaped = scored(2.0, 99.5, "leak", "leak.shape")
    assert shaped.fit.candidate.laws == law.fit.candidate.laws
    assert best_of_same(refit, [shaped, law]) is law
    assert best_of_same(refit, [replace(shaped, fit=replace(shaped.fit, cost=90.0)), law]) is not law


@pytest.mark.parametrize("kept, fitted, taken", [(0.2, 0.5, True), (0.2, 0.3, False), (0.1, 0.9, False)])
def test_a_third_effect_is_shown_by_fitted_and_kept_samples_and_a_second_by_the_kept(
    kept: float, fitted: float, taken: bool
) -> None:
    refit = scored(4000.0, 9000.0)
    one, two = scored(600.0, 5000.0, "leak"), scored(100.0, 3000.0, "leak", "cg_shift")

    def richer(than: Scored, *names: str) -> Scored:
        falls = {"level": than.level * np.exp(-kept), "fitted": than.fitted * np.exp(-fitted)}
        return replace(scored(1.0, than.fit.cost - 500.0, *names), **falls)

    three = richer(two, "leak", "cg_shift", "payload")
    assert select(refit, [one, two, three], LIMITS).size == (3 if taken else 2)
    assert select(refit, [one, richer(one, "leak", "cg_shift")], LIMITS).size == 1


def test_both_ends_are_claimed_only_where_both_were_seen() -> None:
    """A stop that the front never reached in this log may still act there on another road."""
    refit, rear = scored(19.0, 1200.0), scored(0.25, -780.0, "bump_stop", site="rear")
    for cost, site in ((-780.0, "rear"), (-790.0, "both")):
        both = scored(0.25, cost, "bump_stop", site="both")
        assert select(refit, [both, rear], LIMITS).fit.candidate.parts == (("bump_stop", site),)


@pytest.mark.parametrize("relief, taken", [(10.0, False), (19.0, True)])
def test_two_effects_more_must_relieve_the_tolerances_twice_as_much(relief: float, taken: bool) -> None:
    """A load that lets them come back by ten brought a leak along that served the misfit of the first law alone."""
    refit, one = scored(140.0, 9000.0), replace(scored(0.31, -800.0, "orifice_coefficient"), stretch=20.0)
    three = replace(scored(0.30, -850.0, "orifice_coefficient", "payload", "leak"), stretch=20.0 - relief)
    assert select(refit, [one, three], LIMITS) is (three if taken else one)
    two = replace(scored(0.30, -850.0, "orifice_coefficient", "payload"), stretch=20.0 - relief)
    assert select(refit, [one, two, three], LIMITS) is two


def test_where_the_refit_leaves_little_a_right_law_leaves_less() -> None:
    """A leak of 1.2 noise floors: heat leaves a tenth of the misfit, far less than right laws leave of a large one."""
    refit = replace(scored(0.417, -625.0), fitted=0.34)
    leak = replace(scored(0.157, -973.0, "leak"), fitted=0.194, unknowns=2.0)
    heat = replace(scored(0.184, -908.0, "heat_transfer"), fitted=0.216, unknowns=1.0)
    assert log_weight(leak, refit) - log_weight(heat, refit) > 1.0
    large = replace(refit, level=41.7, fitted=34.0)
    assert abs(log_weight(leak, large) - log_weight(heat, large)) < 1.0
