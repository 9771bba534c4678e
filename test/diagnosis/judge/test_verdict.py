# SPDX-License-Identifier: Apache-2.0
"""From scores to a verdict: what makes an effect accepted, unknown, or nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.structures import scored

from pneumo_ros.diagnosis.judge.closable import EffectEvidence
from pneumo_ros.diagnosis.judge.verdict import (
    Calibration,
    HeldOutGaps,
    Opinion,
    beyond,
    judge,
    structures,
    unexplained,
)
from pneumo_ros.diagnosis.search.selection import SHARPNESS, Scored, Thresholds, log_weight, select

CALM = HeldOutGaps(1.2, 1.1)
LIMITS = Thresholds()
CONSTANTS = Calibration()


def evidence(
    chosen: Scored, without: float, own: float, ceiling: float, at_bounds: float = 0.0
) -> list[EffectEvidence]:
    """For each effect: rms gap without it, with it, and with anything at its place."""
    squares = (without**2, own**2, ceiling**2)
    laws = chosen.fit.candidate.laws
    return [EffectEvidence(law, ("front_force",), *squares, at_bounds=at_bounds) for law in laws]


def opinion(
    refit: Scored,
    *others: Scored,
    held: HeldOutGaps = CALM,
    at_bounds: float = 0.0,
    gaps: tuple[float, float, float] = (1.0, 0.1, 0.1),
) -> Opinion:
    chosen = select(refit, others, LIMITS)
    return judge(refit, others, chosen, Calibration(), held, evidence(chosen, *gaps, at_bounds))


def test_what_chance_wins_is_none() -> None:
    found = opinion(scored(0.20, -900.0), scored(0.17, -970.0, "tyre_damping", unknowns=31))
    assert found.verdict == "none" and found.probability > 0.9


def test_a_small_effect_that_costs_far_more_than_chance_is_named() -> None:
    found = opinion(scored(0.46, -760.0), scored(0.17, -1160.0, "leak", unknowns=32), held=HeldOutGaps(1.6, 1.0))
    assert found.verdict == "leak" and found.probability > 0.9


def test_two_names_that_fit_alike_share_the_probability() -> None:
    rivals = scored(0.16, -1150.0, "valve_lag", unknowns=32), scored(0.16, -1146.0, "transport_delay", unknowns=31)
    found = opinion(scored(17.0, 1200.0), *rivals, held=HeldOutGaps(8.0, 1.1))
    assert {found.verdict} <= {"valve_lag", "transport_delay"} and 0.5 < found.probability < 0.8


def test_families_that_leave_what_laws_leave_are_told_apart_by_what_they_need() -> None:
    """A leak of another law and an orifice with six unknowns more both close all but a thousandth of the misfit."""
    refit, leak = scored(550.0, 3450.0), scored(0.39, -392.0, "leak", unknowns=32)
    orifice = scored(0.235, -740.0, "orifice_coefficient", unknowns=38)
    found = opinion(refit, orifice, leak, held=HeldOutGaps(20.0, 1.4))
    assert found.verdict == "leak" and found.of("orifice_coefficient") > 0.01
    far = opinion(refit, orifice, scored(9.0, 1360.0, "leak", unknowns=32), held=HeldOutGaps(20.0, 1.4))
    assert far.verdict == "orifice_coefficient" and far.of("leak") < 1e-3


def test_what_is_no_likelier_than_not_is_left_out_beside_what_is() -> None:
    """A leak, beside a load or a shift that leave as much: no one of the two is likelier than not."""
    refit, chosen = scored(400.0, 3000.0), scored(0.60, -500.0, "leak", "payload", unknowns=34)
    rivals = chosen, *(scored(0.60, -500.0, "leak", other, unknowns=34) for other in ("cg_shift", "dead_volume"))
    found = judge(refit, rivals, chosen, CONSTANTS, HeldOutGaps(20.0, 1.4), evidence(chosen, 1.0, 0.1, 0.1))
    assert found.effects["payload", "front"] < 0.5 < 0.9 < found.effects["leak", "front"]
    assert found.verdict == "leak" and found.probability > 0.9
    alone = scored(0.60, -500.0, "payload", unknowns=32)
    rivals = alone, *(scored(0.60, -500.0, other, unknowns=32) for other in ("cg_shift", "dead_volume"))
    found = judge(refit, rivals, alone, CONSTANTS, HeldOutGaps(20.0, 1.4), evidence(alone, 1.0, 0.1, 0.1))
    assert found.verdict == "payload" and found.probability < 0.5


def test_where_none_is_likelier_than_not_one_far_behind_the_likeliest_is_left_out() -> None:
    """In the stead of a load that no rival structure holds something elsewhere leaves a fifth of what this one does."""
    refit, chosen = scored(400.0, 3000.0), scored(0.60, -500.0, "leak", "payload", unknowns=34)
    others = [("cg_shift", "dead_volume"), ("cg_shift", "tyre_damping"), ("tyre_damping", "dead_volume")]
    rivals = chosen, *(scored(0.60, -500.0, *two, unknowns=34) for two in others)
    leak, payload = evidence(chosen, 1.0, 0.1, 0.1)
    seen = [leak, replace(payload, instead=0.2)]
    found = judge(refit, rivals, chosen, CONSTANTS, HeldOutGaps(20.0, 1.4), seen)
    assert found.effects["payload", "front"] < 0.3 < found.effects["leak", "front"] < 0.5
    assert found.verdict == "leak"
    tie = judge(refit, rivals, chosen, CONSTANTS, HeldOutGaps(20.0, 1.4), [leak, payload])
    assert tie.verdict == "leak+payload"


def test_how_many_effects_is_judged_by_the_cost() -> None:
    """A second effect that only one of six sensors sees lowers the mean a little and the cost by far: it stands."""
    refit, one = scored(800.0, 4000.0), scored(1.6, -100.0, "leak", unknowns=40)
    two = scored(0.88, -480.0, "leak", "pressure_scale", unknowns=52)
    found = opinion(refit, one, two, held=HeldOutGaps(20.0, 1.4))
    assert found.verdict == "leak+pressure_scale" and found.probability > 0.9


@pytest.mark.parametrize(
    ("beside", "instead", "named"), [(0.6, 1.0, True), (0.05, 0.9, False), (0.05, 1.5, False), (0.05, 3.0, True)]
)
def test_a_name_that_nobody_misses_beside_the_rest_is_none(beside: float, instead: float, named: bool) -> None:
    """A tyre that seemed to lift did the work of a strap at the strut; a dead zone in the drive that leaves three times
    what friction does is no rival of it.
    """
    refit, chosen = scored(400.0, 3000.0), scored(90.0, 1500.0, "tyre_liftoff", unknowns=34)
    (one,) = evidence(chosen, 1.0, 0.8, 0.75)
    told = judge(refit, [chosen], chosen, Calibration(), HeldOutGaps(20.0, 16.0),
                 [replace(one, beside=beside, instead=instead)])  # fmt: skip
    assert (told.verdict == "tyre_liftoff") is named


def test_a_family_that_closes_what_can_be_closed_is_named_however_much_is_left() -> None:
    """A law of another rig leaves a tenth or a half of the misfit; so does everything else at its place."""
    structures = scored(400.0, 3000.0), scored(90.0, 1500.0, "leak", unknowns=33)
    found = opinion(*structures, held=HeldOutGaps(20.0, 9.0), gaps=(1.0, 0.45, 0.4))
    assert found.verdict == "leak" and found.effects["leak", "front"] > 0.9


@pytest.mark.parametrize(
    ("gaps", "held", "at_bounds"),
    [
        ((1.0, 0.7, 0.1), HeldOutGaps(20.0, 14.0), 0),  # whatever acts there closes far more than its shape
        ((1.0, 1.1, 0.9), HeldOutGaps(20.0, 21.0), 0),  # worse than the refit on the held-out log
        ((1.0, 0.1, 0.1), HeldOutGaps(20.0, 1.1), 2.0),  # a law bent to its ends
    ],
)
def test_a_wrong_name_is_unknown(gaps: tuple[float, float, float], held: HeldOutGaps, at_bounds: float) -> None:
    structures = scored(400.0, 3000.0), scored(0.6, -500.0, "bellows_mode", unknowns=33)
    assert opinion(*structures, held=held, at_bounds=at_bounds, gaps=gaps).verdict == "unknown"
    calm = opinion(*structures, held=HeldOutGaps(20.0, 1.1))
    assert calm.verdict == "bellows_mode" and calm.unknown < 0.05


@pytest.mark.parametrize(("props", "verdict"), [(False, "leak+viscous_damping"), (True, "unknown")])
def test_names_that_drive_the_rig_and_hold_it_are_none(props: bool, verdict: str) -> None:
    """A frame that rubs, to a library without friction: a stiffness that drives, and a damper without which it runs
    away.
    """
    refit, pair = scored(400.0, 3000.0), scored(0.6, -500.0, "leak", "viscous_damping", unknowns=36)
    effects = [replace(one, props=props) for one in evidence(pair, 1.0, 0.1, 0.1)]
    assert judge(refit, [pair], pair, Calibration(), HeldOutGaps(20.0, 1.5), effects).verdict == verdict


def test_named_and_unnamed_stand_beside_each_other() -> None:
    """Of two effects the one whose place can be closed far better is not what the other one is."""
    refit, pair = scored(400.0, 3000.0), scored(0.6, -500.0, "leak", "bump_stop", unknowns=36)
    trusted, wrong = evidence(pair, 1.0, 0.3, 0.28)[0], evidence(pair, 0.5, 0.3, 0.05)[1]
    found = judge(refit, [pair], pair, Calibration(), HeldOutGaps(20.0, 5.0), [trusted, wrong])
    assert found.verdict == "leak" and found.effects["leak", "front"] > 0.9 > 0.5 > found.effects["bump_stop", "front"]


def test_what_the_held_out_log_does_not_miss_takes_no_name_from_another() -> None:
    """A further effect that only the fitted logs wanted: nothing is left above noise and form without it."""
    refit, chosen = scored(17.0, 1200.0), scored(0.16, -1150.0, "leak", "relaxation", unknowns=33)
    found = [EffectEvidence(law, ("front_air",), *squares, share=share) for law, squares, share in zip(
        chosen.fit.candidate.laws, ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)), (0.4, 0.5), strict=True)]  # fmt: skip
    told = judge(refit, [chosen], chosen, Calibration(), HeldOutGaps(8.0, 0.8), found)
    assert told.verdict == "leak" and told.probability > 0.9


@pytest.mark.parametrize(("leaves", "named"), [(1.1, True), (1.6, False)])
def test_a_family_may_leave_a_third_more_than_anything_leaves(leaves: float, named: bool) -> None:
    """Closing most of what can be closed is not enough for a name where a form is stated: a wrong law may do that."""
    refit, chosen = scored(17.0, 1200.0), scored(0.16, -1150.0, "viscous_damping", unknowns=32)
    one = EffectEvidence(chosen.fit.candidate.laws[0], ("front_force",), 1.0, 0.0036, 0.0, leaves=leaves)
    told = judge(refit, [chosen], chosen, Calibration(), HeldOutGaps(20.0, 1.2, 1.0), [one])
    assert (told.verdict == "viscous_damping") is named


@pytest.mark.parametrize(("gap", "verdict"), [(1.02, "none"), (1.5, "tyre_damping")])
def test_traces_that_every_rig_has_are_nothing(gap: float, verdict: str) -> None:
    """What the refit leaves two per cent above the noise floor is within what the floor itself is known to."""
    refit, chosen = scored(1.07, 100.0), scored(0.16, -300.0, "tyre_damping", unknowns=32)
    told = judge(refit, [chosen], chosen, Calibration(), HeldOutGaps(gap, 1.0), evidence(chosen, 1.0, 0.0, 0.0))
    assert told.verdict == verdict


def test_no_small_name_stands_beside_something_larger_without_one() -> None:
    """At the same place and evidently larger; elsewhere it does."""
    refit, pair = scored(400.0, 3000.0), scored(0.6, -500.0, "leak", "bump_stop", unknowns=36)
    good, bent = evidence(pair, 1.0, 0.1, 0.1)[0], evidence(pair, 1.0, 0.1, 0.1, at_bounds=2.0)[1]
    for share, place, verdict in (
        (0.9, "front_force", "unknown"),
        (0.45, "front_force", "leak"),
        (0.9, "rear_air", "leak"),
        (0.1, "front_force", "leak"),
    ):
        large = replace(bent, share=share, places=(place,))
        effects = [replace(good, share=0.4), large]
        assert judge(refit, [pair], pair, Calibration(), HeldOutGaps(20.0, 1.5), effects).verdict == verdict
    sensor = replace(good, share=0.4, places=("sensor:sprung_front",))
    elsewhere = replace(bent, share=0.9, places=("rear_air",))
    assert judge(refit, [pair], pair, Calibration(), HeldOutGaps(20.0, 1.5), [sensor, elsewhere]).verdict == "unknown"


@pytest.mark.parametrize(
    ("place", "share", "missing", "named"),
    [
        ("sensor:sprung_front", 0.6, None, False),  # one unknown motion is split between the two as it comes
        ("sensor:sprung_front", 1.0, None, True),  # what is refused holds less than half as much
        ("sensor:sprung_front", 0.6, (20.0, 2000.0), True),  # the rig's equations tell a sensor from a force
        ("sensor:sprung_front", 0.3, (20.0, 2000.0), False),  # evidently smaller
        ("front_force", 0.6, None, True),
        ("front_force", 0.08, None, False),  # what is refused holds nearly everything, this fits what it leaves
        ("front_force", 0.13, None, True),
        ("front_force", 0.08, (20.0, 2000.0), True),  # and tell place from place
    ],
)
def test_what_is_small_beside_something_elsewhere_without_a_name(
    place: str, share: float, missing: tuple[float, float] | None, named: bool
) -> None:
    refit, pair = scored(400.0, 3000.0), scored(0.6, -500.0, "lvdt_scale", "hysteresis", unknowns=36)
    good, bent = evidence(pair, 1.0, 0.1, 0.1)[0], evidence(pair, 1.0, 0.1, 0.1, at_bounds=2.0)[1]
    effects = [replace(good, share=share, places=(place,), missing=missing),
               replace(bent, share=0.4, places=("rear_air",))]  # fmt: skip
    told = judge(refit, [pair], pair, Calibration(), HeldOutGaps(20.0, 1.5), effects)
    assert told.verdict == ("lvdt_scale" if named else "unknown")


def test_nobody_holds_more_than_all() -> None:
    """What runs away without the one that is refused says nothing of what the other holds."""
    refit, pair = scored(400.0, 3000.0), scored(0.6, -500.0, "resonance", "hysteresis", unknowns=36)
    good, bent = evidence(pair, 1.0, 0.1, 0.1)[0], evidence(pair, 1.0, 0.1, 0.1, at_bounds=2.0)[1]
    for share, verdict in ((0.3, "resonance"), (0.2, "unknown")):
        effects = [replace(good, share=share), replace(bent, share=1e16, places=("rear_air",))]
        assert judge(refit, [pair], pair, Calibration(), HeldOutGaps(20.0, 1.5), effects).verdict == verdict


@pytest.mark.parametrize(
    ("level", "left", "verdict"), [(0.6, 16.0, "unknown"), (200.0, 16.0, "heat"), (0.6, 6.0, "heat")]
)
def test_a_law_that_explains_the_fitted_log_and_not_the_next_is_unknown(
    level: float, left: float, verdict: str
) -> None:
    """A chamber that leaks is warm air to a library without leaks, at a size of its own in each log."""
    refit, chosen = scored(400.0, 3000.0), scored(level, -500.0, "heat", unknowns=33)
    (one,) = evidence(chosen, 1.0, left / 20.0, left / 20.0)
    assert judge(refit, [chosen], chosen, Calibration(), HeldOutGaps(20.0, left), [one]).verdict == verdict


@pytest.mark.parametrize(("left", "named"), [(1.5, True), (9.0, False)])
def test_what_bends_a_shape_counts_the_more_the_more_is_left(left: float, named: bool) -> None:
    refit, chosen = scored(400.0, 3000.0), scored(0.6, -500.0, "bellows_mode", unknowns=36)
    bent = [replace(one, at_bounds=0.5, bent=1.0) for one in evidence(chosen, 1.0, 0.1, 0.1)]
    told = judge(refit, [chosen], chosen, Calibration(), HeldOutGaps(20.0, left), bent)
    assert told.verdict == ("bellows_mode" if named else "unknown")


@pytest.mark.parametrize(
    ("place", "own", "missing", "named"),
    [
        ("sensor:sprung_front", 0.3, None, True),
        ("sensor:sprung_front", 0.8, None, False),
        ("sensor:sprung_front", 0.8, (20.0, 15.0), False),
        ("sensor:sprung_front", 0.8, (20.0, 2000.0), True),
        ("front_force", 0.8, None, True),
    ],
)
def test_a_sensor_error_must_hold_more_than_is_left(
    place: str, own: float, missing: tuple[float, float] | None, named: bool
) -> None:
    """What moves the rig looks like an error of a sensor as well; in the rig's equations it does not."""
    refit, chosen = scored(400.0, 3000.0), scored(120.0, 1000.0, "lvdt_offset", unknowns=36)
    found = [replace(one, places=(place,), missing=missing) for one in evidence(chosen, 1.0, own, own)]
    told = judge(refit, [chosen], chosen, Calibration(), HeldOutGaps(20.0, 20.0 * own), found)
    assert told.verdict == ("lvdt_offset" if named else "unknown")


