# SPDX-License-Identifier: Apache-2.0
"""What may act where no family has a place: at the body, between struts or springs, and in the ground under the wheels.

These are no shapes of a family but ceilings: what a name is held against whose motion may also come from there, as a
narrow answer of the rig to the road looks alike wherever it rings.

The body: a mass m hangs between the ends, its share s ahead, by q'' = w^2 (y - q) + 2 zeta w (y' - q') with y = s y_f +
(1 - s) y_r of the body above the axles; it presses on the body there with -m q'' and with what it weighs. If it was
part of the rigid body, that is lighter by it. The ground: it gives way to the tyres' forces F beyond those at rest by
q_1'' = w^2 (F - q_1) - 2 zeta w q_1', and is shaken by what moves the road r by q_2'' = w^2 (r - q_2) + 2 zeta w
(r' - q_2'); the tyres lose a q_1 and gain b (q_2 - r).

What holds the body from outside, a cable or a guide, pulls with k_+ or k_- at its point above or below a height y_0,
and with c y'. A bar between the struts gives the front spring -k (h_f - h_r - d) and the rear one as much upwards,
where d is the difference of heights at the first instant. A pipe between the springs lets air through from the higher
pressure to the lower: as a hole and as a long gap.

Kernel arguments: :class:`pneumo_ros.effects.composition.PlantTerm`.
"""

from __future__ import annotations

import math

from numba import njit

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import RIG, Effect, Ends, Plant, Values
from pneumo_ros.effects.hooks import Air, Strut, Tyre
from pneumo_ros.effects.library.leak import REFERENCE
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.effects.shapes.atoms import SPREAD
from pneumo_ros.laws.flow import through_gap, through_hole
from pneumo_ros.laws.ringing import pulled, swung
from pneumo_ros.units import GAS_CONSTANT

Swing = tuple[float, float]
Shaken = tuple[float, float, float, float]
FREQUENCY = EffectParameter("frequency", "Hz", 1.0, 40.0, 6.0, starts=(1.5, 2.5, 4.0, 9.0, 13.0, 20.0, 30.0))
DAMPING_RATIO = EffectParameter("damping_ratio", "1", 0.005, 0.9, 0.1)


@njit(cache=True, error_model="numpy", inline="always")
def _hung(front: Strut, rear: Strut, ahead: float) -> Swing:
    """Height and speed of the body where the mass hangs; at ``ahead`` of 1 above the front axle, of 0 the rear."""
    top_f, top_r = front.middle + 0.5 * front.height, rear.middle + 0.5 * rear.height
    rate_f, rate_r = front.middle_rate + 0.5 * front.rate, rear.middle_rate + 0.5 * rear.rate
    return ahead * top_f + (1.0 - ahead) * top_r, ahead * rate_f + (1.0 - ahead) * rate_r


@njit(cache=True, error_model="numpy")
def start_swing(front: Strut, rear: Strut, p: Values) -> Swing:
    """At rest on the body."""
    return _hung(front, rear, p[3])


@njit(cache=True, error_model="numpy")
def swing(z: Swing, front: Strut, rear: Strut, dt: float, p: Values) -> Swing:
    """The mass one step later."""
    to, rate = _hung(front, rear, p[3])
    return swung(z[0], z[1], to, rate, 2.0 * math.pi * p[1], p[2], 0.0, dt)


@njit(cache=True, error_model="numpy")
def on_body(front: Strut, rear: Strut, z: Swing, p: Values) -> tuple[float, float]:
    """Spring, damper and weight, shared by the lever."""
    to, rate = _hung(front, rear, p[3])
    up = -p[0] * pulled(to - z[0], rate - z[1], 2.0 * math.pi * p[1], p[2], 1.0) - p[4]
    return p[3] * up, (1.0 - p[3]) * up


def lightened(plant: Plant, ends: Ends, values: Values) -> Plant:
    """The rigid rest of the body."""
    mass = plant.body.sprung_mass
    return plant._replace(body=plant.body._replace(sprung_mass=max(mass - values[5], 0.1 * mass)))


@njit(cache=True, error_model="numpy")
def start_shaken(front: Tyre, rear: Tyre, p: Values) -> Shaken:
    """At rest under the load and the road of the first instant."""
    return 0.0, 0.0, 0.5 * (front.road + rear.road), 0.0


@njit(cache=True, error_model="numpy")
def shake(z: Shaken, front: Tyre, rear: Tyre, dt: float, p: Values) -> Shaken:
    """The ground one step later."""
    w = 2.0 * math.pi * p[1]
    force = front.force - front.load + rear.force - rear.load
    rate = front.rate * front.load / front.rest + rear.rate * rear.load / rear.rest
    pressed = swung(z[0], z[1], force, rate, w, p[2], 1.0, dt)
    moved = swung(z[2], z[3], 0.5 * (front.road + rear.road), 0.5 * (front.slope + rear.slope), w, p[2], 0.0, dt)
    return pressed[0], pressed[1], moved[0], moved[1]


@njit(cache=True, error_model="numpy")
def on_axles(front: Tyre, rear: Tyre, z: Shaken, p: Values) -> tuple[float, float]:
    """What ground that moves takes from each tyre's force."""
    up = p[3] * (z[2] - 0.5 * (front.road + rear.road)) - p[0] * z[0]
    return up, up


