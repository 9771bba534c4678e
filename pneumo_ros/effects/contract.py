# SPDX-License-Identifier: Apache-2.0
"""What an effect is: identity, sites, parameters, and one or more hooks by which it acts.

A file of this folder defines one module-level ``EFFECT``; a user's own file does the same and is loaded by path or by
the entry point group ``pneumo_ros.effects``. Four kinds of hook:

- ``plant``: changes parameters of the nominal model (costs nothing),
- ``inputs``: changes command or road on their way to the plant (outside the kernel),
- ``term``: adds force or flow inside the compiled kernel, with own states where needed,
- ``outputs``: changes what a sensor reports.

``inputs`` and ``outputs`` work on a block of rows and carry a memory from block to block (None before the first row),
so that a whole log and a rig that is stepped row by row go through the same lines; :func:`by_column` does the carrying.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

from pneumo_ros.arrays import Array
from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.guide import Guide
from pneumo_ros.effects.parameters import Derived, EffectParameter
from pneumo_ros.plant.air_spring import Gas
from pneumo_ros.plant.equations import Body
from pneumo_ros.rig.channels import CHANNELS, PRESSURES

Values = tuple[float, ...]
Memory = Any  # what an effect keeps from one block of rows to the next; None before the first

ENDS = ("front", "rear", "both")
RIG = ("",)
PRESSURES_OR_BOTH = (*PRESSURES, "both")
PLACES = (
    "{end}_force", "{end}_air", "{end}_tyre", "front_force", "rear_force", "front_air", "rear_air", "front_tyre",
    "rear_tyre", "body_heave", "body_pitch", "road_input", "supply",
)  # fmt: skip
SENSOR_PLACES = {name: f"sensor:{name}" for name in CHANNELS}


class Plant(NamedTuple):
    """The half car's parameters: body, front gas, rear gas."""

    body: Body
    front: Gas
    rear: Gas


class Inputs(NamedTuple):
    """What drives the plant: commands (N, 4) m2, each row held over a period; road (M, 2) m, linear between rows.

    A whole record has one row of road more than of commands; further blocks have as many of one as of the other.
    """

    commands: Array
    road: Array


class Ends(NamedTuple):
    """Which ends a site covers."""

    front: bool
    rear: bool

    @property
    def columns(self) -> tuple[int, ...]:
        """Columns of the ends that act: 0 front, 1 rear."""
        return tuple(i for i, on in enumerate(self) if on)