def test_a_refit_that_fails_on_the_held_out_log_is_not_none() -> None:
    assert opinion(scored(0.2, -900.0), held=HeldOutGaps(15.0, 15.0)).verdict == "unknown"


def test_where_the_kept_blocks_say_nothing_the_fit_must_say_it_by_far() -> None:
    """A stop that is hit once lies in the fitted blocks alone."""
    refit = scored(0.20, -300.0)
    assert opinion(refit, scored(0.20, -900.0, "bump_stop", unknowns=34)).verdict == "bump_stop"
    assert opinion(refit, scored(0.20, -500.0, "bump_stop", unknowns=34)).verdict == "none"
    assert opinion(refit, scored(0.25, -900.0, "bump_stop", unknowns=34)).verdict == "none"  # it spoils the others


@pytest.mark.parametrize(("form", "verdict"), [(0.9, "none"), (0.0, "unknown")])
def test_what_the_held_out_log_keeps_within_the_form_is_nothings(form: float, verdict: str) -> None:
    """One kept block of the fitted log leaves more, the held-out log less than the form is worth."""
    refit = scored(400.0, 3.0)
    assert judge(refit, [], refit, Calibration(), HeldOutGaps(0.7, 0.7, form)).verdict == verdict


def test_what_no_name_explains_is_unknown_from_its_constants_on() -> None:
    c = CONSTANTS
    assert unexplained(c.real, HeldOutGaps(1.0, 1.0), c) == pytest.approx(0.5)
    assert unexplained(2.0 * c.real, HeldOutGaps(0.3, 1.0), c) == pytest.approx(0.8)
    assert unexplained(0.0, HeldOutGaps(c.held_real, 1.0), c) == pytest.approx(0.5) and c.held_real == 3.0
    assert unexplained(0.0, HeldOutGaps(float(np.hypot(2.0 * np.sqrt(8.0), 1.0)), 1.0), c) == pytest.approx(16.0 / 17.0)
    assert unexplained(c.real, HeldOutGaps(c.held_real, 1.0), c) == pytest.approx(2.0 / 3.0)
    assert beyond(5.0, 3.0) == 4.0 and beyond(1.0, 1.0) == beyond(0.5, 1.0) == 0.0


