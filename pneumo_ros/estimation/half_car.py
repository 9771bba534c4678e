# SPDX-License-Identifier: Apache-2.0
"""The half car's estimator: rates and accelerations from displacements, effective areas by least squares.

Eqs. 6.91-6.93 with what the rig has besides: gauge pressure makes force (errata 7) and bushing damping acts between
body and axle. Measurements are those of
:data:`~pneumo_ros.rig.channels.CHANNELS`, all values at one instant.

Kernel arguments
----------------
d, derivatives : (4, n + 1) filtered values and derivatives of the four LVDTs, m, m/s, m/s2
order, first : which derivative, and the column of the value itself
measurement : (6,) four heights, m, and two absolute pressures, Pa
gains : of the differentiators
x : (16,) estimate: heave, pitch, their rates and accelerations, two heights with theirs, pressures, areas
a, areas : (2,) area parameters, in units of the mean area or of 1 cm of height; areas they give, m2
gain : (2, 2) of the least squares
height, gauge : of a spring, m, and its pressure over ambient, Pa
slopes : derivatives of the areas by their parameters, m2
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.estimation.differentiator import Differentiator, differentiate
from pneumo_ros.estimation.least_squares import METHODS, initial_gain, update
from pneumo_ros.parameters import Parameter, Value, settings
from pneumo_ros.plant.air_spring import MEAN_AREA, AreaSurface, effective_area, load_surface
from pneumo_ros.rig import Rig
from pneumo_ros.units import GRAVITY, INCH

HEIGHT_UNIT = 0.01  # m: the height correction is estimated in centimetres, which makes its regressor of the areas' size
SLOPE_STEP = 1e-5  # m
SMALLEST_SLOPE = 1.0 * INCH  # m2/m, i.e. 1 in2 per in: about a quarter of the surface's usual slope

PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        "order", 3, "1", "highest derivative the differentiator estimates; the controller needs 2", 2, 5, read_only=True
    ),
    Parameter("filtering", 0, "1", "filter states of the differentiator", 0, 3, read_only=True),
    Parameter(
        "sprung_bound", 3e4, "m/s^(order+1)", "L of the sprung points: bound on their derivative order + 1", 1.0, 1e12
    ),
    Parameter(
        "unsprung_bound", 1.5e5, "m/s^(order+1)", "L of the axles: bound on their derivative order + 1", 1.0, 1e12
    ),
    Parameter("method", "bounded", "", "least squares estimator of the areas", choices=METHODS, read_only=True),
    Parameter("forgetting", 50.0, "1/s", "lambda_0: bandwidth of the area estimate", 0.0, 500.0),
    Parameter("gain_bound", 20.0, "s^3/m^2", "k_0: largest norm of the gain matrix P", 1e-3, 1e6),
    Parameter("gain_start", 10.0, "s^3/m^2", "P(0), for the gradient method its constant p", 1e-6, 1e6, read_only=True),
    Parameter("area_start", 1.0, "1", "initial area over the mean area 1.573e-3 m2", 0.1, 5.0, read_only=True),
    Parameter(
        "known_surface",
        False,
        "",
        "area from the 2M2A surface; what is estimated is the height's error",
        read_only=True,
    ),
    Parameter("acceleration_from_pressure", False, "", "accelerations are W a + Psi instead of the differentiator's"),
    Parameter(
        "mass_scale", 1.0, "1", "believed over true sprung mass and inertia (payload uncertainty, Eq. 6.57)", 0.1, 5.0
    ),
)


class Model(NamedTuple):
    """What the estimator believes of the rig and how it estimates, SI; flat for compiled code."""

    front_arm: float
    rear_arm: float
    mass: float
    inertia: float
    damping: float
    ambient: float
    filtering: int
    method: int
    forgetting: float
    gain_bound: float
    period: float
    known_surface: bool
    from_pressure: bool


class EstimatorState(NamedTuple):
    """Differentiator states (4, n + 1), areas over the mean area (2,), gain P (2, 2)."""

    derivatives: NDArray[np.float64]
    areas: NDArray[np.float64]
    gain: NDArray[np.float64]


@dataclass(frozen=True)
class Estimator:
    """Parameters of the half car's estimator: the model it believes and the differentiator.

    Attributes
    ----------
    model : rig and least squares
    differentiator : of the four displacements
    gain_start, area_start : initial P and area over the mean area
    """

    model: Model
    differentiator: Differentiator
    gains: NDArray[np.float64]
    gain_start: float
    area_start: float
    surface: AreaSurface

    def init(self, measurement: NDArray[np.float64]) -> EstimatorState:
        """State at rest at a first measurement (6,)."""
        return EstimatorState(
            self.differentiator.init(np.asarray(measurement, dtype=float)[:4]),
            np.full(2, 0.0 if self.model.known_surface else self.area_start),
            initial_gain(2, self.gain_start),
        )

    def step(
        self, state: EstimatorState, measurement: NDArray[np.float64]
    ) -> tuple[EstimatorState, NDArray[np.float64]]:
        """Take in a measurement (6,), m and Pa; return new state and estimate (16,), its columns in
        :data:`~pneumo_ros.rig.channels.ESTIMATE_FIELDS`.
        """
        derivatives, areas, gain, estimate = estimate_half_car(
            *state, measurement, self.gains, self.model, self.surface
        )
        return EstimatorState(derivatives, areas, gain), estimate


def build_estimator(
    rig: Rig, period: float, values: dict[str, Value] | None = None, where: object = "estimator"
) -> Estimator:
    """The estimator of a rig from parameters (names of :data:`PARAMETERS`), sampled every ``period`` s."""
    v = settings(PARAMETERS, values, where)
    sprung, unsprung = float(v["sprung_bound"]), float(v["unsprung_bound"])
    bounds = np.array([sprung, sprung, unsprung, unsprung])
    differentiator = Differentiator(int(v["order"]), int(v["filtering"]), bounds, period)
    model = Model(
        rig.front_arm.value,
        rig.rear_arm.value,
        rig.sprung_mass.value * float(v["mass_scale"]),
        rig.pitch_inertia.value * float(v["mass_scale"]),
        rig.bushing_damping.value,
        rig.ambient_pressure.value,
        differentiator.filtering,
        METHODS.index(str(v["method"])),
        float(v["forgetting"]),
        float(v["gain_bound"]),
        period,
        bool(v["known_surface"]),
        bool(v["acceleration_from_pressure"]),
    )
    return Estimator(
        model,
        differentiator,
        differentiator.coefficients,
        float(v["gain_start"]),
        float(v["area_start"]),
        load_surface(),
    )


@njit(cache=True, error_model="numpy")
def kinematics(d: NDArray[np.float64], order: int, first: int, model: Model) -> tuple[float, float, float, float]:
    """Heave, pitch, front and rear height (or their ``order``-th derivatives) from the four points' derivatives."""
    j = first + order
    wheelbase = model.front_arm + model.rear_arm
    heave = (model.rear_arm * d[0, j] + model.front_arm * d[1, j]) / wheelbase
    return heave, (d[0, j] - d[1, j]) / wheelbase, d[0, j] - d[2, j], d[1, j] - d[3, j]