@dataclass(frozen=True)
class Effect:
    """An unmodelled effect of the half car.

    Attributes
    ----------
    id : as in the log and diagnosis contract
    summary : one sentence
    sites : where it may act ("front", "rear", "both"; "" for the rig; or channel names)
    places : place per end with ``{end}`` standing for front or rear, first the one it is blamed on; unused for sensors
    parameters : those with ``size=True`` are zero when there is no effect
    derived : what they give together
    plant, inputs, outputs, term : hooks, see the module
    guide : what people want to know of it
    slot, columns : of a shape, the term that it shares with others and which of its parameters are its own
    screened : of a shape, which of its parameters are tried alone as well: its family's law does nothing like them
    taken : of a shape that may take its command at intervals, which of its parameters are the share that is taken so,
        the interval and the phase
    sticks : of a shape that may stick, which of its parameters are the share that does and the band
    waves : of a shape that may have waves, which of its parameters are the sizes of the even and of the odd one and how
        many there are a unit of its coordinate
    begins : of a shape, values of its parameters from which it is fitted as well, its family's laws at nothing: there
        it does all of their work, and small steps from these do not lead to it
    elsewhere : places, ``{end}`` as above, where the same motion may come from: its name is held against what may act
        there in its stead (with "-": what ties two, or another thing at one); always where its motion tells nothing of
        the place (``always``), else where the structure leaves much
    follows : of a sensor's error, the least share of what is there that a reading of the kind still follows at either
        end of its range, 0 where it may stop
    """

    id: str
    summary: str
    sites: tuple[str, ...]
    places: tuple[str, ...]
    parameters: tuple[EffectParameter, ...]
    derived: tuple[Derived, ...] = ()
    plant: Callable[[Plant, Ends, Values], Plant] | None = None
    inputs: Callable[[Inputs, float, Ends, Values, Memory], tuple[Inputs, Memory]] | None = None
    outputs: Callable[[Array, float, tuple[int, ...], Values, Memory], tuple[Array, Memory]] | None = None
    undo: Callable[[Array, tuple[int, ...], Values], Array] | None = None
    term: PlantTerm | None = None
    guide: Guide | None = field(default=None, compare=False)
    slot: str = ""
    columns: tuple[int, ...] = ()
    screened: tuple[int, ...] = ()
    taken: tuple[int, ...] = ()
    sticks: tuple[int, int] | tuple[()] = ()
    waves: tuple[int, int, int] | tuple[()] = ()
    begins: tuple[Values, ...] = ()
    elsewhere: tuple[str, ...] = ()
    always: bool = False
    follows: float = 0.0

    @property
    def place_in_kernel(self) -> str:
        """Name of the kernel's slot that its term runs in: shapes of one place share one, their amplitudes add up."""
        return self.slot or self.id

    @property
    def changes_numbers(self) -> bool:
        """Whether it is a law that changes numbers of the rig, and nothing besides."""
        return self.plant is not None and self.term is None

    def elsewhere_of(self, site: str) -> tuple[tuple[str, ...], ...]:
        """The places elsewhere for what acts at one site, those of both ends together where it acts at both."""
        ends = [end for end in ENDS[:2] if site in (end, "both", "") or f"_{end}" in site or f"{end}_" in site]
        return tuple(tuple(dict.fromkeys(place.format(end=end) for end in ends)) for place in self.elsewhere)

    def __post_init__(self) -> None:
        check_places(self.sites, self.places)
        names = [p.name for p in self.parameters]
        for name in dict.fromkeys(names):
            if names.count(name) > 1:
                raise ValueError(f"{names.count(name)} parameters are called {name!r}; give each a name of its own")


def check_places(sites: tuple[str, ...], places: tuple[str, ...]) -> None:
    """Refuse sites and places that the rig does not have, and no place where no sensor is at fault.

    Raises
    ------
    ValueError
        naming it and what there is.
    """
    known_sites = (*ENDS, *RIG, *CHANNELS)
    for site in sites:
        if site not in known_sites:
            raise ValueError(f"unknown site {site!r}; allowed: {', '.join(map(repr, known_sites))}")
    for place in places:
        if place not in PLACES and not place.startswith("sensor:"):
            raise ValueError(f"unknown place {place!r}; allowed: {', '.join(PLACES)}")
    if not places and not any(site in CHANNELS for site in sites):
        raise ValueError(f"no place; an effect that is no sensor's is blamed on one; allowed: {', '.join(PLACES)}")


def by_column(
    change: Callable[[Array, Memory], tuple[Array, Memory]], table: Array, columns: Sequence[int], memory: Memory
) -> tuple[Array, Memory]:
    """Some columns of a block changed, each with its own memory; an empty block leaves everything as it is."""
    if not len(table):
        return table, memory
    out, kept = table.copy(), dict(memory or {})
    for column in columns:
        out[:, column], kept[column] = change(table[:, column], kept.get(column))
    return out, kept


@lru_cache(maxsize=64)
def ends_of(site: str) -> Ends:
    """Ends that a site covers; the whole rig is both."""
    return Ends(site in ("front", "both", ""), site in ("rear", "both", ""))


def channels_of(site: str) -> tuple[int, ...]:
    """Columns of the measured channels that a sensor effect's site covers; "both" are the two pressures."""
    return tuple(CHANNELS.index(name) for name in (PRESSURES if site == "both" else (site,)))


def with_gas(plant: Plant, ends: Ends, change: Callable[[Gas], Gas]) -> Plant:
    """A plant whose gas is changed at the given ends."""
    return plant._replace(
        front=change(plant.front) if ends.front else plant.front,
        rear=change(plant.rear) if ends.rear else plant.rear,
    )