def test_probabilities_of_structures_are_weights_that_sum_to_one() -> None:
    """By hand, of the training costs: whether anything acts, then how many effects, then which of as many."""
    c = CONSTANTS
    refit = scored(50.0, 1000.0)
    leak, lag = scored(1.0, 400.0, "leak", unknowns=32), scored(1.1, 404.0, "valve_lag", unknowns=33)
    both = scored(1.0, 395.0, "leak", "valve_lag", unknowns=35)
    found = structures(refit, [refit, leak, lag, both], leak, c)
    assert sum(found.values()) == pytest.approx(1.0)

    def weight(one: Scored, pays: float) -> float:
        return -SHARPNESS * one.price / one.samples - pays

    of_two = weight(both, c.first_penalty + c.second_penalty) - weight(leak, c.first_penalty)
    assert found[both.fit.candidate] / found[leak.fit.candidate] == pytest.approx(float(np.exp(of_two)))
    of_other = log_weight(lag, refit) - log_weight(leak, refit)
    assert found[lag.fit.candidate] / found[leak.fit.candidate] == pytest.approx(float(np.exp(of_other)))
    against = weight(leak, c.first_penalty) - weight(refit, 0.0)
    assert found[refit.fit.candidate] == pytest.approx(1.0 / (1.0 + float(np.exp(against))))
    assert structures(refit, [refit], refit, c) == {refit.fit.candidate: 1.0}


