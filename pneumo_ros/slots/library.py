# SPDX-License-Identifier: Apache-2.0
"""The effects of a rig: each law, shape and ceiling of the registry, at every slot of its kind, in the slot's units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import ANYTHING, SHAPE, Derived, EffectParameter, family_of
from pneumo_ros.effects.shapes.atoms import Atom, amplitude
from pneumo_ros.slots.guides import GUIDES
from pneumo_ros.slots.kinds import Slot
from pneumo_ros.slots.laws import LAWS, End, Knob, Law, Measures
from pneumo_ros.slots.shapes import CONES, ROWS, Row


@dataclass(frozen=True)
class SlotEffect:
    """A law, a shape or a ceiling at the slots it may act at.

    Attributes
    ----------
    id, summary : a law's, ``<family>.shape`` or ``anything.<kind>``
    sites : places of the slots
    by_site : parameters where it acts: units and usual sizes are the slot's
    columns : where they stand among the slot's values
    variety : of a law that claims how a force changes with the rate: how varied the rate was where it acts
    """

    id: str
    summary: str
    sites: tuple[str, ...]
    by_site: Mapping[str, tuple[EffectParameter, ...]]
    columns: Mapping[str, tuple[int, ...]]
    derived: tuple[Derived, ...] = field(default=())
    guide: Guide | None = None
    variety: Mapping[str, float] = field(default_factory=dict)

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """Those at the first site."""
        return self.by_site[self.sites[0]]

    def varied(self, site: str) -> float:
        """How varied what the law is over was at a site, see :class:`~pneumo_ros.diagnosis.traits.NeedsVariety`."""
        return self.variety.get(site, np.inf)


def effects_of(
    slots: Sequence[Slot], measures: Mapping[str, Measures], allowed: Mapping[str, Sequence[str]] | None = None
) -> dict[str, SlotEffect]:
    """All effects of a rig by id.

    Parameters
    ----------
    measures : by the slot's place
    allowed : place -> families that may sit there; all of its kind where it is not named
    """
    allowed = allowed or {}
    found: dict[str, SlotEffect] = {}
    for slot in slots:
        m, names = measures[slot.place], allowed.get(slot.place)
        for one in _at(slot, m):
            free = names is None or family_of(one.id) in (*names, ANYTHING)
            if free:
                found[one.id] = _joined(found.get(one.id), one)
    return found


def families_of(kind: str) -> tuple[str, ...]:
    """Families that a kind of slot may have."""
    return tuple(dict.fromkeys(family_of(law.id) for law in LAWS if kind in law.kinds))


def _joined(known: SlotEffect | None, one: SlotEffect) -> SlotEffect:
    if known is None:
        return one
    return replace(known, sites=(*known.sites, *one.sites), by_site={**known.by_site, **one.by_site},
                   columns={**known.columns, **one.columns}, variety={**known.variety, **one.variety})  # fmt: skip


def _at(slot: Slot, m: Measures) -> Iterator[SlotEffect]:
    loaded = m.load > 0.0
    for law in LAWS:
        if slot.kind in law.kinds and (loaded or not law.needs_load):
            yield _law(law, slot, m)
    for family, columns in CONES[slot.kind].items():
        yield _atoms(f"{family}.{SHAPE}", f"{family.replace('_', ' ')} of any law", slot, m, columns, False)
    every = tuple(column for row in ROWS[slot.kind] for column in row.columns())
    yield _atoms(f"{ANYTHING}.{slot.kind}", "whatever acts there", slot, m, every, True)


def _law(law: Law, slot: Slot, m: Measures) -> SlotEffect:
    parameters = tuple(_parameter(knob, m) for knob in law.knobs)
    columns = tuple(knob.column for knob in law.knobs)
    variety = {slot.place: m.varied} if law.by_rate else {}
    return SlotEffect(law.id, law.summary, (slot.place,), {slot.place: parameters}, {slot.place: columns},
                      guide=_guide(law), variety=variety)  # fmt: skip


def _guide(law: Law) -> Guide:
    guide = GUIDES[family_of(law.id)]
    return replace(guide, check=guide.check.replace("{size}", f"{{{law.knobs[0].name}}}"))


def _parameter(knob: Knob, m: Measures) -> EffectParameter:
    typical = knob.typical(m)
    unit = knob.unit.format(unit=m.unit, travel=m.travel_unit)
    most = max(knob.most(m), np.finfo(float).tiny)
    typical = min(typical, most)
    low, high = knob.low * typical, min(knob.high * typical, most)
    starts = tuple(s * typical for s in knob.starts if low <= s * typical <= high)
    own, other = (
        tuple(bound for bound, end in zip((low, high), knob.ends, strict=True) if end is kind)
        for kind in (End.OWN, End.OTHER)
    )
    return EffectParameter(knob.name, unit, low, high, typical, knob.size, starts, (0.0, *own), other)


def _atoms(name: str, summary: str, slot: Slot, m: Measures, columns: Sequence[int], every_sign: bool) -> SlotEffect:
    rows = {column: row for row in ROWS[slot.kind] for column in row.columns()}
    kept = tuple(c for c in columns if c in rows and (m.load > 0.0 or rows[c].name not in _NEED_LOAD))
    parameters = tuple(_bounded(amplitude(_atom(rows[c], c, m), every_sign), rows[c], m, every_sign) for c in kept)
    return SlotEffect(name, summary, (slot.place,), {slot.place: parameters}, {slot.place: kept})


def _bounded(parameter: EffectParameter, row: Row, m: Measures, every_sign: bool) -> EffectParameter:
    """A family's atom keeps to what nature allows it; whatever may act keeps to nothing."""
    most = np.inf if every_sign else max(row.most(m), np.finfo(float).tiny)
    return replace(parameter, high=min(parameter.high, most), typical=min(parameter.typical, most))


_NEED_LOAD = ("load_friction", "share", "droop")


def _atom(row: Row, column: int, m: Measures) -> Atom:
    unit = row.unit.format(unit=m.unit, travel=m.travel_unit)
    number = f" {column - row.first + 1}" if row.count > 1 else ""
    return Atom(row.name + number, unit, row.typical(m), row.signed)
