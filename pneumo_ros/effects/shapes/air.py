# SPDX-License-Identifier: Apache-2.0
"""Atoms of a spring's air balance: leaks, errors of the orifices, heat from the wall, volume that is not V(h).

A mass flow W adds n R T/V W to dP/dt (Eq. 4.22), heat Q adds (n - 1)/V Q; an exponent n - D for slow strokes is
a heat of D/(n - 1) P dV/dt (Quaglia and Sorli 2001). An orifice that ices or clogs passes a share of its flow less, the
more the longer the session lasts. A second chamber, rigid and behind an opening of its own, takes V/(n R T) times the
rate of its own pressure.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

import math
from dataclasses import replace

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import ENDS
from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.library.leak import LAMINAR, REFERENCE
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.effects.shapes.atoms import Atom, Term
from pneumo_ros.laws.flow import filling, gap_over_hole, relieved
from pneumo_ros.laws.memory import relaxed
from pneumo_ros.plant.air_spring import MEAN_AREA
from pneumo_ros.units import ATMOSPHERE, GAS_CONSTANT, INCH

OPENING = 5e4  # Pa above the opening at which a leak that opens has its area
GAUGE = REFERENCE / (REFERENCE - ATMOSPHERE)  # over a hole's flow at the reference, where both pass the same
USUAL = 1e-3  # kg/s, a valve's usual flow
MIDDLE = 1.8 * INCH  # m
SWING = 5e-3  # m
HEAT_CAPACITY = 1005.0  # J/(kg K), of air at constant pressure
SLOW = (0.05, 0.2)  # m/s, rates of the strut below which the exponent is lower
MEMORIES = (0.15, 0.8, 4.0)  # s, of the wall's own temperature
KNEES = (0.3, 0.5)  # pressure ratios from which an inlet's flow may fall in another way
BENT = 0.3  # pressure ratio past a knee at which its atom changes the flow by its amplitude
SETTLES = (3.0, 12.0)  # s after a session's begin in which an orifice changes, as by ice
DROP = 1e4  # Pa between spring and second chamber at which the time that it takes to fill is stated
QUICKEST = 5e-3  # s, of that time: a chamber that is quicker is part of the volume

ATOMS: tuple[Atom | EffectParameter, ...] = (
    Atom("leak hole", "m2", 2e-7),
    Atom("leak gap", "m2", 2e-7),
    Atom("leak that opens", "m2", 1e-7),
    # Fitted, for ramps with fixed corners are no ramp between them; from zero, for "anything" has ramps as well.
    EffectParameter("opens", "1", -0.6, 1.0, 0.02, starts=(-0.1, 0.1)),
    Atom("inlet", "1", 0.05, signed=True),
    Atom("inlet over ratio", "1", 0.05, signed=True),
    Atom("inlet over flow", "1", 0.05, signed=True),
    Atom("outlet", "1", 0.05, signed=True),
    Atom("outlet over ratio", "1", 0.05, signed=True),
    Atom("wall", "W/K", 0.2),
    Atom("wall over pressure", "W/K", 0.2),
    *(Atom(f"wall memory {t:g} s", "W/K", 0.2) for t in MEMORIES),
    Atom("enthalpy", "1", 0.3),
    Atom("volume", "1", 0.03, signed=True),
    Atom("volume over height", "1", 0.03, signed=True),
    Atom("volume over pressure", "1", 0.03, signed=True),
    Atom("constant", "kg/s", 3e-5, signed=True),
    *(Atom(f"exponent {v:g} m/s", "1", 0.03) for v in SLOW),
    *(Atom(f"later {where} {t:g} s", "1", 0.05) for where in ("outlet", "inlet") for t in SETTLES),
    *(Atom(f"inlet past {ratio:g}", "1", 0.05, signed=True) for ratio in KNEES),
    Atom("chamber", "m3", 3e-5),
    EffectParameter("fills in", "s", QUICKEST, 1.0, 0.03, starts=(0.008, 0.2), spread=10.0),
    # What lies between a gap and a hole, a capillary before an orifice, grows ever less: no sum of the two does.
    Atom("leak over gauge pressure", "m2", 2e-7),
)
State = tuple[float, float, float, float, float, float, float, float]
Values = tuple[float, ...]
# A shape is no law whose last digit means anything: sums in any order, divisors turned over once, half the time.
LOOSE = {"arcp", "contract", "reassoc"}


@njit(cache=True, error_model="numpy")
def start(strut: Strut, air: Air, tyre: Tyre, p: Values) -> State:
    """Air and walls at the supply's temperature, orifices as they were, the pressure that the session began with, and
    the second chamber at it.
    """
    t = air.supply_temperature
    return (air.pressure * air.volume / (GAS_CONSTANT * t), t, t, t, 0.0, 0.0, air.pressure, air.pressure)


@njit(cache=True, error_model="numpy", fastmath=LOOSE)
def advance(z: State, strut: Strut, air: Air, tyre: Tyre, dt: float, p: Values) -> State:
    """The air's mass by its flows, the walls that follow its temperature, orifices that change with time, and the
    chamber's pressure, which no step carries beyond the spring's.
    """
    t = air.pressure * air.volume / (GAS_CONSTANT * z[0])
    gap = air.pressure - z[7]
    move = dt * filling(air.pressure, z[7], DROP, max(p[28], QUICKEST))
    return (
        max(z[0] + dt * (air.inflow - air.outflow), 1e-7), relaxed(z[1], t, dt, MEMORIES[0]),
        relaxed(z[2], t, dt, MEMORIES[1]), relaxed(z[3], t, dt, MEMORIES[2]),
        relaxed(z[4], 1.0, dt, SETTLES[0]), relaxed(z[5], 1.0, dt, SETTLES[1]),
        z[6], z[7] + (max(move, gap) if gap < 0.0 else min(move, gap)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy", fastmath=LOOSE)
def air(air: Air, z: State, p: Values) -> float:
    """Pressure rate of all atoms together, Pa/s."""
    ratio, pressure, t = air.pressure / air.supply, air.pressure / REFERENCE, air.temperature
    cold = math.sqrt(air.supply_temperature / t)
    gap = gap_over_hole(air.pressure, ATMOSPHERE, LAMINAR) * cold
    leak = p[0] + p[1] * gap
    leak += p[2] * relieved(air.pressure, (1.0 + p[3]) * z[6]) / OPENING
    leak += p[29] * GAUGE * (1.0 - ATMOSPHERE / air.pressure)
    flow = air.inflow * (p[4] + p[5] * (ratio - 0.5) + p[6] * (air.inflow / USUAL - 1.0))
    past, beyond = max(ratio - KNEES[0], 0.0) / BENT, max(ratio - KNEES[1], 0.0) / BENT
    flow += air.inflow * (p[25] * past * past + p[26] * beyond * beyond)
    flow -= air.outflow * (p[7] + p[8] * (ATMOSPHERE / air.pressure - 0.5)) + leak * air.escape
    flow += p[18] + air.inflow * (p[23] * z[4] + p[24] * z[5]) - air.outflow * (p[21] * z[4] + p[22] * z[5])
    true = air.pressure * air.volume / (GAS_CONSTANT * z[0])
    heat = (p[9] + p[10] * pressure) * (air.supply_temperature - true)
    heat += p[11] * (z[1] - true) + p[12] * (z[2] - true) + p[13] * (z[3] - true)
    heat += p[14] * HEAT_CAPACITY * air.inflow * (air.supply_temperature - t)
    through = GAS_CONSTANT * t
    flow -= p[27] * filling(air.pressure, z[7], DROP, max(p[28], QUICKEST)) / (air.exponent * through)
    squeezed, v = air.pressure * MEAN_AREA * air.rate, air.rate * air.rate
    nominal = air.exponent * (through * (air.inflow - air.outflow) - squeezed) / air.volume
    extra = p[15] + p[16] * (air.height - MIDDLE) / SWING + p[17] * (pressure - 1.0)
    heat += (p[19] / (1.0 + v / 0.0025) + p[20] / (1.0 + v / 0.04)) * squeezed / (air.exponent - 1.0)
    return (air.exponent * through * flow + (air.exponent - 1.0) * heat) / air.volume - extra * nominal


AIR = Term("air", PlantTerm(states=8, start=start, advance=advance, air=air), ATOMS, ENDS, ("{end}_air",))
EFFECTS = (
    # Holes and gaps are the law's; an area that the two share is no size to tell. What passes in proportion to the
    # gauge pressure shares it, too: the search takes the shape out where the law does as well.
    replace(
        AIR.shape(
            "leak",
            ["leak that opens", "opens", "leak over gauge pressure"],
            "a leak that opens, or one through a fitting",
            alone=("leak that opens",),
        ),
        begins=((0.0, 0.02, 2e-7),),  # from a hole and a gap small steps do not lead to what is neither
    ),
    AIR.shape("orifice_coefficient", ["inlet", "outlet"], "orifices that pass another share of the flow, of any law"),
    AIR.shape(
        "heat_transfer",
        ["wall", "enthalpy", "exponent"],
        "heat from the wall and with the inflow, of any law",
        alone=("exponent",),
    ),
    AIR.shape(
        "dead_volume",
        ["volume", "chamber", "fills in"],
        "a volume that is not V(h), of any law, or a second chamber",
        alone=("chamber",),
    ),
    AIR.anything(),
    AIR.anything("later", ["later"]),
)
