# SPDX-License-Identifier: Apache-2.0
"""Fixed-step RK4 of the half car's equations, compiled: whole runs, and single periods from packed parameters.

Openings are held over a control period, the road is linear over it; a period is a whole number of equal steps.

Kernel arguments
----------------
x, x0, state : (10,) of :mod:`pneumo_ros.plant.equations`: m, rad, m/s, rad/s, Pa
a, b, c, d, k : rates of the state
dt, period, steps : a step, s; a control period, s, and the RK4 steps in it
command, commands : front inlet, rear inlet, front outlet, rear outlet, m2; (4,), (N, 4)
road : front and rear height at the ends of each period, m; (2, 2), (N + 1, 2)
p, packed, start : numbers of :attr:`pneumo_ros.plant.half_car.HalfCar.packed`, and where a spring's begin
heights, pressures, cubics : fields of :class:`~pneumo_ros.plant.air_spring.AreaSurface`
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.plant.air_spring import AreaSurface, Gas
from pneumo_ros.plant.equations import Body, State, derivative

DEFAULT_STEP = 0.5e-3  # s: RK4 within 5e-5 of the converged trajectory


def substeps(period: float, step: float) -> int:
    """Number of equal RK4 steps in a period, none longer than ``step`` by more than a thousandth: a clock that runs 100
    ppm slow asks for no second one."""
    return max(1, int(np.ceil((1.0 - 1e-3) * period / step)))


@njit(cache=True)
def moved(x: State, k: State, dt: float) -> State:
    """x + dt k, of the ten states."""
    return (
        x[0] + dt * k[0],
        x[1] + dt * k[1],
        x[2] + dt * k[2],
        x[3] + dt * k[3],
        x[4] + dt * k[4],
        x[5] + dt * k[5],
        x[6] + dt * k[6],
        x[7] + dt * k[7],
        x[8] + dt * k[8],
        x[9] + dt * k[9],
    )


@njit(cache=True)
def _combined(a: State, b: State, c: State, d: State) -> State:
    """RK4's weighted sum (a + 2b + 2c + d) / 6."""
    s = 1.0 / 6.0
    return (
        s * (a[0] + 2.0 * (b[0] + c[0]) + d[0]),
        s * (a[1] + 2.0 * (b[1] + c[1]) + d[1]),
        s * (a[2] + 2.0 * (b[2] + c[2]) + d[2]),
        s * (a[3] + 2.0 * (b[3] + c[3]) + d[3]),
        s * (a[4] + 2.0 * (b[4] + c[4]) + d[4]),
        s * (a[5] + 2.0 * (b[5] + c[5]) + d[5]),
        s * (a[6] + 2.0 * (b[6] + c[6]) + d[6]),
        s * (a[7] + 2.0 * (b[7] + c[7]) + d[7]),
        s * (a[8] + 2.0 * (b[8] + c[8]) + d[8]),
        s * (a[9] + 2.0 * (b[9] + c[9]) + d[9]),
    )


@njit(cache=True, error_model="numpy", nogil=True)
def simulate(
    x0: NDArray[np.float64],
    commands: NDArray[np.float64],
    road: NDArray[np.float64],
    period: float,
    steps: int,
    body: Body,
    front: Gas,
    rear: Gas,
    surface: AreaSurface,
) -> NDArray[np.float64]:
    """Fixed-step RK4: (10,), (N, 4), (N + 1, 2) -> (N + 1, 10); ``steps`` equal steps in each period, s.

    The state is ten scalars, not an array: that is what keeps it in registers and within 1.3x of plain C.
    """
    count = commands.shape[0]
    out = np.empty((count + 1, 10))
    out[0] = x0
    x = (x0[0], x0[1], x0[2], x0[3], x0[4], x0[5], x0[6], x0[7], x0[8], x0[9])
    dt = period / steps
    for i in range(count):
        u0, u1, u2, u3 = commands[i, 0], commands[i, 1], commands[i, 2], commands[i, 3]
        rf, rr = road[i, 0], road[i, 1]
        df, dr = (road[i + 1, 0] - rf) / steps, (road[i + 1, 1] - rr) / steps
        for j in range(steps):
            f0, r0 = rf + j * df, rr + j * dr
            fm, rm = f0 + 0.5 * df, r0 + 0.5 * dr
            k1 = derivative(x, u0, u1, u2, u3, f0, r0, body, front, rear, surface)
            k2 = derivative(moved(x, k1, 0.5 * dt), u0, u1, u2, u3, fm, rm, body, front, rear, surface)
            k3 = derivative(moved(x, k2, 0.5 * dt), u0, u1, u2, u3, fm, rm, body, front, rear, surface)
            k4 = derivative(moved(x, k3, dt), u0, u1, u2, u3, f0 + df, r0 + dr, body, front, rear, surface)
            x = moved(x, _combined(k1, k2, k3, k4), dt)
        for m in range(10):
            out[i + 1, m] = x[m]
    return out


@njit(cache=True)
def unpack_body(p: NDArray[np.float64]) -> Body:
    """The first 14 numbers of :attr:`pneumo_ros.plant.half_car.HalfCar.packed`."""
    return Body(p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11], p[12], p[13])


@njit(cache=True)
def unpack_gas(p: NDArray[np.float64], start: int) -> Gas:
    """Fourteen numbers of :attr:`pneumo_ros.plant.half_car.HalfCar.packed`, from 14 (front) or 28 (rear)."""
    q = p[start : start + 14]
    return Gas(q[0], q[1], q[2], q[3], q[4], q[5], q[6], q[7], q[8], q[9], q[10], q[11], q[12], q[13])


@njit(cache=True, error_model="numpy")
def advance_packed(
    state: NDArray[np.float64],
    command: NDArray[np.float64],
    road: NDArray[np.float64],
    period: float,
    steps: int,
    packed: NDArray[np.float64],
    heights: NDArray[np.float64],
    pressures: NDArray[np.float64],
    cubics: NDArray[np.float64],
) -> NDArray[np.float64]:
    """One period of :func:`simulate` from packed parameters: (10,), (4,), (2, 2) -> (10,)."""
    surface = AreaSurface(heights, pressures, cubics)
    body, front, rear = unpack_body(packed), unpack_gas(packed, 14), unpack_gas(packed, 28)
    return simulate(state, command.reshape(1, 4), road, period, steps, body, front, rear, surface)[1]
