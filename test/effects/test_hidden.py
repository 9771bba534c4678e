# SPDX-License-Identifier: Apache-2.0
"""A hidden effect: the same for a seed, never two alike for long, always one that the rig can have."""

from __future__ import annotations

from pneumo_ros.effects.configured import configured_effects
from pneumo_ros.effects.hidden import SELDOM_SHOWN, WIDEST, hidden_rig
from pneumo_ros.effects.loading import laws_of, load_library
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import LIMITS, load_rig

LIBRARY = laws_of(load_library())
SEEDS = range(200)


def test_a_seed_draws_one_rig() -> None:
    first, again = (hidden_rig(load_rig(), LIBRARY, 7) for _ in range(2))
    assert first == again and first != hidden_rig(load_rig(), LIBRARY, 8)


def test_every_draw_is_a_rig_that_stands_with_one_effect_of_the_library() -> None:
    drawn = [hidden_rig(load_rig(), LIBRARY, seed) for seed in SEEDS]
    for rig in drawn:
        trim(rig)
        assert len(configured_effects(rig, LIBRARY)) == 1
    names = {rig.effects[0].effect for rig in drawn}
    assert names == set(LIBRARY) - set(SELDOM_SHOWN)


def test_the_rigs_own_numbers_stay_inside_their_tolerances() -> None:
    nominal = load_rig()
    for seed in range(20):
        rig = hidden_rig(nominal, LIBRARY, seed)
        for name in LIMITS:
            stated, value = getattr(nominal, name), getattr(rig, name).value
            assert abs(value - stated.value) <= WIDEST * stated.std * (1.0 + 1e-12)
