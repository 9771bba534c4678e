# SPDX-License-Identifier: Apache-2.0
"""The true law of an effect as a curve over its own coordinate, as the held-out session shows it.

The effect's own part is what the rig's equations give with it less what they give without it, at the very states of the
session. A law with a memory has no single curve: the mean over the session at each value of the coordinate is stated.
Forces act on the body, N upwards (on the axle for the tyre's); rates are of extension (of compression for the tyre).

Kernel arguments
----------------
states : (N, SIZE) of the session
road, speed : (N,) height of the ground, m, and its rate, m/s
spool, outlet : (N,) position of the inlet's spool and the constant outlet opening, m2
at, index : first of the end's own states, and which end (0 front, 1 rear)
rows : (ROWS, COLUMNS) second laws of this end
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.casemaker.contact import lossy_tyre
from pneumo_ros.casemaker.derivative import FRONT, REAR, SPOOL, TANK, TREAD, inlet_flow, lost_flow, suspension_force
from pneumo_ros.casemaker.open_loop import read
from pneumo_ros.casemaker.parameters import End, Frame, RicherRig
from pneumo_ros.casemaker.scene import Session
from pneumo_ros.plant.air_spring import AreaSurface

BINS, FEWEST = 30, 5
CHANNELS = ("sprung_front", "sprung_rear", "unsprung_front", "unsprung_rear", "front_pressure", "rear_pressure")
Samples = NDArray[np.float64]
Curve = dict[str, Any]
STRUT_OVER_RATE = ("coulomb_friction", "viscous_damping")
STRUT_OVER_HEIGHT = ("bump_stop", "effective_area_error", "bellows_hysteresis")
STRAIGHT = ("lvdt_scale", "pressure_scale")


@njit(cache=True, error_model="numpy")
def _strut(
    states: Samples, at: int, index: int, rows: Samples, end: End, frame: Frame, surface: AreaSurface
) -> Samples:
    """(N, 3): height, rate, force."""
    out, scratch = np.empty((states.shape[0], 3)), np.zeros(states.shape[1])
    for i in range(states.shape[0]):
        x = states[i]
        height = x[0] + end.arm * x[1] - x[2 + index]
        rate = x[4] + end.arm * x[5] - x[6 + index]
        force = suspension_force(x, scratch, at, height, rate, x[8 + index], rows, end, frame, surface)
        out[i, 0], out[i, 1], out[i, 2] = height, rate, force
    return out


@njit(cache=True, error_model="numpy")
def _tyre(states: Samples, road: Samples, speed: Samples, at: int, index: int, rows: Samples, end: End) -> Samples:
    """(N, 3): deflection, rate, force."""
    out, scratch = np.empty((states.shape[0], 3)), np.zeros(states.shape[1])
    static = -states[0, 2 + index]
    for i in range(states.shape[0]):
        x = states[i]
        deflection, rate = road[i] - x[2 + index], speed[i] - x[6 + index]
        out[i, 0], out[i, 1] = deflection, rate
        out[i, 2] = lossy_tyre(x, scratch, at + TREAD, deflection, rate, static, rows, end)
    return out


@njit(cache=True, error_model="numpy")
def _flows(states: Samples, spool: Samples, outlet: float, at: int, index: int, rows: Samples, end: End, frame: Frame,
           ) -> Samples:  # fmt: skip
    """(N, 3): pressure, inflow, outflow with leaks; the gas at its polytropic temperature."""
    out = np.empty((states.shape[0], 3))
    k = (frame.exponent - 1.0) / frame.exponent
    for i in range(states.shape[0]):
        pressure = states[i, 8 + index]
        supply = states[i, TANK] if frame.tank_volume > 0.0 else frame.supply_pressure
        gas = frame.supply_temperature * (pressure / end.reference_pressure) ** k
        out[i, 0] = pressure
        out[i, 1] = inlet_flow(spool[i], supply, pressure, frame.supply_temperature, rows, end, frame)
        out[i, 2] = lost_flow(outlet, pressure, gas, 0.0, rows, end, frame)
    return out


def curve_of(
    effect: str, side: str | None, places: tuple[str, ...], rig: RicherRig, without: RicherRig, session: Session,
    surface: AreaSurface,
) -> Curve | None:  # fmt: skip
    """The curve of one effect (at the front where it acts at both ends); None where a curve makes no sense."""
    end = "rear" if side == "rear" else "front"
    if effect in STRUT_OVER_RATE + STRUT_OVER_HEIGHT:
        table, less = (_of_strut(one, end, session, surface) for one in (rig, without))
        column, name, unit = (1, "rate", "m/s") if effect in STRUT_OVER_RATE else (0, "height", "m")
        return _binned(table[:, column], table[:, 2] - less[:, 2], (name, unit), ("force", "N"))
    if effect in ("tyre_damping", "tyre_liftoff"):
        table, less = (_of_tyre(one, end, session) for one in (rig, without))
        column, name, unit = (1, "rate", "m/s") if effect == "tyre_damping" else (0, "compression", "m")
        return _binned(table[:, column], table[:, 2] - less[:, 2], (name, unit), ("force", "N"))
    if effect in ("leak", "orifice_coefficient"):
        return _of_flow(effect, end, rig, without, session)
    if effect == "supply_droop":
        flow = sum(_of_flows(rig, one, session)[:, 1] for one in ("front", "rear"))
        drop = rig.frame.supply_pressure - session.run.states[:, TANK]
        return _binned(np.asarray(flow), drop, ("inflow", "kg/s"), ("drop", "Pa"))
    if effect in STRAIGHT:
        return _of_sensor(places[0], rig, without, session)
    return None


def _of_strut(rig: RicherRig, end: str, session: Session, surface: AreaSurface) -> Samples:
    at, index, it = (FRONT, 0, rig.front) if end == "front" else (REAR, 1, rig.rear)
    return np.asarray(_strut(session.run.states, at, index, rig.rows[index], it, rig.frame, surface))


def _of_tyre(rig: RicherRig, end: str, session: Session) -> Samples:
    at, index, it = (FRONT, 0, rig.front) if end == "front" else (REAR, 1, rig.rear)
    road = np.ascontiguousarray(session.road[:, index])
    speed = np.gradient(road, session.time)
    return np.asarray(_tyre(session.run.states, road, speed, at, index, rig.rows[index], it))


def _of_flows(rig: RicherRig, end: str, session: Session) -> Samples:
    at, index, it = (FRONT, 0, rig.front) if end == "front" else (REAR, 1, rig.rear)
    spool = session.run.inlets[:, index]
    if session.run.states[:, at + SPOOL].std() > 0.0:
        spool = session.run.states[:, at + SPOOL]
    return np.asarray(_flows(session.run.states, np.ascontiguousarray(spool), session.outlets[index], at, index,
                             rig.rows[index], it, rig.frame))  # fmt: skip


def _of_flow(effect: str, end: str, rig: RicherRig, without: RicherRig, session: Session) -> Curve:
    table, less = _of_flows(rig, end, session), _of_flows(without, end, session)
    if effect == "leak":
        return _binned(table[:, 0], table[:, 2] - less[:, 2], ("pressure", "Pa"), ("flow", "kg/s"))
    opening = session.run.inlets[:, 0 if end == "front" else 1]
    return _binned(opening, table[:, 1] - less[:, 1], ("opening", "m2"), ("flow", "kg/s"))


def _of_sensor(place: str, rig: RicherRig, without: RicherRig, session: Session) -> Curve:
    """Error over the true value, from the two rigs' readings of the same states."""
    channel = CHANNELS.index(place.removeprefix("sensor:"))
    states = session.run.states[::5]
    pairs = np.array([(read(without, x)[channel], read(rig, x)[channel]) for x in states])
    unit = "m" if channel < 4 else "Pa"
    return _binned(pairs[:, 0], pairs[:, 1] - pairs[:, 0], ("value", unit), ("error", unit))


def _binned(x: Samples, y: Samples, horizontal: tuple[str, str], vertical: tuple[str, str]) -> Curve:
    """Means of ``y`` in equal bins of ``x`` (1st to 99th percentile), with each bin's share of the samples."""
    low, high = np.percentile(x, (1.0, 99.0))
    edges = np.linspace(low, max(high, low + 1e-12), BINS + 1)
    where = np.digitize(x, edges) - 1
    bins = [where == k for k in range(BINS)]
    points = [[float(x[one].mean()), float(y[one].mean()), float(one.mean())] for one in bins if one.sum() >= FEWEST]
    return {"x": {"name": horizontal[0], "unit": horizontal[1]}, "y": {"name": vertical[0], "unit": vertical[1]},
            "points": points}  # fmt: skip
