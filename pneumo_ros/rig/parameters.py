# SPDX-License-Identifier: Apache-2.0
"""The rig's parameters: typed, in SI, each with the tolerance its maker states.

Nothing else in the package holds a number of the rig.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from pneumo_ros.rig.limits import END_LIMITS, LIMITS, OPTIONAL, checked, limit_of


@dataclass(frozen=True)
class Quantity:
    """A number with the standard deviation its maker knows it to, and its unit.

    ``std`` is one sigma in the same unit; 0 means exact (or not to be estimated).
    """

    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class NamedEffect:
    """An effect that a diagnosis found in the rig; what ids, sites and parameters mean is in pneumo_ros/effects.

    Attributes
    ----------
    effect : id
    site : "front", "rear", "both", "" (the whole rig) or a channel
    parameters : name and value, SI
    source : SHA-256 of the Python source that defines it; empty for an effect of the library
    file : that source, only where the user gave the rig as a file and it stands beside it: never out of a log
    """

    effect: str
    site: str
    parameters: tuple[tuple[str, float], ...]
    source: str = ""
    file: str = field(default="", compare=False)

    @property
    def label(self) -> str:
        """Id and place, for messages."""
        return f"{self.effect} ({self.site or 'rig'})"

    def to_dict(self) -> dict[str, Any]:
        """Entry of the list ``effects:``, as a log carries it: no path."""
        out = {"effect": self.effect, "site": self.site, "parameters": dict(self.parameters)}
        return {**out, "source": self.source} if self.source else out

    def to_saved_dict(self) -> dict[str, Any]:
        """The same for a rig file, with the name of the Python file that stands beside it."""
        return {**self.to_dict(), "file": Path(self.file).name} if self.file else self.to_dict()


@dataclass(frozen=True)
class Rig:
    """Every number of the scaled half car (Table 3.4, sections 5.6 and 6.3), SI, with tolerances.

    ``ends`` (name of :data:`END_LIMITS`, value) and ``effects`` are what a diagnosis found beyond these numbers: a
    simulation with them behaves as the rig that was diagnosed. Controllers and estimators believe the numbers.
    ``assumed`` names the numbers that the text it was read from leaves out: the thesis's rig's stand in.
    """

    name: str
    design_height: Quantity
    sprung_mass: Quantity
    pitch_inertia: Quantity
    front_arm: Quantity
    rear_arm: Quantity
    unsprung_mass_front: Quantity
    unsprung_mass_rear: Quantity
    tyre_stiffness_front: Quantity
    tyre_stiffness_rear: Quantity
    bushing_damping: Quantity
    polytropic_exponent: Quantity
    supply_temperature: Quantity
    supply_pressure: Quantity
    ambient_pressure: Quantity
    outlet_area_front: Quantity
    outlet_area_rear: Quantity
    inlet_area_max: Quantity
    effective_area_scale: Quantity
    volume_scale: Quantity
    discharge_coefficient: Quantity
    displacement_noise: Quantity
    pressure_noise: Quantity
    length_scale: Quantity = Quantity(5.0, 0.0, "1")
    model_form: Quantity = Quantity(0.0, 0.0, "1")
    end_difference: Quantity = Quantity(OPTIONAL["end_difference"], 0.0, "1")
    ends: tuple[tuple[str, float], ...] = ()
    effects: tuple[NamedEffect, ...] = ()
    assumed: tuple[str, ...] = field(default=(), compare=False)

    @property
    def diagnosed(self) -> bool:
        """Whether the rig is more than the numbers of the nominal equations."""
        return bool(self.ends or self.effects)

    @property
    def findings(self) -> tuple[str, ...]:
        """What a diagnosis found beyond the numbers, one text each, for people and comparisons."""
        ends = tuple(f"{name} {value:.6g} {END_LIMITS[name].unit}" for name, value in self.ends)
        return (
            *(f"{one.label}: {', '.join(f'{k} {v:.6g}' for k, v in one.parameters)}" for one in self.effects),
            *ends,
        )

    @property
    def wheelbase(self) -> float:
        """Distance between the axles, m."""
        return self.front_arm.value + self.rear_arm.value

    def with_values(self, **values: float) -> Rig:
        """A copy with some values changed; tolerances and units stay.

        Raises
        ------
        InputError
            if a name is unknown or a value out of its range.
        """
        changed = {}
        for name, value in values.items():
            limit_of(name, "with_values")
            changed[name] = replace(getattr(self, name), value=checked(name, value, "with_values"))
        return replace(self, **changed)

    def to_dict(self) -> dict[str, Any]:
        """The mapping under ``rig:`` of the YAML form."""
        out: dict[str, Any] = {"name": self.name}
        for name in LIMITS:
            q: Quantity = getattr(self, name)
            if OPTIONAL.get(name) == q.value:
                continue  # absent means this, as in the logs of others
            out[name] = {"value": q.value, "std": q.std, "unit": q.unit}
        return out

    def to_yaml(self, saved: bool = False) -> str:
        """The text that /rig/config carries; ``saved``: that of a rig file, which names files beside itself."""
        document: dict[str, Any] = {"rig": self.to_dict()}
        if self.ends:
            document["ends"] = {name: {"value": value, "unit": END_LIMITS[name].unit} for name, value in self.ends}
        if self.effects:
            document["effects"] = [one.to_saved_dict() if saved else one.to_dict() for one in self.effects]
        return yaml.safe_dump(document, sort_keys=False)
