# SPDX-License-Identifier: Apache-2.0
"""The registry: every law of every family, by the kind of slot, its parameters in multiples of the slot's scales."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from pneumo_ros.slots import flow as fl
from pneumo_ros.slots import force as fo
from pneumo_ros.slots import signal as si

MOST = 300.0  # of a typical size: a bound for the solver, no physical limit
HARDEST = 5000.0  # the same of a stop's stiffness: steel on steel is that much stiffer than a spring


class End(Enum):
    """What lies at a bound of a parameter, and what a fit that stops there says."""

    OWN = "another law of the family"  # nothing
    OTHER = "another family: a hysteresis that yields at once is dry friction"  # as much as a size that is none
    LIMIT = "the end of what is tried"  # half of that for what shapes a law; a size counts in full


@dataclass(frozen=True)
class Measures:
    """What a slot's data show, in its own units.

    Attributes
    ----------
    size : of a force (flow, signal) that would be evident in the log
    rate, travel : usual ones (of a signal: travel is half its swing; of a flow: travel is the swing of the pressure)
    low, high : ends of the travel, or of the pressure
    load : usual load, or nominal flow; of a signal its peak
    period, whole : s, of the slowest motion and of the record
    unit, travel_unit : of the size and of the travel
    varied : share of the rate (mean square) that its direction alone does not explain: 0 at one speed each way, 0.19
        where it swings as a sine, 0.36 where it is random
    settles : how much can seem to flow out at most while the gas there cools from its filling; infinite where nothing
        is known
    """

    size: float
    rate: float
    travel: float
    low: float
    high: float
    load: float
    period: float
    whole: float
    unit: str
    travel_unit: str
    varied: float = 1.0
    settles: float = np.inf


def without_limit(m: Measures) -> float:
    """Of what nature sets no end."""
    return np.inf


def cooling(m: Measures) -> float:
    """Of what seems to flow out while air cools that its filling has warmed; what emptying has cooled has no such end,
    for an expansion may cool as far as one likes.
    """
    return m.settles


@dataclass(frozen=True)
class Knob:
    """A parameter of a law.

    Attributes
    ----------
    name : of the parameter
    unit : with ``{unit}`` and ``{travel}`` standing for the slot's
    column : where it stands among the slot's values
    typical : from the slot's measures
    low, high : bounds, in typical values
    size : zero means that the law is absent
    ends : what lies at its lower and at its upper bound
    starts : further values to start from, in typical ones
    most : largest value that nature allows, from the slot's measures
    """

    name: str
    unit: str
    column: int
    typical: Callable[[Measures], float]
    low: float = 0.0
    high: float = MOST
    size: bool = True
    starts: tuple[float, ...] = (8.0,)
    ends: tuple[End, End] = (End.LIMIT, End.LIMIT)
    most: Callable[[Measures], float] = without_limit


@dataclass(frozen=True)
class Law:
    """A law of a family at slots of some kinds.

    ``by_rate`` : what it claims is how a force changes with the rate
    """

    id: str
    kinds: tuple[str, ...]
    summary: str
    knobs: tuple[Knob, ...]
    needs_load: bool = False
    by_rate: bool = False


def _size(m: Measures) -> float:
    return m.size


def _per_rate(m: Measures) -> float:
    return m.size / m.rate


def _per_travel(m: Measures) -> float:
    return m.size / m.travel


def _rate(m: Measures) -> float:
    return m.rate


def _share(m: Measures) -> float:
    return m.size / m.load


def _shape(
    name: str, unit: str, column: int, typical: Callable[[Measures], float], low: float, high: float,
    starts: tuple[float, ...], lower: End = End.OWN, upper: End = End.OWN,
) -> Knob:  # fmt: skip
    return Knob(name, unit, column, typical, low, high, size=False, starts=starts, ends=(lower, upper))


FORCES, CONTACT = ("force", "contact"), ("contact",)
INPUT, SENSOR, SIGNALS = ("input",), ("sensor",), ("input", "sensor")
N, NS, NM, M, MS = "{unit}", "{unit} s/{travel}", "{unit}/{travel}", "{travel}", "{travel}/s"

FORCE_LAWS = (
    Law("coulomb_friction", FORCES, "dry friction, the same at every rate",
        (Knob("friction_force", N, fo.COULOMB, _size),)),
    Law("coulomb_friction.stribeck", FORCES, "dry friction that is larger from rest (Stribeck)",
        (Knob("friction_force", N, fo.STRIBECK, _size),
         _shape("extra_from_rest", "1", fo.STRIBECK_EXTRA, lambda m: 0.5, 0.0, 6.0, (2.0,)),
         _shape("stribeck_rate", MS, fo.STRIBECK_RATE, lambda m: 0.2 * m.rate, 0.1, 10.0, (0.4, 3.0)))),
    Law("coulomb_friction.soft", FORCES, "dry friction that turns over softly",
        (Knob("friction_force", N, fo.SOFT, _size),
         _shape("turnover_rate", MS, fo.SOFT_RATE, lambda m: 0.1 * m.rate, 0.1, 4.0, (0.3, 3.0), upper=End.OTHER))),
    Law("coulomb_friction.presliding", FORCES, "dry friction that gives before it slips",
        (Knob("friction_force", N, fo.PRESLIDING, _size),
         _shape("presliding_travel", M, fo.PRESLIDING_TRAVEL, lambda m: 0.05 * m.travel, 0.05, 5.0, (0.2, 3.0),
                upper=End.OTHER))),
    Law("coulomb_friction.one_sided", FORCES, "dry friction, another one each way",
        (Knob("friction_out", N, fo.ONE_SIDED_OUT, _size), Knob("friction_in", N, fo.ONE_SIDED_IN, _size))),
    Law("coulomb_friction.loaded", FORCES, "dry friction in proportion to the load",
        (Knob("friction_coefficient", "1", fo.LOADED, _share),), needs_load=True),
    Law("viscous_damping", FORCES, "damping in proportion to the rate",
        (Knob("damping", NS, fo.VISCOUS, _per_rate, -MOST),), by_rate=True),
    Law("viscous_damping.one_sided", FORCES, "damping, another one each way",
        (Knob("damping_out", NS, fo.DAMPING_OUT, _per_rate, -MOST),
         Knob("damping_in", NS, fo.DAMPING_IN, _per_rate, -MOST)), by_rate=True),
    Law("viscous_damping.degressive", FORCES, "damping that grows ever less with the rate",
        (Knob("damping", NS, fo.DEGRESSIVE, _per_rate),
         _shape("knee_rate", MS, fo.DEGRESSIVE_RATE, _rate, 0.7, 5.0, (3.0,), End.OTHER)), by_rate=True),
    Law("viscous_damping.quadratic", FORCES, "damping with the square of the rate",
        (Knob("square_damping", "{unit} s2/{travel}2", fo.SQUARE_DAMPING, lambda m: m.size / m.rate**2),),
        by_rate=True),
    Law("hysteresis", FORCES, "rate-independent hysteresis (Bouc-Wen)",
        (Knob("hysteresis_force", N, fo.BOUC_WEN, _size),
         _shape("yield_travel", M, fo.BOUC_WEN_TRAVEL, lambda m: 0.4 * m.travel, 0.25, 10.0, (0.5, 3.0),
                End.OTHER, End.OTHER))),
    Law("hysteresis.growing", FORCES, "rate-independent hysteresis whose force levels off or grows on (Bouc-Wen)",
        (Knob("hysteresis_force", N, fo.BOUC_WEN, _size),
         _shape("yield_travel", M, fo.BOUC_WEN_TRAVEL, lambda m: 0.4 * m.travel, 0.25, 10.0, (0.5, 3.0),
                End.OTHER, End.OTHER),
         _shape("growth", "1", fo.BOUC_WEN_GROWTH, lambda m: 0.5, -1.8, 4.0, (-1.0, 2.6)))),
    Law("hysteresis.sliders", FORCES, "rate-independent hysteresis (parallel sliders)",
        (Knob("hysteresis_force", N, fo.SLIDERS, _size),
         _shape("yield_travel", M, fo.SLIDERS_TRAVEL, lambda m: 0.4 * m.travel, 0.25, 10.0, (0.5, 3.0),
                End.OTHER, End.OTHER))),
    Law("stop", FORCES, "a stop at the upper end of the travel",
        (Knob("stop_stiffness", NM, fo.STOP_ABOVE, lambda m: 5.0 * m.size / m.travel, 0.0, HARDEST),
         _shape("stop_depth", M, fo.STOP_ABOVE_DEPTH, lambda m: 0.2 * m.travel, 0.0, 9.0, (0.2, 2.5)),
         _shape("stop_loss", "1", fo.STOP_ABOVE_LOSS, lambda m: 0.3, 0.0, 60.0, (10.0,)))),
    Law("stop.below", FORCES, "a stop at the lower end of the travel",
        (Knob("stop_stiffness", NM, fo.STOP_BELOW, lambda m: 5.0 * m.size / m.travel, 0.0, HARDEST),
         _shape("stop_depth", M, fo.STOP_BELOW_DEPTH, lambda m: 0.2 * m.travel, 0.0, 9.0, (0.2, 2.5)),
         _shape("stop_loss", "1", fo.STOP_BELOW_LOSS, lambda m: 0.3, 0.0, 60.0, (10.0,)))),
    Law("spring_error", FORCES, "stiffness that is off", (Knob("stiffness", NM, fo.SPRING, _per_travel, -MOST),)),
    Law("spring_error.cubic", FORCES, "a spring that hardens or softens",
        (Knob("cubic_stiffness", "{unit}/{travel}3", fo.SPRING_CUBIC, lambda m: m.size / m.travel**3, -MOST),)),
    Law("spring_error.square", FORCES, "a spring that is stiffer one way",
        (Knob("square_stiffness", "{unit}/{travel}2", fo.SPRING_SQUARE, lambda m: m.size / m.travel**2, -MOST),)),
    Law("relaxation", FORCES, "a spring whose force fades (rubber, creep)",
        (Knob("fading_stiffness", NM, fo.MEMORY, _per_travel),
         _shape("fading_time", "s", fo.MEMORY_TIME, lambda m: 0.1 * m.period, 0.05, 20.0, (0.3, 5.0),
                End.OTHER, End.OTHER)), by_rate=True),
    Law("resonance", FORCES, "something that rings: a mass on a spring",
        (Knob("ringing_mass", "{unit} s2/{travel}", fo.MASS, lambda m: m.size * m.period / m.rate / 6.0),
         _shape("ringing_frequency", "rad/s", fo.FREQUENCY, lambda m: 12.0 / m.period, 0.2, 8.0, (0.5, 2.0, 4.0),
                End.LIMIT, End.LIMIT),
         _shape("ringing_damping", "1", fo.DAMPING_RATIO, lambda m: 0.05, 0.1, 10.0, ()))),
    Law("offset", FORCES, "a constant force", (Knob("constant_force", N, fo.CONSTANT, _size, -MOST),)),
    Law("backlash", CONTACT, "play before the parts touch",
        (Knob("lost_stiffness", NM, fo.BACKLASH, _per_travel),
         _shape("half_gap", M, fo.BACKLASH_HALF, lambda m: 0.1 * m.travel, 0.02, 12.0, (0.3, 3.0, 7.0)))),
    Law("lift_off", CONTACT, "parts that cannot pull", (Knob("lost_pull", "1", fo.PULL, lambda m: 1.0, 0.0, 1.0,
                                                             starts=(0.3,)),), needs_load=True),
)  # fmt: skip

FLOW = ("flow",)
FLOW_LAWS = (
    Law("leak", FLOW, "a hole", (Knob("conductance", "{unit}/{travel}", fl.HOLE, lambda m: m.size / m.high),)),
    Law("leak.laminar", FLOW, "a long narrow gap",
        (Knob("conductance", "{unit}/{travel}", fl.GAP, lambda m: m.size / m.high),)),
    Law("leak.opening", FLOW, "a gap that the pressure itself opens",
        (Knob("conductance", "{unit}/{travel}", fl.POWER, lambda m: m.size / m.high),
         _shape("exponent", "1", fl.EXPONENT, lambda m: 1.0, 0.5, 3.0, (0.6, 1.5)))),
    Law("flow_coefficient", FLOW, "an opening that passes another share of the flow",
        (Knob("share", "1", fl.FLOW, _share, -MOST),), needs_load=True),
    Law("flow_coefficient.curved", FLOW, "an opening whose share changes with the flow",
        (Knob("share", "1", fl.FLOW_SQUARE, _share, -MOST),), needs_load=True),
    Law("relief", FLOW, "a way out that opens above a pressure or a level",
        (Knob("slope", "{unit}/{travel}", fl.RELIEF, lambda m: 3.0 * m.size / m.travel),
         _shape("opening_depth", "{travel}", fl.RELIEF_DEPTH, lambda m: 0.15 * m.travel, 0.0, 6.0, (0.3, 3.0)))),
    Law("droop", FLOW, "a source that sags with the flow drawn",
        (Knob("sag", "1", fl.DROOP, _share),
         _shape("sag_time", "s", fl.DROOP_TIME, lambda m: 0.1 * m.period, 0.01, 30.0, (0.2, 5.0))), needs_load=True),
    Law("heat", FLOW, "filling has warmed or cooled what settles now",
        (Knob("settling", "{unit} s", fl.HEAT, lambda m: 0.1 * m.size * m.whole, -MOST, most=cooling),
         _shape("settling_time", "s", fl.HEAT_TIME, lambda m: 0.04 * m.whole, 0.05, 4.0, (0.25, 3.0),
                End.LIMIT, End.LIMIT))),
)  # fmt: skip

SIGNAL_LAWS = (
    Law("gain", INPUT, "an actuator that gives another share of what it is told",
        (Knob("gain_error", "1", si.GAIN, lambda m: 0.05, -16.0, 40.0),)),
    Law("scale", SENSOR, "a sensitivity that is off",
        (Knob("scale_error", "1", si.GAIN, lambda m: 0.05, -16.0, 40.0),)),
    Law("offset", SIGNALS, "a constant error", (Knob("offset", "{unit}", si.OFFSET, lambda m: 0.1 * m.travel, -MOST),)),
    Law("curvature", SIGNALS, "a sensitivity that is not constant",
        (Knob("curvature", "1", si.SQUARE, lambda m: 0.05, -20.0, 20.0),)),
    Law("curvature.cubic", SIGNALS, "a sensitivity that changes with size",
        (Knob("cubic", "1", si.CUBE, lambda m: 0.05, -20.0, 20.0),)),
    Law("lag", SIGNALS, "a slow response (first order)",
        (Knob("lag", "s", si.LAG, lambda m: 0.02 * m.period, 0.0, 200.0),)),
    Law("lag.second", SIGNALS, "a slow response (second order)",
        (Knob("lag", "s", si.SECOND_LAG, lambda m: 0.01 * m.period, 0.0, 200.0),)),
    Law("lag.limited", INPUT, "a response that cannot be faster than so much",
        (Knob("slowness", "s/{unit}", si.SLOWNESS, lambda m: m.period / (4.0 * np.pi * m.travel), 0.0, 60.0,
              starts=(0.3, 3.0)),)),
    Law("delay", SIGNALS, "a response that comes late",
        (Knob("delay", "s", si.DELAY, lambda m: 0.02 * m.period, 0.0, 50.0),)),
    Law("dead_zone", INPUT, "nothing happens about zero",
        (Knob("half_width", "{unit}", si.DEAD, lambda m: 0.08 * m.load, 0.0, 12.0, starts=(4.0,)),)),
    Law("saturation", SIGNALS, "a limit", (Knob("cut_share", "1", si.CUT, lambda m: 0.1, 0.0, 9.5, starts=(4.0,)),)),
    Law("saturation.soft", SIGNALS, "a limit that is reached softly",
        (Knob("softness", "1", si.SOFT_CUT, lambda m: 0.1, 0.0, 100.0),)),
    Law("backlash", INPUT, "play on the way",
        (Knob("half_gap", "{unit}", si.PLAY, lambda m: 0.08 * m.travel, 0.0, 12.0, starts=(4.0,)),)),
)  # fmt: skip
LAWS = (*FORCE_LAWS, *FLOW_LAWS, *SIGNAL_LAWS)