@njit(cache=True, error_model="numpy")
def start_held(front: Strut, rear: Strut, p: Values) -> tuple[float]:
    """Height of the point that is held at the first instant."""
    return (_hung(front, rear, p[3])[0],)


@njit(cache=True, error_model="numpy")
def kept(z: tuple[float], front: Strut, rear: Strut, dt: float, p: Values) -> tuple[float]:
    """Nothing is forgotten."""
    return z


@njit(cache=True, error_model="numpy")
def hold(front: Strut, rear: Strut, z: tuple[float], p: Values) -> tuple[float, float]:
    """Upwards on the body, shared by the lever."""
    to, rate = _hung(front, rear, p[3])
    lifted = to - z[0] - p[4]
    up = -p[0] * max(0.0, lifted) - p[1] * min(0.0, lifted) - p[2] * rate
    return p[3] * up, (1.0 - p[3]) * up


@njit(cache=True, error_model="numpy")
def start_tied(front: Strut, rear: Strut, p: Values) -> tuple[float]:
    """Difference of the struts' heights at the first instant."""
    return (front.height - rear.height,)


@njit(cache=True, error_model="numpy")
def tie(front: Strut, rear: Strut, z: tuple[float], p: Values) -> tuple[float, float]:
    """A bar's force on both springs."""
    pull = p[0] * (front.height - rear.height - z[0]) + p[1] * (front.rate - rear.rate)
    return -pull, pull


@njit(cache=True, error_model="numpy")
def exchange(front: Air, rear: Air, z: tuple[float, ...], p: Values) -> tuple[float, float]:
    """Pressure rates by what the front spring gives to the rear one."""
    flow = p[0] * through_hole(front.pressure, rear.pressure, True)
    flow += p[1] * through_gap(front.pressure, rear.pressure, True, REFERENCE)
    # kg/s through a hole of 1 m2 for each Pa, by the temperature of where it comes from
    flow *= front.escape / front.pressure if front.pressure > rear.pressure else rear.escape / rear.pressure
    lost = front.exponent * GAS_CONSTANT * front.temperature * flow / front.volume
    return -lost, rear.exponent * GAS_CONSTANT * rear.temperature * flow / rear.volume


EFFECTS = (
    Effect(
        id="anything.body",
        summary="a part of the body that swings",
        sites=RIG,
        places=("body_heave", "body_pitch"),
        parameters=(
            EffectParameter("swinging_mass", "kg", 0.0, 20.0, 0.5, size=True, spread=SPREAD),
            FREQUENCY,
            DAMPING_RATIO,
            EffectParameter("share_ahead", "1", -0.5, 1.5, 0.5),
            EffectParameter("weight", "N", -50.0, 50.0, 2.0, size=True, spread=SPREAD),
            EffectParameter("lighter", "kg", -5.0, 5.0, 0.2, size=True, spread=SPREAD),
        ),
        plant=lightened,
        term=PlantTerm(states=2, start=start_swing, advance=swing, body=on_body, shared=True),
    ),
    Effect(
        id="anything.ground",
        summary="ground that gives way and rings",
        sites=RIG,
        places=("road_input",),
        parameters=(
            EffectParameter("giving", "1", 0.0, 1.0, 0.02, size=True, spread=SPREAD),
            FREQUENCY,
            DAMPING_RATIO,
            EffectParameter("shaking", "N/m", -5e4, 5e4, 200.0, size=True, spread=SPREAD),
        ),
        term=PlantTerm(states=4, start=start_shaken, advance=shake, ground=on_axles, shared=True),
    ),
    Effect(
        id="anything.held",
        summary="something outside that holds the body",
        sites=RIG,
        places=("body_heave",),
        parameters=(
            EffectParameter("pull", "N/m", -2e4, 2e4, 300.0, size=True, spread=SPREAD),
            EffectParameter("push", "N/m", -2e4, 2e4, 300.0, size=True, spread=SPREAD),
            EffectParameter("drag", "N s/m", -500.0, 500.0, 5.0, size=True, spread=SPREAD),
            EffectParameter("share_ahead", "1", -0.5, 1.5, 0.5),
            EffectParameter("begins", "m", -0.02, 0.02, 0.001),
        ),
        term=PlantTerm(states=1, start=start_held, advance=kept, body=hold, shared=True),
    ),
    Effect(
        id="anything.bar",
        summary="a bar between the struts",
        sites=RIG,
        places=("body_pitch",),
        parameters=(
            EffectParameter("bar", "N/m", -2e4, 2e4, 300.0, size=True, spread=SPREAD),
            EffectParameter("bar_damping", "N s/m", -500.0, 500.0, 5.0, size=True, spread=SPREAD),
        ),
        term=PlantTerm(states=1, start=start_tied, advance=kept, struts=tie, shared=True),
    ),
    Effect(
        id="anything.pipe",
        summary="air that goes from one spring to the other",
        sites=RIG,
        places=("front_air", "rear_air"),
        parameters=tuple(
            EffectParameter(name, "m2", -4e-5, 4e-5, 2e-7, size=True, spread=SPREAD) for name in ("hole", "gap")
        ),
        term=PlantTerm(airs=exchange, shared=True),
    ),
)
