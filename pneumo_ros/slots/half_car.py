# SPDX-License-Identifier: Apache-2.0
"""The half car's effects as families at slots: which family the same mechanism is at a rig of one's own.

The half car's laws are its own, in the quantities of its struts, tyres and springs' air; a family's laws take the
coordinates of a slot.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class SlotFamily(NamedTuple):
    """A family, and the kind of slot it acts at."""

    kind: str
    family: str


SLOT_FAMILIES: Mapping[str, SlotFamily] = MappingProxyType({
    "bellows_hysteresis": SlotFamily("force", "hysteresis"),
    "bellows_mode": SlotFamily("force", "resonance"),
    "bump_stop": SlotFamily("force", "stop"),
    "coulomb_friction": SlotFamily("force", "coulomb_friction"),
    "effective_area_error": SlotFamily("force", "spring_error"),
    "exciter_lag": SlotFamily("input", "lag"),
    "heat_transfer": SlotFamily("flow", "heat"),
    "leak": SlotFamily("flow", "leak"),
    "lvdt_offset": SlotFamily("sensor", "offset"),
    "lvdt_scale": SlotFamily("sensor", "scale"),
    "orifice_coefficient": SlotFamily("flow", "flow_coefficient"),
    "payload": SlotFamily("force", "offset"),
    "pressure_lag": SlotFamily("sensor", "lag"),
    "pressure_offset": SlotFamily("sensor", "offset"),
    "pressure_scale": SlotFamily("sensor", "scale"),
    "supply_droop": SlotFamily("flow", "droop"),
    "transport_delay": SlotFamily("input", "delay"),
    "tyre_damping": SlotFamily("contact", "viscous_damping"),
    "tyre_liftoff": SlotFamily("contact", "lift_off"),
    "valve_deadband": SlotFamily("input", "dead_zone"),
    "valve_lag": SlotFamily("input", "lag"),
    "viscous_damping": SlotFamily("force", "viscous_damping"),
})  # fmt: skip
# A rig of one's own states these with a tolerance instead.
PARAMETERS_OF_THE_EQUATIONS = ("cg_shift", "dead_volume")
