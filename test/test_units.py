# SPDX-License-Identifier: Apache-2.0
"""Conversion factors against another library's, and the two pressures against what a gauge shows."""

from __future__ import annotations

import pytest
from scipy import constants

from pneumo_ros import units


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        (units.INCH, constants.inch),
        (units.SQUARE_INCH, constants.inch**2),
        (units.CUBIC_INCH, constants.inch**3),
        (units.PSI, constants.psi),
        (units.POUND_FORCE, constants.lbf),
        (units.POUND_MASS, constants.pound),
        (units.ATMOSPHERE, constants.atm),
        (units.KMH, constants.kmh),
        (units.DEGREE, constants.degree),
    ],
)
def test_factors_are_those_of_the_definitions(ours: float, theirs: float) -> None:
    assert ours == pytest.approx(theirs, rel=1e-11)


def test_constants_are_those_of_the_rigs_tables() -> None:
    assert units.GRAVITY == 9.81 and units.GAS_CONSTANT == 287.05
    assert pytest.approx(constants.g, rel=4e-4) == units.GRAVITY
    assert pytest.approx(constants.R / 0.0289652, rel=2e-4) == units.GAS_CONSTANT  # mean molar mass of dry air, kg/mol


def test_a_gauge_reads_above_the_air_around_it() -> None:
    assert units.psig_to_pa_absolute(0.0) == units.ATMOSPHERE
    assert units.psig_to_pa_absolute(14.695948775, 0.0) == pytest.approx(units.ATMOSPHERE, rel=1e-9)
    assert units.psig_to_pa_absolute(40.0, 90e3) == pytest.approx(40.0 * constants.psi + 90e3, rel=1e-12)
    assert units.pa_absolute_to_psig(units.ATMOSPHERE) == 0.0
    assert units.pa_absolute_to_psig(40.5 * constants.psi + 90e3, 90e3) == pytest.approx(40.5, rel=1e-12)
