# SPDX-License-Identifier: Apache-2.0
"""Tolerances of the half car: what both ends share, and by how much they may differ."""

from __future__ import annotations

import numpy as np
import pytest

from pneumo_ros.effects.nuisance import SHARED, SPLIT, nominal_plant, nuisance_parameters, of_ends, plant_with, stated
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError
from pneumo_ros.rig import load_rig, parse_rig

NOMINAL = load_rig()
TEXT = "rig: {{end_difference: {{value: {share}}}}}\n"


def test_a_number_of_both_ends_moves_both_and_a_split_moves_them_apart() -> None:
    base = nominal_plant(NOMINAL, 1e-3)
    moved = plant_with(NOMINAL, base, {"effective_area_scale": 1.02, "discharge_coefficient_split": 0.03})
    assert (moved.body.area_scale_front, moved.body.area_scale_rear) == (1.02, 1.02)
    assert (moved.front.inlet_scale, moved.rear.inlet_scale) == pytest.approx((1.03, 0.97))
    assert moved.front.outlet_scale / moved.front.inlet_scale == pytest.approx(1.0)
    apart = plant_with(NOMINAL, base, {"bushing_damping": 60.0, "bushing_damping_split": -0.1})
    assert (apart.body.damping_front, apart.body.damping_rear) == pytest.approx((54.0, 66.0))


def test_nothing_moved_is_the_nominal_plant() -> None:
    model = RigModel(NOMINAL)
    nominal = np.array([p.nominal for p in model.parameters])
    assert model.plant(nominal) == model.plant() == plant_with(NOMINAL, nominal_plant(NOMINAL, model.step), {})


def test_what_the_ends_of_a_rig_file_have_of_their_own_is_where_they_start() -> None:
    text = "rig: {}\nends: {volume_scale_front: {value: 1.03}, volume_slope_rear: {value: 0.98}}\n"
    rig = parse_rig(text)
    own = stated(rig)
    assert own["volume_scale"] == pytest.approx(1.015) and own["volume_slope"] == pytest.approx(0.99)
    ends = of_ends(own)
    assert (ends["volume_scale_front"], ends["volume_scale_rear"]) == pytest.approx((1.03, 1.0))
    assert (ends["volume_slope_front"], ends["volume_slope_rear"]) == pytest.approx((1.0, 0.98))
    centres = {p.name: p.nominal for p in nuisance_parameters(rig)}
    assert centres["volume_scale_split"] == pytest.approx(0.03 / 2.03)


@pytest.mark.parametrize("share", [0.0, 0.2, 1.0])
def test_the_rig_file_says_how_alike_its_ends_are(share: float) -> None:
    rig = parse_rig(TEXT.format(share=share))
    found = {p.name: p.std for p in nuisance_parameters(rig)}
    splits = {name: found[name + SPLIT] for name in SHARED if name + SPLIT in found}
    assert splits == {n: pytest.approx(share * found[n] / getattr(rig, n).value) for n in SHARED if share}
    assert found["volume_slope_split"] == found["volume_slope"]  # no number of the rig's


def test_by_default_seven_per_cent_less_at_one_end_is_no_draw() -> None:
    """An orifice that passes 7 % less at one end: beyond three splits, and within them where each end is free."""
    std = {p.name: p.std for p in nuisance_parameters(NOMINAL)}
    assert NOMINAL.end_difference.value == 0.2 and "end_difference" not in NOMINAL.to_yaml()
    assert 3.0 * std["discharge_coefficient_split"] < 0.5 * 0.07
    alone = {p.name: p.std for p in nuisance_parameters(parse_rig(TEXT.format(share=1.0)))}
    assert 3.0 * alone["discharge_coefficient_split"] > 0.5 * 0.07


def test_a_difference_that_cannot_be_is_refused() -> None:
    with pytest.raises(InputError, match="end_difference"):
        parse_rig(TEXT.format(share=-0.1))
