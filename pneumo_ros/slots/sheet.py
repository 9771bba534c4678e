# SPDX-License-Identifier: Apache-2.0
"""docs/families.md: what may be missing at each kind of slot, made from the registry."""

from __future__ import annotations

from pneumo_ros.effects.parameters import family_of
from pneumo_ros.slots.guides import GUIDES, plain_check
from pneumo_ros.slots.half_car import PARAMETERS_OF_THE_EQUATIONS, SLOT_FAMILIES
from pneumo_ros.slots.kinds import Contact, Flow, Force, Input, Sensor, Slot
from pneumo_ros.slots.laws import LAWS, Law
from pneumo_ros.slots.library import families_of
from pneumo_ros.slots.shapes import CONES, ROWS

KINDS: tuple[type[Slot], ...] = (Force, Contact, Flow, Input, Sensor)


def families_page() -> str:
    """The page's body, Markdown."""
    return "\n".join([*(_kind(kind) for kind in KINDS), _by_hand(), _half_car()])


def laws_of_family(family: str) -> list[tuple[str, str, str]]:
    """(law, kinds of slot, what it is) of each law of a family."""
    laws = [law for law in LAWS if family_of(law.id) == family]
    return [(law.id.partition(".")[2] or "-", ", ".join(law.kinds), law.summary) for law in laws]


def _by_hand() -> str:
    """What each family is, how to check it, and what tells its look-alikes apart."""
    rows = ["## By hand", "", "| family | what happens | check | what looks like it |", "|---|---|---|---|"]
    for family, guide in GUIDES.items():
        others = "; ".join(f"`{other}` {words}" for other, words in guide.mistaken_for.items())
        rows.append(f"| `{family}` | {guide.meaning} | {plain_check(guide)} | {others} |")
    return "\n".join(rows) + "\n"


def _half_car() -> str:
    """Which family an effect of the half car is at a slot, and what the two share."""
    rows = [
        f"| `{effect}` | {one.kind} | `{one.family}` | {', '.join(f'`{law}`' for law in one.laws) or '-'} "
        f"| {one.differs or '-'} |"
        for effect, one in SLOT_FAMILIES.items()
    ]
    others = ", ".join(f"`{effect}`" for effect in PARAMETERS_OF_THE_EQUATIONS)
    return (
        "## The half car's effects\n\n"
        "What [effects.md](effects.md) calls by the half car's parts, at a rig of your own. What a law does is written "
        "once, in `pneumo_ros/laws/`; the half car's effect and the family's laws are made of the functions named "
        "here. The last column says where the half car goes on differently, and why.\n\n"
        "| effect | kind of slot | family | shared | what is different at the half car |\n|---|---|---|---|---|\n"
        + "\n".join(rows)
        + f"\n\nNot at a slot: {others}. They are "
        "parameters of the equations, which a rig of your own states with a tolerance.\n"
    )


def _kind(kind: type[Slot]) -> str:
    about = next(line for line in (kind.__doc__ or "").splitlines() if line.strip())
    rows = [_row(law, kind.kind) for law in LAWS if kind.kind in law.kinds]
    atoms = ", ".join(f"{row.name} ({row.count})" for row in ROWS[kind.kind])
    shaped = ", ".join(f"`{family}`" for family in families_of(kind.kind) if family in CONES[kind.kind])
    return (f"## {kind.__name__}\n\n{about}\n\n| family | law | what it is | parameters |\n|---|---|---|---|\n"
            + "\n".join(rows) + f"\n\nFamilies with a shape: {shaped}. Whatever may act there: {atoms}.\n")  # fmt: skip


def _row(law: Law, kind: str) -> str:
    unit, travel = {"input": ("unit", "unit"), "sensor": ("unit", "unit")}.get(kind, ("unit", "travel"))
    knobs = [f"{k.name.replace('_', ' ')} ({k.unit.format(unit=unit, travel=travel)})" for k in law.knobs]
    family = family_of(law.id)
    own = law.id.partition(".")[2] or "-"
    loaded = "; needs `load`" if law.needs_load and kind in ("force", "contact") else ""
    fed = "; needs `flow`" if law.needs_load and kind == "flow" else ""
    return f"| `{family}` | {own} | {law.summary}{loaded}{fed} | {', '.join(knobs)} |"