@njit(cache=True, error_model="numpy")
def estimate_half_car(
    derivatives: NDArray[np.float64],
    areas: NDArray[np.float64],
    gain: NDArray[np.float64],
    measurement: NDArray[np.float64],
    gains: NDArray[np.float64],
    model: Model,
    surface: AreaSurface,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """One step: new derivatives (4, n + 1), areas (2,), gain (2, 2) and the estimate (16,)."""
    new = differentiate(derivatives, measurement[:4], gains, model.filtering, model.period)
    out = np.empty(16)
    for order in range(3):
        heave, pitch, front, rear = kinematics(new, order, model.filtering, model)
        out[2 * order], out[2 * order + 1] = heave, pitch
        out[6 + 2 * order], out[7 + 2 * order] = front, rear
    out[12], out[13] = measurement[4], measurement[5]
    new_areas, new_gain = estimate_areas(out, areas, gain, model, surface)
    return new, new_areas, new_gain, out


@njit(cache=True, error_model="numpy")
def estimate_areas(
    x: NDArray[np.float64], a: NDArray[np.float64], gain: NDArray[np.float64], model: Model, surface: AreaSurface
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Least squares step on an estimate (16,) whose kinematics and pressures are in; writes its areas, m2.

    With a known surface it writes the corrected heights as well, and on request the accelerations that the pressures
    and areas imply (Y-hat of Eq. 6.45): they neither lag nor carry the differentiator's noise.
    """
    areas, slopes = believed_areas(x, a, model, surface)
    W, residual = regression(x, areas, slopes, model)
    new_a, new_gain = update(model.method, a, gain, W, residual, model.forgetting, model.gain_bound, model.period)
    areas, slopes = believed_areas(x, new_a, model, surface)
    x[14], x[15] = areas[0], areas[1]
    if model.from_pressure:
        _, residual = regression(x, areas, slopes, model)
        x[4] -= residual[0]
        x[5] -= residual[1] / np.sqrt(model.inertia / model.mass)
    if model.known_surface:
        x[6] += HEIGHT_UNIT * new_a[0]
        x[7] += HEIGHT_UNIT * new_a[1]
    return new_a, new_gain


@njit(cache=True, error_model="numpy")
def believed_areas(
    x: NDArray[np.float64], a: NDArray[np.float64], model: Model, surface: AreaSurface
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Front and rear areas of the parameters, m2, and their derivatives by them.

    Constant model: area = mean area times a (Eq. 6.91). Known surface: area = A(h + a cm, p), so that what is estimated
    is the error of the read height. A factor on the surface would do as well at one height, but where the surface goes
    to zero no factor makes up for a height that is read wrong.
    """
    if not model.known_surface:
        return (MEAN_AREA * a[0], MEAN_AREA * a[1]), (MEAN_AREA, MEAN_AREA)
    front, front_slope = _surface_area(x[6] + HEIGHT_UNIT * a[0], x[12] - model.ambient, surface)
    rear, rear_slope = _surface_area(x[7] + HEIGHT_UNIT * a[1], x[13] - model.ambient, surface)
    return (front, rear), (front_slope, rear_slope)


@njit(cache=True, error_model="numpy")
def _surface_area(height: float, gauge: float, surface: AreaSurface) -> tuple[float, float]:
    """A, m2, and its change by one unit of the height correction, kept away from zero so that P stays finite."""
    area = effective_area(height, gauge, surface)
    slope = (effective_area(height + SLOPE_STEP, gauge, surface) - area) / SLOPE_STEP
    return area, min(slope, -SMALLEST_SLOPE) * HEIGHT_UNIT


@njit(cache=True, error_model="numpy")
def regression(
    x: NDArray[np.float64], areas: tuple[float, float], slopes: tuple[float, float], model: Model
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """W (2, 2) and Y - Y-hat (2,) of Eq. 6.91 linearised about the believed areas, both rows in m/s2.

    The pitch row is multiplied by the radius of gyration: without that the rows have different units, and the least
    squares would weigh the pitch equation by the square of an arbitrary length.
    """
    radius = np.sqrt(model.inertia / model.mass)
    pf, pr = (x[12] - model.ambient) / model.mass, (x[13] - model.ambient) / model.mass
    front, rear = pf * areas[0] - model.damping * x[8] / model.mass, pr * areas[1] - model.damping * x[9] / model.mass
    arm_front, arm_rear = model.front_arm / radius, model.rear_arm / radius
    wf, wr = pf * slopes[0], pr * slopes[1]
    W = np.array([[wf, wr], [arm_front * wf, -arm_rear * wr]])
    residual = np.array([x[4] + GRAVITY - front - rear, radius * x[5] - arm_front * front + arm_rear * rear])
    return W, residual
