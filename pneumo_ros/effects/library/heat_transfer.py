# SPDX-License-Identifier: Apache-2.0
"""Heat between the spring's air and its wall: energy balance instead of a bare polytropic exponent.

dP/dt gains (n - 1)/V hA (T_wall - T), where T follows from the air's mass (a state) by P V = m R T; the wall stays at
the supply's temperature. Source: energy balance of a control volume; hA 0 leaves the nominal law.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS, Effect
from pneumo_ros.effects.expected import SETTLING
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.units import GAS_CONSTANT

State = tuple[float]
Values = tuple[float]


@njit(cache=True, error_model="numpy")
def start(strut: Strut, air: Air, tyre: Tyre, p: Values) -> State:
    """Air at the wall's temperature."""
    return (air.pressure * air.volume / (GAS_CONSTANT * air.supply_temperature),)


@njit(cache=True, error_model="numpy")
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """Mass by the flows; never empty."""
    return (max(z[0] + dt * (air.inflow - air.outflow), 1e-7),)


@njit(cache=True, error_model="numpy")
def air(air: Air, z: State, p: Values) -> float:
    """Pressure rate of the heat that the wall gives."""
    temperature = air.pressure * air.volume / (GAS_CONSTANT * z[0])
    return (air.exponent - 1.0) / air.volume * p[0] * (air.supply_temperature - temperature)


EFFECT = Effect(
    id="heat_transfer",
    summary="the air exchanges heat with the bellows' wall, so that slow strokes are nearly isothermal",
    sites=ENDS,
    places=("{end}_air",),
    elsewhere=("front_air-rear_air", "{end}_air-later"),
    parameters=(
        EffectParameter(
            "wall_conductance",
            "W/K",
            0.0,
            20.0,
            0.2,
            size=True,
            starts=(1.0,),
            meaning="heat from the wall per kelvin that the air is colder",
        ),
    ),
    term=PlantTerm(states=1, start=start, advance=advance, air=air),
    guide=Guide(
        meaning="The air gives heat to the bellows' wall: slow strokes are nearly isothermal, fast ones adiabatic.",
        check=(
            "bring the body to design height and the spring to 3 bar absolute, close the valves, press the body "
            "down by 10 mm quickly, hold it there and log the pressure: it jumps, then falls back while the air "
            "cools, by 29 % of the jump in the end and by two thirds of that within {settling_time}, although nothing "
            "leaks"
        ),
        expects={"settling_time": SETTLING},
        mistaken_for={
            "leak": "the pressure does not come back when the body is let go",
            "bellows_hysteresis": "shows in the force, not in the pressure",
        },
    ),
)
