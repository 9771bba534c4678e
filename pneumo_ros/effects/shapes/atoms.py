# SPDX-License-Identifier: Apache-2.0
"""Atoms: the simple laws whose sums make a family's shape, and the effects that are made of them.

A compiled term holds all atoms of a place and reads their amplitudes; a family's shape is an effect that fits some of
them, those of a kind with one sign (a cone: whatever law of the kind lies in it, sums of laws as well). ``anything`` at
a place may use them all with either sign: the ceiling of what can be closed there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.contract import Effect
from pneumo_ros.effects.parameters import EffectParameter

LARGEST = 200.0  # of the typical amplitude: a bound for the solver, no physical limit
SPREAD = 10.0  # of the typical amplitude: prior standard deviation, so that near-copies do not cancel each other


@dataclass(frozen=True)
class Atom:
    """One atom of a term.

    Attributes
    ----------
    name, unit, typical : of its amplitude; the typical one is what an evident effect has
    signed : a family that holds it may use it with either sign
    """

    name: str
    unit: str
    typical: float
    signed: bool = False


@dataclass(frozen=True)
class Term:
    """A compiled term with its atoms in the order of its parameters.

    Attributes
    ----------
    name : of its place in the kernel
    atoms : among them numbers that bend one and are fitted with it, for a shape alone
    sites, places : as of :class:`~pneumo_ros.effects.contract.Effect`
    """

    name: str
    term: PlantTerm
    atoms: tuple[Atom | EffectParameter, ...]
    sites: tuple[str, ...]
    places: tuple[str, ...]

    def shape(self, family: str, names: Sequence[str], summary: str, alone: tuple[str, ...] = ()) -> Effect:
        """The shape of a family: its atoms by name, or by the first word of their names; those that begin with
        ``alone`` are tried alone as well.
        """
        columns = self._columns(names)
        screened = tuple(n for n, k in enumerate(columns) if alone and self.atoms[k].name.startswith(alone))
        return replace(self._effect(f"{family}.shape", columns, summary, every_sign=False), screened=screened)

    def anything(self, name: str = "", names: Sequence[str] = ()) -> Effect:
        """Every atom with either sign; with a ``name`` of its own, those of ``names`` as in :meth:`shape`."""
        columns = self._columns(names) if names else range(len(self.atoms))
        kept = tuple(k for k in columns if isinstance(self.atoms[k], Atom))
        return self._effect(f"anything.{name or self.name}", kept, "whatever acts there", every_sign=True)

    def _columns(self, names: Sequence[str]) -> tuple[int, ...]:
        return tuple(k for k, atom in enumerate(self.atoms) if atom.name in names or atom.name.split()[0] in names)

    def _effect(self, name: str, columns: tuple[int, ...], summary: str, every_sign: bool) -> Effect:
        parameters = tuple(amplitude(self.atoms[k], every_sign) for k in columns)
        return Effect(name, summary, self.sites, self.places, parameters, term=self.term, slot=self.name,
                      columns=columns)  # fmt: skip


def amplitude(atom: Atom | EffectParameter, every_sign: bool = False) -> EffectParameter:
    """The parameter that an atom's amplitude is; a number that bends one is a parameter itself."""
    if isinstance(atom, EffectParameter):
        return atom
    high = LARGEST * atom.typical
    low = -high if atom.signed or every_sign else 0.0
    return EffectParameter(atom.name, atom.unit, low, high, atom.typical, size=True, spread=SPREAD)
