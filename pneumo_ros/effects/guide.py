# SPDX-License-Identifier: Apache-2.0
"""What an engineer at the rig wants to know of an effect: what it is, what it is mistaken for, the check by hand."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

_DISPLAYED = {  # SI unit -> factor and unit that people read
    "m": (1e3, "mm"),
    "m2": (1e6, "mm2"),
    "m3": (1e6, "cm3"),
    "s": (1e3, "ms"),
    "Pa": (1e-3, "kPa"),
    "Pa/s": (1e-3, "kPa/s"),
    "Pa s/kg": (1e-6, "kPa for each g/s"),
    "N/m": (1e-3, "N/mm"),
    "1": (1e2, "%"),
    "1/m": (1.0, "/m"),
    "s/m": (1.0, "s/m"),
}
OFF_THE_CURVE = "; read the size off the curve in the report"
NO_NUMBER = "; this log gives no number for it"
_NAME = re.compile(r"\{(\w+)\}")


@dataclass(frozen=True)
class Expected:
    """A number that is seen at the check, from the parameters' values by name (SI)."""

    of: Callable[[Mapping[str, float]], float]
    unit: str


@dataclass(frozen=True)
class Guide:
    """Facts beside an effect, for people.

    Attributes
    ----------
    meaning : what happens in the rig, a sentence or two
    check : what to do by hand, and what is then seen; ``{name}`` stands for the value of a parameter or of ``expects``
    mistaken_for : id of another effect that looks like it -> what tells the two apart
    expects : name -> what is seen at the check, where that is no parameter itself
    """

    meaning: str
    check: str
    mistaken_for: Mapping[str, str] = field(default_factory=dict)
    expects: Mapping[str, Expected] = field(default_factory=dict)

    def names(self) -> set[str]:
        """Parameters that the check names."""
        return set(_NAME.findall(self.check)) - set(self.expects)

    def check_with(self, values: Mapping[str, tuple[float | None, str]], unsaid: str = OFF_THE_CURVE) -> str:
        """The check with ``values`` (parameter -> value in SI and its unit, None where its number means little).

        ``unsaid`` : what is added where a number is missing
        """
        known = {name: value for name, (value, _) in values.items() if value is not None}
        told = {name: values[name] for name in self.names()}
        for name, one in self.expects.items():
            told[name] = (one.of(known) if len(known) == len(values) else None, one.unit)
        text = _NAME.sub(lambda found: displayed(*told[found[1]], found[1]), self.check)
        return text + unsaid if any(value is None for value, _ in told.values()) else text


def displayed(value: float | None, unit: str, name: str = "") -> str:
    """A value in the unit that people read: ``displayed(0.004, "m")`` is ``4 mm``, ``displayed(9.7, "s")`` is
    ``9.7 s``; None is what it is and its unit: ``the stop lead (mm)``.
    """
    factor, words = _DISPLAYED.get(unit, (1.0, unit))
    if unit == "s" and value is not None and abs(value) >= 1.0:
        factor, words = 1.0, "s"
    return f"the {name.replace('_', ' ')} ({words})" if value is None else f"{factor * value:.3g} {words}"