def test_places_of_one_family_share_its_probability_by_their_prices() -> None:
    refit = scored(50.0, 1000.0)
    front, rear = scored(1.0, 400.0, "leak", unknowns=32), scored(1.0, 460.0, "leak", unknowns=32, site="rear")
    lag = scored(1.3, 430.0, "valve_lag", unknowns=32)
    found = structures(refit, [front, rear, lag], front, CONSTANTS)
    ratio = found[rear.fit.candidate] / found[front.fit.candidate]
    assert ratio == pytest.approx(float(np.exp(-SHARPNESS * 60.0 / 600.0))) and 0.0 < ratio < 1.0
    alone = structures(refit, [front, lag], front, CONSTANTS)[front.fit.candidate]
    assert found[front.fit.candidate] < alone, "the other place takes its part of the family's"


@pytest.mark.parametrize("something", [True, False])
def test_what_was_selected_is_as_likely_as_its_opposite_at_least(something: bool) -> None:
    refit, leak = scored(1.0, 400.0), scored(1.0, 400.0 if something else 100.0, "leak", unknowns=32)
    found = structures(refit, [leak], leak if something else refit, CONSTANTS)
    assert found == {refit.fit.candidate: 0.5, leak.fit.candidate: 0.5}


def test_nothing_and_unknown_share_what_no_structure_takes() -> None:
    refit = scored(2.0, 400.0)
    told = judge(refit, [], refit, CONSTANTS, HeldOutGaps(2.0, 2.0))
    assert told.verdict == "unknown" and told.of("none") == pytest.approx(1.0 - told.unknown)
    assert 0.5 < told.unknown < 0.9
    leak = scored(0.2, -900.0, "leak", unknowns=32)
    without_evidence = judge(refit, [leak], leak, CONSTANTS, HeldOutGaps(20.0, 1.0), [])
    assert without_evidence.verdict == "unknown" and without_evidence.of("leak") == 0.0


def test_an_effect_that_is_taken_back_is_told_as_often_as_something_acts() -> None:
    refit, leak = scored(2.0, 400.0), scored(0.2, -900.0, "leak", unknowns=32)
    held = HeldOutGaps(2.5, 1.0)
    unknown = unexplained(refit.level, held, CONSTANTS)
    told = judge(refit, [leak], leak, CONSTANTS, held, evidence(leak, 1.0, 0.1, 0.1, at_bounds=1e6))
    assert 0.5 < unknown < 0.9 and told.unknown == pytest.approx(unknown)
    assert told.of("none") == pytest.approx(1.0 - unknown)
    assert told.effects["leak", "front"] == pytest.approx(CONSTANTS.taken_back * unknown)
