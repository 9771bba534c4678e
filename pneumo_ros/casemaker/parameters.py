# SPDX-License-Identifier: Apache-2.0
"""Parameters of the richer rig: what the nominal rig has, plus every extra, each zero (off) by default.

The names with which a fault is stated live in :mod:`pneumo_ros.casemaker.catalogue`; this module only says what the
physics needs. All SI.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.casemaker.laws.slots import Law, table
from pneumo_ros.plant.air_spring import MEAN_AREA, VOLUME_OFFSET
from pneumo_ros.plant.half_car import BUMP_STOP_HEIGHT, BUMP_STOP_STIFFNESS
from pneumo_ros.rig import LIMITS, Rig


class End(NamedTuple):
    """One end (front or rear): axle, tyre, spring, valve, line, exciter and the sensors there.

    The first block is the nominal rig, perturbed inside its tolerances. Everything after it is an extra whose
    default is its absence.
    """

    # nominal
    arm: float
    unsprung_mass: float
    tyre_stiffness: float
    damping: float
    area_scale: float
    volume_offset: float
    mean_area: float
    inlet_scale: float
    outlet_scale: float
    reference_pressure: float
    design_height: float
    # bushing: LuGre (Canudas de Wit et al. 1995); Coulomb and static level N, Stribeck velocity m/s, bristle N/m, N s/m
    coulomb: float = 0.0
    static: float = 0.0
    stribeck: float = 0.01
    bristle_stiffness: float = 4e4
    bristle_damping: float = 0.0
    bind_height: float = 0.0  # m; with a length > 0 friction acts only above this height and grows over that length
    bind_length: float = 0.0  # m
    quadratic_damping: float = 0.0  # N s2/m2, of viscous_damping: opens with speed
    extra_damping: float = 0.0  # N s/m
    # bellows: Bouc-Wen stiffness N/m, yield m, sharpness; one internal mode: stiffness N/m, rad/s, damping ratio
    bouc_stiffness: float = 0.0
    bouc_yield: float = 1e-3
    bouc_power: float = 1.0
    mode_stiffness: float = 0.0
    mode_frequency: float = 100.0
    mode_damping: float = 0.05
    area_tilt: float = 0.0  # relative change of effective area per metre of height
    area_error: float = 0.0  # relative, constant
    area_pressure: float = 0.0  # relative change per Pa from the static pressure
    # stop: Hunt-Crossley contact, N/m^1.5, s/m
    contact_height: float = 0.0
    contact_stiffness: float = 0.0
    contact_damping: float = 0.0
    # tyre
    tyre_damping: float = 0.0
    tyre_hardening: float = 0.0  # 1/m2, cubic about the static deflection
    unilateral: float = 0.0  # 1: the tyre cannot pull
    # valve: second order rad/s and ratio (0 = ideal), overlap m2, slew m2/s, stick band m2, delay s
    valve_frequency: float = 0.0
    valve_damping: float = 1.0
    valve_overlap: float = 0.0
    valve_slew: float = 0.0
    valve_stick: float = 0.0
    valve_delay: float = 0.0
    crosstalk: float = 0.0  # share of the other valve's opening that appears here
    # air
    dead_volume: float = 0.0  # m3
    leak: float = 0.0  # laminar: kg/(s Pa2) K
    leak_orifice: float = 0.0  # m2
    heat: float = 0.0  # wall conductance h A, W/K
    open_energy: float = 0.0  # 1: flow carries its own enthalpy; 0: the contract's closure n R T2 (Win - Wout)
    inlet_ratio_slope: float = 0.0  # inlet coefficient falls by this per unit of pressure ratio (Perry)
    column_frequency: float = 0.0  # air column in the line, rad/s; 0: none
    column_damping: float = 0.1
    icing: float = 0.0  # relative loss of outlet opening at the end of the run
    # exciter
    exciter_frequency: float = 0.0
    exciter_damping: float = 0.8
    # disturbance on the axle: N at rad/s
    imbalance: float = 0.0
    imbalance_frequency: float = 0.0
    imbalance_phase: float = 0.0
    # sensors
    sprung_scale: float = 1.0
    sprung_offset: float = 0.0
    sprung_curve: float = 0.0  # 1/m, quadratic error about sprung_centre
    sprung_centre: float = 0.0  # m
    sprung_play: float = 0.0  # m, half play of the rod end
    unsprung_scale: float = 1.0
    unsprung_offset: float = 0.0
    pressure_scale: float = 1.0
    pressure_offset: float = 0.0
    pressure_frequency: float = 0.0  # rad/s of the gauge line, second order; 0: ideal
    pressure_damping: float = 0.9


class Frame(NamedTuple):
    """What the two ends share, SI."""

    sprung_mass: float
    pitch_inertia: float
    stop_height: float
    stop_stiffness: float
    exponent: float
    supply_pressure: float
    supply_temperature: float
    ambient_pressure: float
    tank_volume: float = 0.0  # m3; 0: the supply never droops
    regulator: float = 0.0  # kg/(s Pa)
    cross_leak: float = 0.0  # m2, orifice between the two springs
    temperature_drift: float = 0.0  # K over the run, of the supply
    cable_stiffness: float = 0.0  # N/m, body's front point to ground
    cable_length: float = 0.0  # m, height of that point at which the cable hangs slack-free
    loose_mass: float = 0.0  # kg, payload on a soft mount
    loose_frequency: float = 0.0
    loose_damping: float = 0.1
    loose_arm: float = 0.0  # m, forward of the centre of mass
    base_mass: float = 0.0  # kg, of the exciter's frame
    base_frequency: float = 0.0
    base_damping: float = 0.05


class RicherRig(NamedTuple):
    """A rig ready to simulate; ``laws`` are its second laws, at most one of a family at an end."""

    frame: Frame
    front: End
    rear: End
    laws: tuple[Law, ...] = ()

    @property
    def rows(self) -> NDArray[np.float64]:
        """The second laws as the compiled rig takes them, (2, ROWS, COLUMNS)."""
        return table(self.laws)


def richer_rig(rig: Rig, reference_pressures: tuple[float, float]) -> RicherRig:
    """The richer rig with every extra off: the contract's plant.

    Parameters
    ----------
    rig : nominal (or perturbed) parameters
    reference_pressures : static pressures of the nominal rig at design height, front and rear, Pa absolute
    """
    value = {name: getattr(rig, name).value for name in LIMITS}
    frame = Frame(
        sprung_mass=value["sprung_mass"],
        pitch_inertia=value["pitch_inertia"],
        stop_height=BUMP_STOP_HEIGHT,
        stop_stiffness=BUMP_STOP_STIFFNESS,
        exponent=value["polytropic_exponent"],
        supply_pressure=value["supply_pressure"],
        supply_temperature=value["supply_temperature"],
        ambient_pressure=value["ambient_pressure"],
    )
    front, rear = (
        End(
            arm=value["front_arm"] if side == "front" else -value["rear_arm"],
            unsprung_mass=value[f"unsprung_mass_{side}"],
            tyre_stiffness=value[f"tyre_stiffness_{side}"],
            damping=value["bushing_damping"],
            area_scale=value["effective_area_scale"],
            volume_offset=VOLUME_OFFSET * value["volume_scale"],
            mean_area=MEAN_AREA * value["volume_scale"],
            inlet_scale=value["discharge_coefficient"],
            outlet_scale=value["discharge_coefficient"],
            reference_pressure=reference,
            design_height=value["design_height"],
        )
        for side, reference in zip(("front", "rear"), reference_pressures, strict=True)
    )
    return RicherRig(frame, front, rear)
