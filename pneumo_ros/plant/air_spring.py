# SPDX-License-Identifier: Apache-2.0
"""The Firestone 2M2A air spring: effective area surface, volume, gas.

Effective area: Table 5.2 continued to 100 psig with Table 4.1's trend; volume: least squares of Table 4.1 (errata 6);
gas: Eq. 4.22. Gauge pressure makes force, absolute pressure makes gas (errata 7).

Kernel arguments
----------------
height : of the spring, m
cubics, column, segment, t : piecewise cubics of the surface, which pressure and which height interval, m into it
area : opening, m2
pressure, power : absolute, Pa, and :func:`pressure_power` of it
"""

from __future__ import annotations

import csv
import math
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.errors import InputError
from pneumo_ros.paths import share_file
from pneumo_ros.plant.orifice import clamped_flow_function
from pneumo_ros.units import GAS_CONSTANT, INCH, PSI, SQUARE_INCH

VOLUME_OFFSET = 4.525951e-8  # m3, least squares of Table 4.1
MEAN_AREA = 1.5732687e-3  # m2, dV/dh of the same fit (Eq. 4.26's A_mean)


class AreaSurface(NamedTuple):
    """Effective area over height and gauge pressure as piecewise cubics, ready for compiled code.

    Attributes
    ----------
    heights : (H,) breakpoints, m, increasing
    pressures : (P,) columns, Pa gauge, increasing
    cubics : (P, H + 1, 4) coefficients, highest power first, of A(h - left edge), m2; the first and last segment
        are the straight continuations beyond the table
    """

    heights: NDArray[np.float64]
    pressures: NDArray[np.float64]
    cubics: NDArray[np.float64]


class Gas(NamedTuple):
    """What the gas in one spring and its orifices needs, SI.

    Attributes
    ----------
    exponent : polytropic exponent n
    k : (n - 1)/n
    supply_pressure, ambient_pressure : absolute, Pa
    supply_temperature : K
    reference_pressure : absolute, Pa; the pressure at which the spring's air has the supply's temperature (Eq. 4.17)
    supply_power, ambient_power : (P_ref/P_supply)^k and (P_ambient/P_ref)^k
    critical, choked : critical pressure ratio and the flow function there
    inlet_scale, outlet_scale : discharge coefficient (and area tolerance) of each orifice
    volume_offset, mean_area : V = volume_offset + mean_area h, m3 and m2
    """

    exponent: float
    k: float
    supply_pressure: float
    ambient_pressure: float
    supply_temperature: float
    reference_pressure: float
    supply_power: float
    ambient_power: float
    critical: float
    choked: float
    inlet_scale: float
    outlet_scale: float
    volume_offset: float
    mean_area: float


def build_surface(
    heights: NDArray[np.float64], pressures: NDArray[np.float64], areas: NDArray[np.float64]
) -> AreaSurface:
    """Monotone cubic in height on each pressure column, linear end slopes beyond the table.

    Parameters
    ----------
    heights : (H,) m, increasing
    pressures : (P,) Pa gauge, increasing
    areas : (H, P) m2
    """
    from scipy.interpolate import PchipInterpolator  # here: it takes longer to import than the rest of the rig

    columns = []
    for column in areas.T:
        curve = PchipInterpolator(heights, column)
        slope = curve.derivative()
        below = [0.0, 0.0, float(slope(heights[0])), column[0]]
        above = [0.0, 0.0, float(slope(heights[-1])), column[-1]]
        columns.append(np.vstack([below, curve.c.T, above]))
    return AreaSurface(
        np.ascontiguousarray(heights, dtype=float),
        np.ascontiguousarray(pressures, dtype=float),
        np.ascontiguousarray(np.stack(columns), dtype=float),
    )


def build_linear_surface(
    heights: NDArray[np.float64], pressures: NDArray[np.float64], areas: NDArray[np.float64]
) -> AreaSurface:
    """Linear between table entries and beyond them: a plain look-up table (Section 5.6). Arguments as above."""
    slopes = np.diff(areas, axis=0) / np.diff(heights)[:, None]
    left = np.vstack([areas[:1], areas[:-1], areas[-1:]])
    slope = np.vstack([slopes[:1], slopes, slopes[-1:]])
    cubics = np.zeros((areas.shape[1], len(heights) + 1, 4))
    cubics[:, :, 2], cubics[:, :, 3] = slope.T, left.T
    return AreaSurface(np.ascontiguousarray(heights, dtype=float), np.ascontiguousarray(pressures, dtype=float), cubics)


@lru_cache(maxsize=8)
def load_surface(path: str | None = None) -> AreaSurface:
    """Read a surface from CSV (heights in inches down, columns named ``<p>_psig``, areas in square inches).

    Without a path: the 2M2A surface that ships with the package.
    """
    source = Path(path) if path else share_file("config", "tables", "effective_area_extended_in2.csv")
    try:
        with source.open(newline="", encoding="utf-8") as handle:
            header, *rows = list(csv.reader(handle))
        pressures = np.array([float(name.removesuffix("_psig")) for name in header[1:]]) * PSI
        table = np.array([[float(cell) for cell in row] for row in rows if row])
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot read the effective area table ({error})",
            where=source,
            remedy="columns height_in, 5_psig, 10_psig, ... with numbers below",
        ) from error
    return build_surface(table[:, 0] * INCH, pressures, table[:, 1:] * SQUARE_INCH)


