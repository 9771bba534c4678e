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
_HOW_MUCH = " (how much: the report's measured curve)"
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

    def check_with(self, values: Mapping[str, tuple[float | None, str]]) -> str:
        """The check with ``values`` (parameter -> value in SI and its unit, None where its number means little)."""
        text = _NAME.sub(lambda found: displayed(*values[found[1]]), self.check)
        unsaid = any(values[name][0] is None for name in self.names())
        return text + _HOW_MUCH if unsaid else text


def displayed(value: float | None, unit: str) -> str:
    """A value in the unit that people read: ``displayed(0.004, "m")`` is ``4 mm``; None is ``some mm``."""
    factor, name = _DISPLAYED.get(unit, (1.0, unit))
    return f"some {name}" if value is None else f"{factor * value:.3g} {name}"
