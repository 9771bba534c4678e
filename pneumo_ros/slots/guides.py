# SPDX-License-Identifier: Apache-2.0
"""What people want to know of each family at a slot: what happens, the check by hand, what else looks like it.

``{size}`` in a check stands for the first parameter of the law that was found.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from pneumo_ros.effects.guide import Guide

GUIDES: Mapping[str, Guide] = MappingProxyType({
    "coulomb_friction": Guide(
        "Something rubs: the part sticks until what drives it exceeds the friction, then slides.",
        "move the part slowly both ways with a force gauge, everything else disconnected: the readings differ by twice "
        "{size}, at half the speed as well; let go, it stays where it is",
        {"viscous_damping": "halves with the rate; friction does not",
         "hysteresis": "builds up over a travel and goes with the part that flexes; friction is there at once"},
    ),
    "viscous_damping": Guide(
        "A force against the motion that grows with its rate.",
        "let the part swing or coast and watch the decay: it fades by a constant factor a cycle; at constant rates the "
        "force rises with the rate ({size})",
        {"coulomb_friction": "is the same at half the rate and ends a swing at once",
         "lag": "comes with a signal's path and moves no energy"},
    ),
    "hysteresis": Guide(
        "Rubber, cord or a press fit gives back less than it took: a loop of force over travel whose area hardly "
        "depends on the rate.",
        "cycle the part slowly over its usual travel with a force gauge: the loop is about twice {size} high, and "
        "it is as high at a tenth of the rate",
        {"coulomb_friction": "turns over within a very small travel",
         "relaxation": "fades while the part is held still"},
    ),
    "stop": Guide(
        "The part touches something near an end of its travel, earlier or harder than modelled.",
        "push it slowly to that end with a ruler and a force gauge: from the contact on the force rises by {size}; "
        "marks of contact show where",
        {"spring_error": "acts over the whole travel, a stop only at one end"},
    ),
    "spring_error": Guide(
        "The stiffness is not the nominal one, or changes along the travel.",
        "load the part in known steps and read the travel: force over travel is off by {size}",
        {"offset": "is the same at every travel", "stop": "begins at one end only",
         "scale": "a sensor's: the gauge beside it disagrees at rest as well"},
    ),
    "relaxation": Guide(
        "A force that fades while the part is held: rubber, creep, a gas that cools.",
        "move the part by a step and hold it: the force falls off over seconds; the part that fades is {size} times "
        "the step",
        {"hysteresis": "stays as long as the part is held", "viscous_damping": "is gone at once when it is held"},
    ),
    "resonance": Guide(
        "Something on the part rings: a bracket, a hose, a mass on a soft mount.",
        "knock against it and listen, or hold suspects by hand while it runs: the ringing changes when the right one "
        "is held; it weighs about {size}",
        {"spring_error": "shifts the whole response, a resonance one frequency"},
    ),
    "offset": Guide(
        "A constant error: a force that pulls one way, or a zero that is off.",
        "bring the rig to rest in a known state and compare with a gauge or a level: off by {size} at every point",
        {"scale": "is zero where the signal is zero", "spring_error": "changes with the travel"},
    ),
    "backlash": Guide(
        "Play: over part of the way nothing is moved.",
        "hold one side, move the other to and fro by hand: it is free over a gap and then hard",
        {"dead_zone": "is about zero; play is wherever the motion turns",
         "hysteresis": "gives way from the first bit of travel"},
    ),
    "lift_off": Guide(
        "The parts can push and not pull: they part company when the load turns.",
        "film the contact in slow motion, or put paper between: it comes free where the load would turn",
        {"backlash": "pulls again behind the gap"},
    ),
    "leak": Guide(
        "What should stay in finds a way out, also with everything closed.",
        "close everything, note the pressure or the level and wait: it falls; soap water or a dry cloth shows the "
        "place; found here: {size}",
        {"relief": "ends below its opening", "heat": "dies away after filling, a leak goes on",
         "flow_coefficient": "acts only while something flows on purpose"},
    ),
    "flow_coefficient": Guide(
        "An opening passes another share of the flow than modelled.",
        "hold the opening at a known value between known pressures and time the volume: the flow is off by {size}",
        {"droop": "changes with what is drawn, and takes its time", "leak": "goes on with the opening closed"},
    ),
    "relief": Guide(
        "Above some pressure or level there is another way out: a relief valve, an overflow.",
        "raise the pressure or the level slowly: from the opening on it escapes, by {size}; below it holds",
        {"leak": "is there at any pressure"},
    ),
    "droop": Guide(
        "The source sags while much is drawn from it, and recovers afterwards.",
        "put a gauge at the source and draw the usual flow: its pressure falls, by a share of {size}",
        {"flow_coefficient": "is there from the first instant and at small flows as well"},
    ),
    "heat": Guide(
        "Filling or emptying has warmed or cooled the content; pressure settles while it takes the wall's temperature.",
        "fill quickly, close everything and watch: the pressure moves, ever slower, and stops; a second filling to the "
        "same pressure soon after moves less",
        {"leak": "does not stop", "relaxation": "comes with travel, not with filling"},
    ),
    "gain": Guide(
        "The actuator gives another share of what it is told.",
        "command three known values and measure what comes: all are off by the same share, {size}",
        {"offset": "is the same at zero", "curvature": "differs between small and large values"},
    ),
    "scale": Guide(
        "The sensor's sensitivity is off.",
        "bring it to two known states with a gauge beside it: the difference it reads is off by {size}",
        {"offset": "reads both states off by the same amount", "curvature": "differs along the range"},
    ),
    "curvature": Guide(
        "The sensitivity changes along the range.",
        "calibrate at five points of the range: a straight line misses the middle by {size} of the range",
        {"scale": "is off by the same share everywhere", "saturation": "is straight until the limit"},
    ),
    "lag": Guide(
        "The signal follows slowly: a filter, a line, a slow actuator.",
        "give a step and watch the answer: two thirds of it are there after about {size}",
        {"delay": "leaves the shape of a step alone and comes later",
         "viscous_damping": "takes energy from the motion"},
    ),
    "delay": Guide(
        "The signal comes late, unchanged: a queue, a network, a stamp set too late.",
        "give a step and watch the answer: nothing for {size}, then all of it; look where it is stamped",
        {"lag": "begins at once and takes its time"},
    ),
    "dead_zone": Guide(
        "About zero nothing happens: overlap of a spool, stiction of an actuator.",
        "raise the command slowly from zero until something moves: at {size}; the same the other way",
        {"backlash": "is wherever the motion turns, not about zero", "gain": "is off by the same share everywhere"},
    ),
    "saturation": Guide(
        "The signal has a limit that the model does not know.",
        "raise the command, or what the sensor sees, slowly to its end: the answer stops rising {size} below it",
        {"curvature": "bends from the middle on", "gain": "is off at small values as well"},
    ),
})  # fmt: skip


def plain_check(guide: Guide) -> str:
    """The check in words, before any value was found."""
    return guide.check.replace("; found here: {size}", "").replace("{size}", "its size")
