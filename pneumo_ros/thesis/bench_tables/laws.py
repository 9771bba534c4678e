# SPDX-License-Identifier: Apache-2.0
"""What the Chapter 5 model predicts for the two tables, and what it might miss.

Natural frequency: w^2 = k/m with k the slope of (P - patm) A(h, P) at the static height, the air sealed (P V^n
constant, Eqs. 5.8 to 5.10). Damping ratio: zeta = c/(2 m w) (Eq. 5.8); it is judged at the printed natural frequency,
so that an error of the stiffness is not charged to the damping.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from pneumo_ros.arrays import Array
from pneumo_ros.effects.parameters import EffectParameter, Parameter
from pneumo_ros.plant.air_spring import AreaSurface, effective_area, spring_volume
from pneumo_ros.thesis.bench_tables.data import Bench
from pneumo_ros.units import ATMOSPHERE, GRAVITY, INCH

Values = Mapping[str, float]

SLOPE_STEP = 2.5e-4  # m, 0.01 in: less than the experiment moves; averages both slopes at a corner of the look-up
LOWEST, HIGHEST = 1.0 * INCH, 2.3 * INCH
OUT_OF_REACH = 1e-3  # rad/s or 1: what a law predicts where no static height exists; loses without a crash


@dataclass(frozen=True)
class Law:
    """Something that may be missing from one of the tables.

    Attributes
    ----------
    id, summary : what it is
    parameters : sizes, with bounds and a typical value
    predict : (bench, values of nuisance and effect by name) -> (5, 4) rad/s or damping ratio
    """

    id: str
    summary: str
    parameters: tuple[EffectParameter, ...]
    predict: Callable[[Bench, Values], Array]


NUISANCE: dict[str, tuple[Parameter, ...]] = {
    "frequency": (Parameter("effective_area_scale", "1", 1.0, 0.01), Parameter("volume_scale", "1", 1.0, 0.01)),
    "damping": (Parameter("bushing_damping", "N s/m", 50.0, 7.5),),
}
DEFAULTS = {
    "exponent": 1.4, "area_factor": 1.0, "dead_volume": 0.0, "parallel_stiffness": 0.0, "bellows_force": 0.0,
    "added_mass": 0.0, "effective_area_scale": 1.0, "volume_scale": 1.0,
}  # fmt: skip


def natural_frequency(bench: Bench, values: Values) -> Array:
    """(5, 4) rad/s; ``values`` may hold any of :data:`DEFAULTS`."""
    v = {**DEFAULTS, **values}
    out = np.full(bench.mass.shape, OUT_OF_REACH)
    for index, mass in np.ndenumerate(bench.mass):
        total = mass + v["added_mass"]
        stiffness = _stiffness(total, float(bench.gauge[index]), bench.surface, v)
        if stiffness is not None and stiffness > 0.0:
            out[index] = np.sqrt(stiffness / total)
    return out


def _stiffness(mass: float, gauge: float, surface: AreaSurface, v: Values) -> float | None:
    """k of sealed air at the height that carries the mass, N/m; None where no height does."""
    scale = v["effective_area_scale"] * v["area_factor"]
    load = mass * GRAVITY - v["bellows_force"]

    def missing(height: float) -> float:
        return gauge * scale * float(effective_area(height, gauge, surface)) - load

    if missing(LOWEST) <= 0.0 or missing(HIGHEST) >= 0.0:
        return None
    height = float(brentq(missing, LOWEST, HIGHEST))
    still = _volume(height, v)

    def force(h: float) -> float:
        pressure = (gauge + ATMOSPHERE) * (still / _volume(h, v)) ** v["exponent"] - ATMOSPHERE
        return pressure * scale * float(effective_area(h, pressure, surface))

    slope = (force(height + SLOPE_STEP) - force(height - SLOPE_STEP)) / (2.0 * SLOPE_STEP)
    return v["parallel_stiffness"] - slope


def _volume(height: float, v: Values) -> float:
    return float(spring_volume(height)) * v["volume_scale"] + v["dead_volume"]


def _viscous(bench: Bench, v: Values) -> Array:
    return np.asarray(v["bushing_damping"] / (2.0 * bench.mass * bench.frequency))


def _rubbed(viscous: Array, gain: Array, bench: Bench) -> Array:
    """Dry friction F beside viscous damping, seen at resonance with base amplitude Y.

    The relative amplitude is X = Y/(2 zeta) and the equivalent damping 4 F/(pi w X), so that
    zeta = zeta_v/(1 - 4 F/(pi Y k)); ``gain`` is 4 F/(pi Y), N/m.
    """
    stiffness = bench.mass * bench.frequency**2
    return np.asarray(viscous / np.maximum(1.0 - gain / stiffness, 1e-2))


def _loss(bench: Bench, loss: Array | float) -> Array:
    return np.asarray(loss / (2.0 * bench.mass * bench.frequency**2))


def _size(name: str, unit: str, low: float, high: float, typical: float) -> EffectParameter:
    return EffectParameter(name, unit, low, high, typical, size=True)


FREQUENCY_LAWS = (
    Law("nominal", "the Chapter 5 model inside its tolerances", (), natural_frequency),
    Law("polytropic_exponent", "the air is not isentropic", (_size("exponent", "1", 1.0, 1.67, 1.2),),
        natural_frequency),
    Law("effective_area_error", "the effective area surface is off by a factor",
        (_size("area_factor", "1", 0.7, 1.3, 0.95),), natural_frequency),
    Law("dead_volume", "air beyond the bellows takes part", (_size("dead_volume", "m3", 0.0, 5e-4, 2e-5),),
        natural_frequency),
    Law("parallel_stiffness", "the bellows' rubber is a spring beside the air",
        (_size("parallel_stiffness", "N/m", -5e3, 2e4, 1e3),), natural_frequency),
    Law("bellows_force", "the bellows carries load of its own", (_size("bellows_force", "N", -10.0, 10.0, 2.0),),
        natural_frequency),
    Law("added_mass", "platform and moving bellows ride with the payload",
        (_size("added_mass", "kg", -0.5, 2.0, 0.2),), natural_frequency),
    Law("dead_volume+parallel_stiffness", "both",
        (_size("dead_volume", "m3", 0.0, 5e-4, 2e-5), _size("parallel_stiffness", "N/m", -5e3, 2e4, 1e3)),
        natural_frequency),
)  # fmt: skip
DAMPING_LAWS = (
    Law("nominal", "viscous bushing, 50 N s/m inside its tolerance (15 %)", (), _viscous),
    Law("viscous_damping", "one constant viscous bushing, whatever its size",
        (_size("damping", "N s/m", 0.0, 500.0, 50.0),),
        lambda b, v: v["damping"] / (2.0 * b.mass * b.frequency)),
    Law("coulomb_friction", "dry friction beside the bushing",
        (_size("friction_gain", "N/m", 0.0, 9e3, 1e3),),
        lambda b, v: _rubbed(_viscous(b, v), np.full(b.mass.shape, v["friction_gain"]), b)),
    Law("load_friction", "dry friction in proportion to the load",
        (_size("friction_gain_per_mass", "N/(m kg)", 0.0, 2e3, 3e2),),
        lambda b, v: _rubbed(_viscous(b, v), v["friction_gain_per_mass"] * b.mass, b)),
    Law("load_damping", "viscous damping that grows with the load",
        (_size("damping", "N s/m", 0.0, 200.0, 20.0), _size("damping_per_mass", "N s/(m kg)", 0.0, 60.0, 10.0)),
        lambda b, v: (v["damping"] + v["damping_per_mass"] * b.mass) / (2.0 * b.mass * b.frequency)),
    Law("bellows_loss", "the bellows' rubber loses energy by travel, not by speed: loss stiffness k''",
        (_size("loss_stiffness", "N/m", 0.0, 2e4, 3e3),),
        lambda b, v: _loss(b, v["loss_stiffness"])),
    Law("loss_factor", "every part of the stiffness loses the same share",
        (_size("loss_factor", "1", 0.0, 1.0, 0.2),),
        lambda b, v: np.full(b.mass.shape, 0.5 * v["loss_factor"])),
    Law("bellows_loss+viscous_damping", "loss stiffness beside a viscous bushing",
        (_size("loss_stiffness", "N/m", 0.0, 2e4, 3e3), _size("damping", "N s/m", 0.0, 500.0, 20.0)),
        lambda b, v: _loss(b, v["loss_stiffness"]) + v["damping"] / (2.0 * b.mass * b.frequency)),
)  # fmt: skip
LAWS = {"frequency": FREQUENCY_LAWS, "damping": DAMPING_LAWS}
