# SPDX-License-Identifier: Apache-2.0
"""Conversion factors and physical constants; SI inside, other units only at the edges.

The factors are exact by definition (international inch, pound-force, psi) except where a comment says otherwise.
"""

from __future__ import annotations

import math

INCH = 0.0254  # m
SQUARE_INCH = INCH**2  # m2
CUBIC_INCH = INCH**3  # m3
PSI = 6894.757293168  # Pa
POUND_FORCE = 4.4482216152605  # N
POUND_MASS = 0.45359237  # kg

ATMOSPHERE = 101325.0  # Pa, absolute
GRAVITY = 9.81  # m/s2, the value the rig's tables are made with
GAS_CONSTANT = 287.05  # J/(kg K), dry air

KMH = 1.0 / 3.6  # m/s
DEGREE = math.pi / 180.0  # rad


def psig_to_pa_absolute(pressure_psig: float, ambient_pa: float = ATMOSPHERE) -> float:
    """Gauge pressure in psi -> absolute pressure in Pa."""
    return pressure_psig * PSI + ambient_pa


def pa_absolute_to_psig(pressure_pa: float, ambient_pa: float = ATMOSPHERE) -> float:
    """Absolute pressure in Pa -> gauge pressure in psi."""
    return (pressure_pa - ambient_pa) / PSI
