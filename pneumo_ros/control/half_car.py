# SPDX-License-Identifier: Apache-2.0
"""The half car's active controllers: one feedback linearisation core, one law for heave and pitch, variants by flags.

Eqs. 6.58-6.90, corrected by errata 8, 10 and 11. Gains of Section 6.7.5 are in inch-second units, as their names say.

Two defaults differ from Section 6.7.5, because the rig has sensors, 500 Hz and a real spring where the thesis has exact
accelerations:

* K_s of heave is 5000 in/s3, not 20000. Inside the boundary layer the sliding term adds (2/pi) K_s/phi to the velocity
  gain and lambda times that to the position gain, but nothing to the acceleration gain 3 lambda. At 20000/10 the triple
  pole's damping ratio of 1 becomes 0.27 (a pair near 6 Hz), which the accelerations' lag of some 5 ms makes ring; at
  5000/10 it is 0.49.
* The area the controller divides by has a floor of 1 in2. At 2.2 in the spring has no area left: the wanted pressure
  rate F'/A grows without bound there, and the valves saturate.

Heave rms falls by 60-71 % against passive on five class D roads with these, by 25-66 % with the printed ones.

Kernel arguments
----------------
state : (8,) reference of heave and its two derivatives, the same of pitch, integrals of both errors
x : (16,) estimate, see :mod:`pneumo_ros.estimation.half_car`
side, output : 0 front, 1 rear; 0 heave, 1 pitch
value, high : an opening and the largest one, m2
p, packed : numbers of :attr:`Controller.packed`
heights, pressures, cubics : fields of :class:`~pneumo_ros.plant.air_spring.AreaSurface`
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pneumo_ros.control.laws.common import Error, Gains
from pneumo_ros.control.laws.family import FLC, LAWS, wanted_jerk
from pneumo_ros.control.linearisation import Compensation, Spring, believed_volume, force_rates, openings
from pneumo_ros.control.reference_model import advance_reference, reference_jerk
from pneumo_ros.errors import InputError
from pneumo_ros.parameters import Parameter, Value, settings
from pneumo_ros.plant.air_spring import AreaSurface, Gas, load_surface
from pneumo_ros.plant.half_car import gas_of
from pneumo_ros.plant.integrator import unpack_gas
from pneumo_ros.plant.trim import Trim, trim
from pneumo_ros.rig import Rig
from pneumo_ros.rig.channels import HEAVE, PITCH
from pneumo_ros.units import CUBIC_INCH, INCH, SQUARE_INCH

__all__ = ["CONTROLLERS", "PARAMETERS", "TELEMETRY_NAMES", "Controller", "build_controller"]

VARIANTS: dict[str, tuple[str, bool, bool]] = {  # law, dA/dt fed forward, outlets commanded
    **{law: (law, False, False) for law in LAWS},
    "area_rate_feedforward": ("first_order_smflc", True, False),
    "two_valve": ("first_order_smflc", True, True),
}
CONTROLLERS = ("passive", *VARIANTS)
PROFILE = "profile"  # no controller: a table of openings is played, see pneumo_ros.control.profile
HEAVE_REFERENCE, PITCH_REFERENCE = 0, 3  # places in the controller's state of what heave and pitch follow
TELEMETRY_NAMES = ("surface_heave", "surface_pitch", "inlet_front_unclipped", "inlet_rear_unclipped")

PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        "controller",
        "first_order_smflc",
        "",
        "which controller; profile plays valve_profile, open loop",
        choices=(*CONTROLLERS, PROFILE),
        read_only=True,
    ),
    Parameter(
        "valve_profile",
        "",
        "",
        "CSV file with time_s and openings such as front_inlet_m2, for the controller 'profile'",
        read_only=True,
    ),
    Parameter(
        "pole", 10.0, "1/s", "lambda: triple pole of the error's dynamics and of the sliding surface", 0.5, 200.0
    ),
    Parameter(
        "follow_axles", False, "", "reference model leads to design height above the axles, not to a fixed height"
    ),
    Parameter("reference_pole", 10.0, "1/s", "triple pole of the reference model", 0.5, 200.0),
    Parameter("sliding_heave_in_s3", 5000.0, "in/s^3", "K_s of heave (Section 6.7.5 has 20000)", 0.0, 1e6),
    Parameter("sliding_pitch_rad_s3", 100.0, "rad/s^3", "K_s of pitch", 0.0, 1e6),
    Parameter("layer_heave_in_s", 10.0, "in/s", "boundary layer of heave; in/s^2 for third order surfaces", 1e-3, 1e4),
    Parameter(
        "layer_pitch_rad_s", 2.0, "rad/s", "boundary layer of pitch; rad/s^2 for third order surfaces", 1e-3, 1e4
    ),
    Parameter(
        "volume_estimate_in3",
        0.0,
        "in^3",
        "constant volume the controller believes (thesis: 4); 0: by height",
        0.0,
        50.0,
    ),
    Parameter("height_error_in", 0.0, "in", "error added to the heights the controller reads (thesis: 0.2)", -1.0, 1.0),
    Parameter(
        "mass_scale", 1.0, "1", "believed over true sprung mass and inertia (payload uncertainty, Eq. 6.57)", 0.1, 5.0
    ),
    Parameter("area_rate_share", 0.6, "1", "share of dA/dt fed forward by the variants that do", 0.0, 1.5),
    Parameter("bushing_feedforward", False, "", "compensate the bushing damping's force rate"),
    Parameter(
        "area_floor_in2",
        1.0,
        "in^2",
        "least area the controller believes: beyond full extension none is left",
        0.0,
        5.0,
    ),
    Parameter("constant_area_in2", 0.0, "in^2", "constant area the controller believes; 0: the estimator's", 0.0, 20.0),
)


class Law(NamedTuple):
    """Parameters of an active controller, flat for compiled code; SI."""

    law: int
    heave: Gains
    pitch: Gains
    reference_pole: float
    target_heave: float
    target_pitch: float
    mass: float
    inertia: float
    front_arm: float
    rear_arm: float
    outlet_front: float
    outlet_rear: float
    inlet_max: float
    outlet_max: float
    volume_estimate: float
    constant_area: float
    area_floor: float
    height_error: float
    compensation: Compensation
    follow_axles: bool
    design_height: float
    period: float


@dataclass(frozen=True)
class Controller:
    """A controller ready to step: parameters only.

    Attributes
    ----------
    name : one of :data:`CONTROLLERS`
    at_rest : the trim it starts from and levels to
    law : parameters
    front, rear : gas of each spring as the controller believes it
    surface : effective area surface, for the variants that feed dA/dt forward
    """

    name: str
    at_rest: Trim
    law: Law
    front: Gas
    rear: Gas
    surface: AreaSurface

    def init(self, estimate: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """State (8,): reference model of heave and of pitch (value, rate, acceleration), integrals of their errors.

        The reference starts where the estimate (16,) is, so the start is bumpless; without one, at trim.
        """
        state = np.zeros(8)
        if estimate is None:
            state[HEAVE_REFERENCE], state[PITCH_REFERENCE] = self.law.target_heave, self.law.target_pitch
        else:
            state[HEAVE_REFERENCE], state[PITCH_REFERENCE] = estimate[0], estimate[1]
        return state

    def step(
        self, state: NDArray[np.float64], estimate: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """New state (8,), command (4,) of VALVES, m2, telemetry (4,) of :data:`TELEMETRY_NAMES`."""
        if self.name == "passive":
            return state, self.at_rest.command, np.zeros(4)
        surface = self.surface
        return control_packed(state, estimate, self.packed, surface.heights, surface.pressures, surface.cubics)

    @cached_property
    def packed(self) -> NDArray[np.float64]:
        """Law, front and rear gas in one array: handed over one by one, the numbers cost as much as the control law."""
        law = self.law
        nested = [*law.heave, *law.pitch, *law.compensation]
        flat = [float(getattr(law, name)) for name in Law._fields if name not in ("heave", "pitch", "compensation")]
        return np.array([*nested, *flat, *self.front, *self.rear])

    def with_values(self, values: dict[str, Value], rig: Rig) -> Controller:
        """A copy with changed gains, for live changes; the state goes on."""
        changed = build_controller(rig, self.law.period, {"controller": self.name, **values})
        return replace(self, law=changed.law)


def build_controller(
    rig: Rig, period: float, values: dict[str, Value] | None = None, where: object = "controller"
) -> Controller:
    """A controller for a rig from parameters (names of :data:`PARAMETERS`), stepped every ``period`` s."""
    v = settings(PARAMETERS, values, where)
    name = str(v["controller"])
    if name == PROFILE:
        raise InputError("a valve profile is played in open loop", where=where, key="controller", value=name,
                         allowed=", ".join(CONTROLLERS))  # fmt: skip
    at_rest = trim(rig)
    law = _law(rig, at_rest, name, v, period)
    front, rear = (gas_of(rig, pressure) for pressure in at_rest.pressures)
    return Controller(name, at_rest, law, front, rear, load_surface())


def _law(rig: Rig, at_rest: Trim, name: str, v: dict[str, Value], period: float) -> Law:
    law, area_rate, two_valve = VARIANTS.get(name, ("first_order_smflc", False, False))
    pole = float(v["pole"])
    damping = rig.bushing_damping.value if v["bushing_feedforward"] else 0.0
    return Law(
        law=LAWS.index(law),
        heave=Gains(pole, float(v["sliding_heave_in_s3"]) * INCH, float(v["layer_heave_in_s"]) * INCH),
        pitch=Gains(pole, float(v["sliding_pitch_rad_s3"]), float(v["layer_pitch_rad_s"])),
        reference_pole=float(v["reference_pole"]),
        target_heave=float(at_rest.state[HEAVE]),
        target_pitch=float(at_rest.state[PITCH]),
        mass=rig.sprung_mass.value * float(v["mass_scale"]),
        inertia=rig.pitch_inertia.value * float(v["mass_scale"]),
        front_arm=rig.front_arm.value,
        rear_arm=rig.rear_arm.value,
        outlet_front=at_rest.outlets[0],
        outlet_rear=at_rest.outlets[1],
        inlet_max=rig.inlet_area_max.value,
        outlet_max=rig.inlet_area_max.value,
        volume_estimate=float(v["volume_estimate_in3"]) * CUBIC_INCH,
        constant_area=float(v["constant_area_in2"]) * SQUARE_INCH,
        area_floor=float(v["area_floor_in2"]) * SQUARE_INCH,
        height_error=float(v["height_error_in"]) * INCH,
        compensation=Compensation(float(v["area_rate_share"]) * area_rate, damping, float(two_valve)),
        follow_axles=bool(v["follow_axles"]),
        design_height=rig.design_height.value,
        period=period,
    )


@njit(cache=True)
def _clip(value: float, high: float) -> float:
    return min(max(value, 0.0), high)


@njit(cache=True, error_model="numpy")
def believed_spring(x: NDArray[np.float64], side: int, law: Law, gas: Gas) -> Spring:
    """The spring of one side (0 front, 1 rear) as the controller believes it, with its uncertainties."""
    height = x[6 + side] + law.height_error
    volume, mean_area = believed_volume(height, law.volume_estimate, gas)
    area = law.constant_area if law.constant_area > 0.0 else max(x[14 + side], law.area_floor)
    return Spring(x[12 + side], height, x[8 + side], x[10 + side], area, volume, mean_area)


@njit(cache=True, error_model="numpy")
def wanted_position(x: NDArray[np.float64], output: int, law: Law) -> float:
    """Target of the reference model: heave (0), m, or pitch (1), rad; fixed, or design height above the axles."""
    if not law.follow_axles:
        return law.target_heave if output == 0 else law.target_pitch
    wheelbase = law.front_arm + law.rear_arm
    front, rear = law.design_height - x[6], law.design_height - x[7]
    if output == 0:
        return x[0] + (law.rear_arm * front + law.front_arm * rear) / wheelbase
    return x[1] + (front - rear) / wheelbase


@njit(cache=True, error_model="numpy")
def control_half_car(
    state: NDArray[np.float64], x: NDArray[np.float64], law: Law, front: Gas, rear: Gas, surface: AreaSurface
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """One step: state (8,), estimate (16,) -> new state, command (4,), telemetry (4,)."""
    new, jerk, telemetry = np.empty(8), np.empty(2), np.empty(4)
    for i in range(2):
        gains = law.heave if i == 0 else law.pitch
        target = wanted_position(x, i, law)
        reference = (state[3 * i], state[3 * i + 1], state[3 * i + 2])
        if law.law == FLC:
            reference = (target, 0.0, 0.0)
        lead = reference_jerk(reference, target, law.reference_pole)
        e = Error(x[i] - reference[0], x[2 + i] - reference[1], x[4 + i] - reference[2], state[6 + i], lead)
        jerk[i], telemetry[i] = wanted_jerk(law.law, e, gains)
        moved = advance_reference(reference, target, law.reference_pole, law.period)
        new[3 * i], new[3 * i + 1], new[3 * i + 2] = moved
        new[6 + i] = state[6 + i] + law.period * e.value
    rate_front, rate_rear = force_rates(jerk[0], jerk[1], law.mass, law.inertia, law.front_arm, law.rear_arm)
    spring = believed_spring(x, 0, law, front)
    in_front, out_front = openings(rate_front, spring, law.outlet_front, law.compensation, front, surface)
    spring = believed_spring(x, 1, law, rear)
    in_rear, out_rear = openings(rate_rear, spring, law.outlet_rear, law.compensation, rear, surface)
    telemetry[2], telemetry[3] = in_front, in_rear
    command = np.array([
        _clip(in_front, law.inlet_max),
        _clip(in_rear, law.inlet_max),
        _clip(out_front, law.outlet_max),
        _clip(out_rear, law.outlet_max),
    ])  # fmt: skip
    return new, command, telemetry


@njit(cache=True)
def _unpack_law(p: NDArray[np.float64]) -> Law:
    """The first 28 numbers of :attr:`Controller.packed`."""
    return Law(
        law=int(p[9]),
        heave=Gains(p[0], p[1], p[2]),
        pitch=Gains(p[3], p[4], p[5]),
        reference_pole=p[10],
        target_heave=p[11],
        target_pitch=p[12],
        mass=p[13],
        inertia=p[14],
        front_arm=p[15],
        rear_arm=p[16],
        outlet_front=p[17],
        outlet_rear=p[18],
        inlet_max=p[19],
        outlet_max=p[20],
        volume_estimate=p[21],
        constant_area=p[22],
        area_floor=p[23],
        height_error=p[24],
        compensation=Compensation(p[6], p[7], p[8]),
        follow_axles=p[25] > 0.5,
        design_height=p[26],
        period=p[27],
    )


@njit(cache=True, error_model="numpy")
def control_packed(
    state: NDArray[np.float64],
    x: NDArray[np.float64],
    packed: NDArray[np.float64],
    heights: NDArray[np.float64],
    pressures: NDArray[np.float64],
    cubics: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """:func:`control_half_car` from packed parameters."""
    law, front, rear = _unpack_law(packed), unpack_gas(packed, 28), unpack_gas(packed, 42)
    return control_half_car(state, x, law, front, rear, AreaSurface(heights, pressures, cubics))
