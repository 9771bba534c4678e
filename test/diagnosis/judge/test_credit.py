# SPDX-License-Identifier: Apache-2.0
"""What speaks against one effect of a structure, each reason alone, and how its probability is told."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pneumo_ros.diagnosis.judge.closable import EffectEvidence
from pneumo_ros.diagnosis.judge.verdict import Calibration, HeldOutGaps, credit, told_probability

CONSTANTS = Calibration()
SURE = EffectEvidence(("leak", "front"), ("front_air",), 1.0, 0.0, 0.0, share=1e3, beside=1e3)
SLIGHT = replace(SURE, own=0.6, ceiling=0.6)  # holds less of the run than is left
FAR = HeldOutGaps(1e6, 1.0)


def beyond_one(left: float) -> float:
    """The gap that holds so much beside a floor of one."""
    return float(np.hypot(left, 1.0))


def reasons(k: float) -> dict[str, tuple[EffectEvidence, HeldOutGaps]]:
    """Each thing that speaks against a name, alone and ``k`` times as large as what makes it as likely as not."""
    c = CONSTANTS
    half_left = HeldOutGaps(1e6, 1e6 * k * c.bent)
    return {
        "closes too little": (replace(SURE, own=(k * (1.0 - c.closes)) ** 2), FAR),
        "leaves too much": (replace(SURE, leaves=1.0 + k * (c.leaves - 1.0)), FAR),
        "stands at bounds": (replace(SURE, at_bounds=k * c.at_bounds), FAR),
        "bends its shape": (replace(SURE, bent=c.at_bounds), half_left),
        "holds next to nothing": (replace(SURE, share=c.least / k), FAR),
        "the structure closes little": (SURE, HeldOutGaps(1e6, 1e6 * (1.0 - c.slight / k))),
        "nobody misses it": (replace(SURE, beside=c.beside / k, instead=1.0), FAR),
        "another does its work": (replace(SURE, beside=1e-6, instead=1.0 + (c.instead - 1.0) / k), FAR),
        "traces": (SURE, HeldOutGaps(beyond_one(c.traces / k), 1.0)),
        "a sensor's, beside what is left": (
            replace(SURE, places=("sensor:sprung_front",), own=k / (1.0 + k), ceiling=k / (1.0 + k)),
            FAR,
        ),
        "the equations miss what they did": (SLIGHT, replace(FAR, kept=k * c.kept)),
        "its own miss what they did": (replace(SLIGHT, mended=k * c.kept), replace(FAR, kept=10.0)),
        "they miss nothing without it": (
            replace(
                SLIGHT,
                missing=(1.0 + 1e6 * (c.unheld[0] + k * (c.unheld[1] - c.unheld[0])), 1.0 + 1e6),
            ),
            FAR,
        ),
        "one value is all its law was seen at": (replace(SURE, varied=c.varied / k), FAR),
        "a reading that stops": (replace(SURE, places=("sensor:front_pressure",), follows=1.0 / k), FAR),
    }


@pytest.mark.parametrize("reason", list(reasons(1.0)))
def test_each_reason_against_a_name_alone(reason: str) -> None:
    """One half where it is as large as its constant; the fourth power of how much larger or smaller elsewhere."""
    assert credit(SURE, FAR, CONSTANTS) > 0.999
    for k in (0.5, 0.8, 1.0):
        one, held = reasons(k)[reason]
        assert credit(one, held, CONSTANTS) == pytest.approx(1.0 / (1.0 + k**CONSTANTS.steepness), abs=2e-4)


@pytest.mark.parametrize("without, named", [(13.0, True), (5.5, False), (4.1, False)])
def test_what_the_equations_miss_is_named_beside_what_nobody_can_predict(without: float, named: bool) -> None:
    """It closes 6 % of the run's gap; the equations miss 4 null variances with it and so many without."""
    one = replace(SURE, missing=(4.0, without))
    assert (credit(one, HeldOutGaps(100.0, 94.0), CONSTANTS) > 0.5) is named


@pytest.mark.parametrize("missed", [{"missing": (15.0, 11.0)}, {"mended": 1.03}])
@pytest.mark.parametrize("own, named", [(0.2, True), (0.45, True), (0.6, False)])
def test_what_holds_more_of_the_run_than_is_left_stands_where_the_equations_see_something_else(
    own: float, named: bool, missed: dict[str, Any]
) -> None:
    """A stop beside a sensor whose error fills them; ``own`` of what is left without it is left with it."""
    one = replace(SURE, own=own, ceiling=own, **missed)
    assert (credit(one, replace(FAR, kept=1.0), CONSTANTS) > 0.5) is named


@pytest.mark.parametrize(
    "own, mended, named", [(0.45, np.inf, True), (0.6, np.inf, False), (0.6, 0.1, True), (0.6, 0.9, False)]
)
def test_what_explains_the_fitted_logs_and_not_the_next_is_something_else(
    own: float, mended: float, named: bool
) -> None:
    """All of the fitted logs and a fifth of the held-out one. What holds more of that than is left there stands, and so
    does what has mended its equations along it: there something else leads the run astray.
    """
    held = HeldOutGaps(1e6, 0.8e6)
    one = replace(SURE, own=own, ceiling=own, mended=mended)
    assert credit(one, held, CONSTANTS) > 0.8
    assert (credit(one, held, CONSTANTS, fitted=1.0) > 0.5) is named
    for k in (0.8, 1.0, 1.2):
        likely = credit(SLIGHT, held, CONSTANTS, fitted=0.2 + k * CONSTANTS.lost)
        assert likely == pytest.approx(1.0 / (1.0 + k**CONSTANTS.steepness), abs=1e-4)


def test_what_others_miss_is_no_reason_against_what_has_mended_its_own_equations() -> None:
    others = replace(FAR, kept=0.98)
    assert credit(SLIGHT, others, CONSTANTS) < 0.4
    assert credit(replace(SLIGHT, mended=0.05), others, CONSTANTS) > 0.99


def test_a_certain_credit_is_told_as_often_as_such_were_right_and_a_half_stays_a_half() -> None:
    c = Calibration()
    assert told_probability(1.0, 10.0, 1.0, c) == pytest.approx(0.96, abs=0.001)
    assert told_probability(1.0, 0.0, 1.0, c) == told_probability(1.0, -0.3, 1.0, c) == 0.9
    assert told_probability(1.0, 0.1, 1.0, c) == pytest.approx(0.5 * (0.96 + 0.9))
    assert [told_probability(0.5, share, acts, c) for share in (0.0, 1.0) for acts in (0.0, 1.0)] == [0.5] * 4
    assert told_probability(0.0, 1.0, 1.0, c) == 0.5 and told_probability(0.0, 1.0, 0.0, c) == 0.0
    steps = [told_probability(p, 0.2, 0.9, c) for p in np.linspace(0.0, 1.0, 51)]
    assert np.all(np.diff(steps) > 0.0)
