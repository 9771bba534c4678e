# SPDX-License-Identifier: Apache-2.0
"""Dimensional analysis by linear algebra, and the scaling laws between a full-scale car and the rig.

Eqs. 3.5-3.34 (Pi-numbers); Eqs. 3.43-3.54, 4.43-4.52, 4.62, 4.79-4.80 (laws). Only the dimensions
of the quantities are typed in; the printed Pi-numbers and laws are what the tests compare with.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from pneumo_ros.errors import InputError

BASE = ("length", "mass", "time", "temperature")

# Exponents of length, mass, time and temperature in each quantity: the dimensional table (Table 3.1).
DIMENSIONS: dict[str, tuple[int, int, int, int]] = {
    "length": (1, 0, 0, 0),
    "mass": (0, 1, 0, 0),
    "time": (0, 0, 1, 0),
    "temperature": (0, 0, 0, 1),
    "angle": (0, 0, 0, 0),
    "frequency": (0, 0, -1, 0),
    "velocity": (1, 0, -1, 0),
    "acceleration": (1, 0, -2, 0),
    "area": (2, 0, 0, 0),
    "volume": (3, 0, 0, 0),
    "stiffness": (0, 1, -2, 0),
    "damping": (0, 1, -1, 0),
    "force": (1, 1, -2, 0),
    "inertia": (2, 1, 0, 0),
    "pressure": (-1, 1, -2, 0),
    "gas_constant": (2, 0, -2, -1),
}

HALF_CAR_PRIMARY = ("length", "mass", "frequency")  # Z_cm, M_s, w_0 (Section 3.3.1)

Powers = dict[str, Fraction]


def pi_number(quantity: str, primary: Sequence[str] = HALF_CAR_PRIMARY) -> Powers:
    """Powers that make a quantity dimensionless: {quantity: 1, primary: -e, ...} (Eqs. 3.5-3.15);
    empty for a primary quantity, which is its own unit.

    The quantity's row of the dimensional table is a combination e of the primary rows; the Pi-number divides by it.

    Raises
    ------
    InputError
        if the primary quantities do not span the quantity's dimension, or depend on each other.
    """
    rows = np.array([DIMENSIONS[name] for name in primary], dtype=float).T
    if np.linalg.matrix_rank(rows) < len(primary):
        raise InputError("primary quantities depend on each other", key="primary", value=tuple(primary))
    target = np.array(DIMENSIONS[quantity], dtype=float)
    powers, *_ = np.linalg.lstsq(rows, target, rcond=None)
    if not np.allclose(rows @ powers, target, atol=1e-9):
        raise InputError(f"no Pi-number of {quantity}", key="primary", value=tuple(primary), allowed="a spanning set")
    exact = [Fraction(float(p)).limit_denominator(12) for p in powers]
    found: Powers = {quantity: Fraction(1)}
    for name, power in zip(primary, exact, strict=True):
        found[name] = found.get(name, Fraction(0)) - power
    return {name: power for name, power in found.items() if power}


def representative_pi_numbers() -> dict[str, Powers]:
    """Pi-numbers of stiffness, damping, force and inertia over length, mass and frequency (Eqs. 3.31-3.34)."""
    return {name: pi_number(name) for name in ("stiffness", "damping", "force", "inertia")}


def evaluate(powers: Mapping[str, Fraction], values: Mapping[str, float]) -> float:
    """Value of a Pi-number for values of its quantities."""
    return math.prod(values[name] ** float(power) for name, power in powers.items())


@dataclass(frozen=True)
class Scales:
    """Scale factors, full scale over scaled: the free ones; all others follow.

    Attributes
    ----------
    length, mass, time, temperature : C_L, C_m, C_T, C_Te
    """

    length: float
    mass: float
    time: float = 1.0
    temperature: float = 1.0

    def factor(self, quantity: str) -> float:
        """Scale factor of a quantity: base factors to its dimensions (Eqs. 3.44-3.49, 4.47, 4.80)."""
        if quantity == "orifice_area":
            return self.orifice_area
        bases = (self.length, self.mass, self.time, self.temperature)
        return math.prod(base**power for base, power in zip(bases, DIMENSIONS[quantity], strict=True))

    @property
    def orifice_area(self) -> float:
        """C_d^2 = C_L^3/(C_T sqrt(C_Te)) (Eq. 4.44), not C_L^2.

        Orifice flow brings in sqrt(R T), a speed that does not scale with C_L/C_T because the gas stays air; the
        orifice makes up for it.
        """
        return self.length**3 / (self.time * math.sqrt(self.temperature))

    def down(self, value: float, quantity: str) -> float:
        """Full scale -> rig."""
        return value / self.factor(quantity)

    def up(self, value: float, quantity: str) -> float:
        """Rig -> full scale."""
        return value * self.factor(quantity)


HONDA_CIVIC = Scales(length=5.0, mass=12.0)  # Eqs. 3.51-3.54


def scaled_down(car: Mapping[str, tuple[float, str]], scales: Scales) -> dict[str, tuple[float, str]]:
    """A whole car, {name: (value, quantity)}, brought to the rig's scale."""
    return {name: (scales.down(value, quantity), quantity) for name, (value, quantity) in car.items()}


def scaled_up(rig: Mapping[str, tuple[float, str]], scales: Scales) -> dict[str, tuple[float, str]]:
    """A whole rig, {name: (value, quantity)}, brought to full scale."""
    return {name: (scales.up(value, quantity), quantity) for name, (value, quantity) in rig.items()}
