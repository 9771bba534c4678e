# SPDX-License-Identifier: Apache-2.0
"""The half car's effects as families at slots: which family the same mechanism is at a rig of one's own.

Both are made of the kernels of :mod:`pneumo_ros.laws`: :attr:`SlotFamily.laws` names those that the half car's effect
and the family's laws at a slot share. Where the physics goes on differently from there, :attr:`SlotFamily.differs`
says how, and why: the half car's effect knows its strut, tyre and air, a family no more than its slot's coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class SlotFamily(NamedTuple):
    """A family, and the kind of slot it acts at.

    Attributes
    ----------
    laws : kernels that both are made of, ``module.function`` below :mod:`pneumo_ros.laws`
    differs : what the half car's effect does otherwise, and why; empty where nothing
    """

    kind: str
    family: str
    laws: tuple[str, ...]
    differs: str = ""


SLOT_FAMILIES: Mapping[str, SlotFamily] = MappingProxyType(
    {
        "bellows_hysteresis": SlotFamily(
            "force",
            "hysteresis",
            ("friction.slid",),
            "the equation of Bouc and Wen with a corner of any sharpness, in substeps (`hysteresis.stepped`); a "
            "slot's has a round corner, whose closed form (`hysteresis.moved_on`) needs no step short against a "
            "yield travel that nobody knows beforehand",
        ),
        "bellows_mode": SlotFamily(
            "force",
            "resonance",
            ("ringing.pulled",),
            "exact about a strut that moves at held speed (`ringing.swung`), with a share of damping inside the "
            "wall; a slot's travel is known at the step's end alone",
        ),
        "bump_stop": SlotFamily(
            "force",
            "stop",
            ("contact.stop",),
            "stiffening rubber; a slot's stop has no hardening and one at either end",
        ),
        "coulomb_friction": SlotFamily(
            "force",
            "coulomb_friction",
            ("friction.stribeck", "friction.slid"),
            "bristles of LuGre (`friction.bristle`), whose force follows the rate with a memory; at a slot "
            "sticking and slipping are laws of their own, which need no bristle shorter than a step",
        ),
        "effective_area_error": SlotFamily(
            "force",
            "spring_error",
            (),
            "an area times the gauge pressure, which a slot does not know; a family's is a stiffness over the travel",
        ),
        "exciter_lag": SlotFamily(
            "input",
            "lag",
            ("filters.lagged_line", "filters.first_order_line"),
            "its damping is free; a slot's is critical",
        ),
        "heat_transfer": SlotFamily(
            "flow",
            "heat",
            (),
            "an energy balance, from the air's mass, volume and temperature; a slot knows none of these, and "
            "what settles after a filling decays",
        ),
        "leak": SlotFamily(
            "flow",
            "leak",
            ("flow.relieved",),
            "mass flow of Eq. 4.11 out of a polytropic spring, `flow.gap_over_hole` of its hole; a slot's is "
            "`flow.through_hole` and `flow.through_gap`, in a unit that is the user's, of gas or liquid",
        ),
        "lvdt_offset": SlotFamily(
            "sensor",
            "offset",
            ("signal.crept",),
        ),
        "lvdt_scale": SlotFamily(
            "sensor",
            "scale",
            ("signal.bent",),
            "its law a product (`signal.scaled`)",
        ),
        "orifice_coefficient": SlotFamily(
            "flow",
            "flow_coefficient",
            ("flow.in_excess",),
            "its error leans over the ratio of pressures at a valve; a slot's over the flow itself",
        ),
        "payload": SlotFamily(
            "force",
            "offset",
            (),
            "a mass, which has inertia as well; a slot's is a force",
        ),
        "pressure_lag": SlotFamily(
            "sensor",
            "lag",
            ("filters.lagged_line", "filters.first_order_line"),
            "its damping is free; a slot's is critical",
        ),
        "pressure_offset": SlotFamily(
            "sensor",
            "offset",
            ("signal.crept",),
        ),
        "pressure_scale": SlotFamily(
            "sensor",
            "scale",
            ("signal.scaled_about", "signal.bent"),
            "its pivot is free; a slot's is zero, beside an offset",
        ),
        "supply_droop": SlotFamily(
            "flow",
            "droop",
            ("memory.relaxed",),
            "the supply's pressure sags, for both springs; a slot has no supply in its equations, and loses a "
            "share of its flow",
        ),
        "transport_delay": SlotFamily(
            "input",
            "delay",
            (),
            "of commands that are held over a period (`filters.delayed_hold`); a slot's of lines between rows "
            "(`filters.delayed_line`)",
        ),
        "tyre_damping": SlotFamily(
            "contact",
            "viscous_damping",
            ("damping.linear",),
        ),
        "tyre_liftoff": SlotFamily(
            "contact",
            "lift_off",
            ("contact.missing_pull",),
        ),
        "valve_deadband": SlotFamily(
            "input",
            "dead_zone",
            ("signal.dead",),
            "a spool that sticks as well (`filters.play`), which at a slot is `backlash`",
        ),
        "valve_lag": SlotFamily(
            "input",
            "lag",
            (),
            "commands are held over a period, signals of one's own rig are lines between rows; its damping is "
            "free, which a rig's own log seldom tells from a first order lag",
        ),
        "viscous_damping": SlotFamily(
            "force",
            "viscous_damping",
            ("damping.linear",),
            "one law with a constant that changes with the rate (`damping.growing`); at a slot its two parts "
            "compete as laws",
        ),
    }
)
# A rig of one's own states these with a tolerance instead.
PARAMETERS_OF_THE_EQUATIONS = ("cg_shift", "dead_volume")