@njit(cache=True)
def _cubic(cubics: NDArray[np.float64], column: int, segment: int, t: float) -> float:
    return (
        (cubics[column, segment, 0] * t + cubics[column, segment, 1]) * t + cubics[column, segment, 2]
    ) * t + cubics[column, segment, 3]


@njit(cache=True, error_model="numpy")
def effective_area(height: float, gauge: float, surface: AreaSurface) -> float:
    """Effective area, m2 (negative beyond full extension, as the table says).

    Parameters
    ----------
    height : m; continued linearly outside the table
    gauge : Pa; clamped to the table's first and last column
    """
    heights, pressures = surface.heights, surface.pressures
    segment = 0
    while segment < heights.shape[0] and height > heights[segment]:
        segment += 1
    t = height - heights[segment - 1 if segment > 0 else 0]
    p = min(max(gauge, pressures[0]), pressures[-1])
    column = 0
    while column < pressures.shape[0] - 2 and p > pressures[column + 1]:
        column += 1
    w = (p - pressures[column]) / (pressures[column + 1] - pressures[column])
    low = _cubic(surface.cubics, column, segment, t)
    return low + w * (_cubic(surface.cubics, column + 1, segment, t) - low)


@njit(cache=True)
def spring_volume(height: float) -> float:
    """Air volume, m3, from height, m (least squares of Table 4.1)."""
    return VOLUME_OFFSET + MEAN_AREA * height


def volume_at_pressure(height: float, pressure: float, n: float, ambient: float) -> float:
    """Volume by Eq. 4.24 as printed: V = V60 (P60/P)^(1/n), pressures absolute, Pa. An option; errata 6 says why."""
    return spring_volume(height) * ((60.0 * PSI + ambient) / pressure) ** (1.0 / n)


@njit(cache=True)
def pressure_power(pressure: float, gas: Gas) -> float:
    """(P/P_ref)^((n-1)/n), which is also T2/T1 (Eq. 4.17); ``pressure`` absolute, Pa."""
    return (pressure / gas.reference_pressure) ** gas.k


@njit(cache=True)
def air_temperature(pressure: float, gas: Gas) -> float:
    """Temperature of the spring's air, K, by the polytropic relation Eq. 4.17 from absolute pressure, Pa."""
    return gas.supply_temperature * pressure_power(pressure, gas)


@njit(cache=True, error_model="numpy")
def inlet_flow(area: float, pressure: float, power: float, gas: Gas) -> float:
    """Mass flow supply -> spring, kg/s (Eq. 4.10).

    Parameters
    ----------
    area : inlet opening, m2
    pressure : of the spring, Pa absolute
    power : :func:`pressure_power` of it
    """
    ratio = pressure / gas.supply_pressure
    psi = clamped_flow_function(ratio, power * gas.supply_power, gas.k, gas.critical, gas.choked)
    speed = math.sqrt(GAS_CONSTANT * gas.supply_temperature)
    return gas.inlet_scale * area * gas.supply_pressure * psi / speed


@njit(cache=True, error_model="numpy")
def outlet_flow(area: float, pressure: float, power: float, gas: Gas) -> float:
    """Mass flow spring -> atmosphere, kg/s (Eq. 4.11); arguments as :func:`inlet_flow`, ``area`` the outlet's."""
    ratio = gas.ambient_pressure / pressure
    psi = clamped_flow_function(ratio, gas.ambient_power / power, gas.k, gas.critical, gas.choked)
    speed = math.sqrt(GAS_CONSTANT * gas.supply_temperature * power)
    return gas.outlet_scale * area * pressure * psi / speed


@njit(cache=True, error_model="numpy")
def pressure_rate(pressure: float, height: float, height_rate: float, inlet: float, outlet: float, gas: Gas) -> float:
    """dP/dt of Eq. 4.22, Pa/s: the gas law differentiated (Eqs. 4.13-4.19) with the flows in (Eqs. 4.20-4.21).

    Parameters
    ----------
    pressure : absolute, Pa
    height, height_rate : m, m/s (extension positive)
    inlet, outlet : commanded openings, m2
    """
    volume = gas.volume_offset + gas.mean_area * height
    power = pressure_power(pressure, gas)
    net = inlet_flow(inlet, pressure, power, gas) - outlet_flow(outlet, pressure, power, gas)
    heat = GAS_CONSTANT * gas.supply_temperature * power * net
    return gas.exponent * (heat - pressure * gas.mean_area * height_rate) / volume


def air_mass(pressure: float, height: float, gas: Gas) -> float:
    """Mass of air in the spring, kg (Eq. 4.13)."""
    volume = gas.volume_offset + gas.mean_area * height
    return pressure * volume / (GAS_CONSTANT * float(air_temperature(pressure, gas)))
