# SPDX-License-Identifier: Apache-2.0
"""What an engineer at the rig wants to know of an effect: what it is, what it is mistaken for, the check by hand."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

_DISPLAYED = {  # SI unit -> factor and unit that people read
    "m": (1e3, "mm"),
    "m2": (1e6, "mm2"),
    "m3": (1e6, "cm3"),
    "s": (1e3, "ms"),
    "Pa": (1e-3, "kPa"),
    "Pa s/kg": (1e-6, "kPa s/g"),
    "1": (1e2, "%"),
    "1/m": (1.0, "/m"),
    "s/m": (1.0, "s/m"),
}
_AS_MEASURED = "what the report's measured curve shows"
_NAME = re.compile(r"\{(\w+)\}")


@dataclass(frozen=True)
class Guide:
    """Facts beside an effect, for people.

    Attributes
    ----------
    meaning : what happens on the rig, a sentence or two
    check : what to do by hand, and what is then seen; ``{name}`` stands for the value of a parameter
    mistaken_for : id of another effect that looks like it -> what tells the two apart
    """

    meaning: str
    check: str
    mistaken_for: Mapping[str, str] = field(default_factory=dict)

    def names(self) -> set[str]:
        """Parameters that the check names."""
        return set(_NAME.findall(self.check))

    def check_with(self, values: Mapping[str, tuple[float, str]]) -> str:
        """The check with ``values`` (parameter -> value in SI, and its unit) in place, elsewhere where to look."""
        return _NAME.sub(lambda found: displayed(*values[found[1]]) if found[1] in values else _AS_MEASURED, self.check)


def displayed(value: float, unit: str) -> str:
    """A value in the unit that people read: ``displayed(0.004, "m")`` is ``4 mm``."""
    factor, name = _DISPLAYED.get(unit, (1.0, unit))
    return f"{factor * value:.3g} {name}"
