# SPDX-License-Identifier: Apache-2.0
"""The rig with the terms of effects, integrated: what :mod:`pneumo_ros.effects.composition` compiles.

Scheme: the ten states of the half car by RK4; a term's own states are staggered by half a step (advanced once per step
with the signals at its start, which is second order), each by its own exact or stable update, so that a stiff bristle
does not shorten the step.

:func:`simulate` calls the terms by the names of :mod:`pneumo_ros.effects.terms`, which hold nothing; a composed kernel
is the same function over generated ones that hold a library.

Kernel arguments
----------------
x : state (10,) of :mod:`pneumo_ros.plant.equations`
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from pneumo_ros.arrays import Array
from pneumo_ros.effects.hooks import Air, Strut, Tyre, air_of, air_rate, strut_of, tyre_loads, tyre_of
from pneumo_ros.effects.terms import added, advanced, at_rest, parameters, restored, sagged, started, stored, switches
from pneumo_ros.plant.air_spring import AreaSurface, Gas
from pneumo_ros.plant.equations import Body, State, accelerations
from pneumo_ros.plant.integrator import moved
from pneumo_ros.rig.channels import sprung_points

__all__ = ["Feed", "Loads", "Signals", "added", "simulate"]


class Signals(NamedTuple):
    """What terms see, front and rear."""

    strut_f: Strut
    strut_r: Strut
    air_f: Air
    air_r: Air
    tyre_f: Tyre
    tyre_r: Tyre


class Loads(NamedTuple):
    """Forces of springs and tyres, N, dP/dt of the springs, Pa/s, force and moment on the body, N and N m."""

    spring_f: float
    spring_r: float
    air_f: float
    air_r: float
    tyre_f: float
    tyre_r: float
    heave: float
    pitch: float


class Feed(NamedTuple):
    """Supply of both springs: pressure, Pa absolute, its (P_ref/P)^k, and the drop that made them, Pa."""

    pressure_f: float
    pressure_r: float
    power_f: float
    power_r: float
    drop: float


@njit(cache=True, error_model="numpy", inline="always")
def ends(
    x: State,
    u: tuple[float, float, float, float],
    height_f: float,
    height_r: float,
    slope_f: float,
    slope_r: float,
    feed: Feed,
    body: Body,
    front: Gas,
    rear: Gas,
    surface: AreaSurface,
) -> Signals:
    """Strut, air and tyre of both ends.

    Parameters
    ----------
    x : state of the half car, (10,)
    u : orifice areas of VALVES, m2
    height_f, height_r : road under each axle, m
    slope_f, slope_r : its rate, m/s
    feed : the supply
    body, front, rear, surface : parameters of the half car
    """
    z, q, zuf, zur, v, w, vuf, vur, pf, pr = x
    top_f, top_r = sprung_points(z, q, body.front_arm, body.rear_arm)
    rate_f, rate_r = sprung_points(v, w, body.front_arm, body.rear_arm)
    hf, hr, hfv, hrv = top_f - zuf, top_r - zur, rate_f - vuf, rate_r - vur
    load_f, load_r = tyre_loads(body)
    return Signals(
        strut_of(top_f, zuf, rate_f, vuf, pf - front.ambient_pressure, body.area_scale_front, body.damping_front, body,
                 surface),
        strut_of(top_r, zur, rate_r, vur, pr - rear.ambient_pressure, body.area_scale_rear, body.damping_rear, body,
                 surface),
        air_of(pf, hf, hfv, u[0], u[2], feed.pressure_f, feed.power_f, front),
        air_of(pr, hr, hrv, u[1], u[3], feed.pressure_r, feed.power_r, rear),
        tyre_of(top_f, zuf, rate_f, vuf, height_f, slope_f, body.tyre_stiffness_front, load_f),
        tyre_of(top_r, zur, rate_r, vur, height_r, slope_r, body.tyre_stiffness_rear, load_r),
    )  # fmt: skip


@njit(cache=True, error_model="numpy", inline="always")
def nominal_loads(s: Signals, extra: Loads, front: Gas, rear: Gas) -> Loads:
    """Loads of the nominal equations, with the correction ``extra`` held over the period."""
    return Loads(
        s.strut_f.force + extra.spring_f,
        s.strut_r.force + extra.spring_r,
        air_rate(s.air_f, front.mean_area) + extra.air_f,
        air_rate(s.air_r, rear.mean_area) + extra.air_r,
        s.tyre_f.force + extra.tyre_f,
        s.tyre_r.force + extra.tyre_r,
        extra.heave,
        extra.pitch,
    )


@njit(cache=True, error_model="numpy", inline="always")
def rates(x: State, loads: Loads, body: Body) -> State:
    """Time derivative of the state (10,) under given loads."""
    heave, pitch, front, rear = accelerations(
        loads.spring_f, loads.spring_r, loads.tyre_f, loads.tyre_r, loads.heave, loads.pitch, body
    )
    return x[4], x[5], x[6], x[7], heave, pitch, front, rear, loads.air_f, loads.air_r


@njit(cache=True, error_model="numpy", inline="always")
def fed(feed: Feed, drop: float, front: Gas, rear: Gas) -> Feed:
    """The supply sagged by ``drop``, Pa; as it is while the drop stays (two powers a step are dear)."""
    if drop != feed.drop:
        pressure_f, pressure_r = front.supply_pressure - drop, rear.supply_pressure - drop
        power_f = (front.reference_pressure / pressure_f) ** front.k
        power_r = (rear.reference_pressure / pressure_r) ** rear.k
        feed = Feed(pressure_f, pressure_r, power_f, power_r, drop)
    return feed


@njit(cache=True, inline="always")
def diverged(x: State) -> bool:
    """Whether a run has left what a rig can do: it must not cost the time of the whole log, nor raise."""
    return not (abs(x[0]) < 1.0 and abs(x[1]) < 2.0 and x[8] > 1e3 and x[9] > 1e3)


@njit(cache=True, error_model="numpy", nogil=True)
def simulate(
    x0: Array,
    commands: Array,
    road: Array,
    correction: Array,
    period: float,
    steps: int,
    body: Body,
    front: Gas,
    rear: Gas,
    surface: AreaSurface,
    on: Array,
    values: Array,
    inner: Array,
    resume: bool,
) -> Array:
    """RK4 over N periods with the active terms: states (N + 1, 10), rows after a divergence NaN.

    Parameters
    ----------
    x0 : (10,) state of the half car
    commands : (N, 4) orifice areas of VALVES, m2, held
    road : (N + 1, 2) heights, m, linear between samples
    correction : (0 or N, 9) of CORRECTIONS, held
    period : s
    steps : RK4 steps a period
    body, front, rear, surface : parameters of the half car
    on : (K, 2) bool, which term acts at which end
    values : (K, 2, M) their parameters, SI
    inner : (K, 2, S) their own states, overwritten with those at the end
    resume : begin with the states in ``inner`` instead of at rest
    """
    count = commands.shape[0]
    out = np.empty((count + 1, 10))
    out[0] = x0
    x = (x0[0], x0[1], x0[2], x0[3], x0[4], x0[5], x0[6], x0[7], x0[8], x0[9])
    dt = period / steps
    corrected = correction.shape[0] > 0
    extra, held = Loads(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0
    feed = Feed(front.supply_pressure, rear.supply_pressure, front.supply_power, rear.supply_power, 0.0)
    acting, flags = switches(on)
    p = parameters(values)
    if resume:
        z = restored(inner)
        feed = fed(feed, sagged(z, flags, p, 0.0), front, rear)
        u = (commands[0, 0], commands[0, 1], commands[0, 2], commands[0, 3])
    else:
        u = (commands[0, 0], commands[0, 1], commands[0, 2], commands[0, 3])
        s = ends(x, u, road[0, 0], road[0, 1], 0.0, 0.0, feed, body, front, rear, surface)
        z = started(at_rest(), flags, p, s)
    for i in range(count):
        u = (commands[i, 0], commands[i, 1], commands[i, 2], commands[i, 3])
        rf, rr = road[i, 0], road[i, 1]
        df, dr = (road[i + 1, 0] - rf) / steps, (road[i + 1, 1] - rr) / steps
        vf, vr = df / dt, dr / dt
        if corrected:
            c = correction[i]
            extra, held = Loads(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]), c[8]
        for j in range(steps):
            f0, r0 = rf + j * df, rr + j * dr
            if acting:
                s = ends(x, u, f0, r0, vf, vr, feed, body, front, rear, surface)
                z = advanced(z, flags, p, s, dt)
            feed = fed(feed, sagged(z, flags, p, held), front, rear)
            y, rise = x, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            for stage in range(4):
                at = 0.5 if stage == 1 or stage == 2 else (0.0 if stage == 0 else 1.0)
                s = ends(y, u, f0 + at * df, r0 + at * dr, vf, vr, feed, body, front, rear, surface)
                k = rates(y, added(z, flags, p, s, nominal_loads(s, extra, front, rear)), body)
                rise = moved(rise, k, dt / 3.0 if stage == 1 or stage == 2 else dt / 6.0)
                if stage < 3:
                    y = moved(x, k, (dt if stage == 2 else 0.5 * dt))
            x = moved(x, rise, 1.0)
        if diverged(x):
            out[i + 1 :] = np.nan
            return out
        for m in range(10):
            out[i + 1, m] = x[m]
    stored(z, inner)
    return out
