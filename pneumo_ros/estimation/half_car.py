"""The half car's estimator: rates and accelerations from displacements, effective areas by least squares.

Eqs. 6.91-6.93 with what the rig has besides: gauge pressure makes force (errata 7) and bushing damping acts between
body and axle. Measurement order is that of :data:`MEASUREMENT_NAMES`, all values at one instant.
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
from pneumo_ros.plant.air_spring import MEAN_AREA
from pneumo_ros.rig import Rig
from pneumo_ros.units import GRAVITY

MEASUREMENT_NAMES = (
    "sprung_front",
    "sprung_rear",
    "unsprung_front",
    "unsprung_rear",
    "pressure_front",
    "pressure_rear",
)
ESTIMATE_NAMES = (
    "heave",
    "pitch",
    "heave_rate",
    "pitch_rate",
    "heave_acceleration",
    "pitch_acceleration",
    "height_front",
    "height_rear",
    "height_rate_front",
    "height_rate_rear",
    "height_acceleration_front",
    "height_acceleration_rear",
    "pressure_front",
    "pressure_rear",
    "area_front",
    "area_rear",
)

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

    def init(self, measurement: NDArray[np.float64]) -> EstimatorState:
        """State at rest at a first measurement (6,)."""
        return EstimatorState(
            self.differentiator.init(np.asarray(measurement, dtype=float)[:4]),
            np.full(2, self.area_start),
            initial_gain(2, self.gain_start),
        )

    def step(
        self, state: EstimatorState, measurement: NDArray[np.float64]
    ) -> tuple[EstimatorState, NDArray[np.float64]]:
        """Take in a measurement (6,), m and Pa; return new state and estimate (16,), :data:`ESTIMATE_NAMES`."""
        derivatives, areas, gain, estimate = estimate_half_car(*state, measurement, self.gains, self.model)
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
    )
    return Estimator(model, differentiator, differentiator.coefficients, float(v["gain_start"]), float(v["area_start"]))


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
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """One step: new derivatives (4, n + 1), areas (2,), gain (2, 2) and the estimate (16,)."""
    new = differentiate(derivatives, measurement[:4], gains, model.filtering, model.period)
    out = np.empty(16)
    for order in range(3):
        heave, pitch, front, rear = kinematics(new, order, model.filtering, model)
        out[2 * order], out[2 * order + 1] = heave, pitch
        out[6 + 2 * order], out[7 + 2 * order] = front, rear
    out[12], out[13] = measurement[4], measurement[5]
    new_areas, new_gain = estimate_areas(out, areas, gain, model)
    return new, new_areas, new_gain, out


@njit(cache=True, error_model="numpy")
def estimate_areas(
    x: NDArray[np.float64], areas: NDArray[np.float64], gain: NDArray[np.float64], model: Model
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Least squares step on an estimate (16,) whose kinematics and pressures are in; writes its areas, m2."""
    W, residual = regression(x, areas, model)
    new_areas, new_gain = update(
        model.method, areas, gain, W, residual, model.forgetting, model.gain_bound, model.period
    )
    x[14], x[15] = MEAN_AREA * new_areas[0], MEAN_AREA * new_areas[1]
    return new_areas, new_gain


@njit(cache=True, error_model="numpy")
def regression(
    x: NDArray[np.float64], areas: NDArray[np.float64], model: Model
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """W (2, 2) and Y - Psi - W a (2,) of Eq. 6.91, both rows in m/s2.

    The pitch row is multiplied by the radius of gyration: without that the rows have different units, and the least
    squares would weigh the pitch equation by the square of an arbitrary length.
    """
    radius = np.sqrt(model.inertia / model.mass)
    pf, pr = (x[12] - model.ambient) * MEAN_AREA / model.mass, (x[13] - model.ambient) * MEAN_AREA / model.mass
    df, dr = model.damping * x[8] / model.mass, model.damping * x[9] / model.mass
    a, b = model.front_arm / radius, model.rear_arm / radius
    W = np.array([[pf, pr], [a * pf, -b * pr]])
    y = np.array([x[4] + GRAVITY + df + dr, radius * x[5] + a * df - b * dr])
    for m in range(2):
        y[m] -= W[m, 0] * areas[0] + W[m, 1] * areas[1]
    return W, y
