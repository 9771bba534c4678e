"""All chapters in order, and how many experiments each announces."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from types import ModuleType

from pneumo_ros.errors import InputError
from pneumo_ros.thesis import beyond, chapter2, chapter3, chapter4, chapter5, chapter6
from pneumo_ros.thesis.report import Chapter, Step
from pneumo_ros.thesis.settings import ThesisSettings

CHAPTERS: dict[str, ModuleType] = {
    "2": chapter2,
    "3": chapter3,
    "4": chapter4,
    "5": chapter5,
    "6": chapter6,
    "beyond": beyond,
}


@dataclass(frozen=True)
class Book:
    """The chapters asked for, not yet computed."""

    names: tuple[str, ...]

    @property
    def steps(self) -> int:
        """Experiments the chapters announce in all."""
        return sum(int(CHAPTERS[name].STEPS) for name in self.names)

    def build(self, settings: ThesisSettings, step: Step) -> list[Chapter]:
        """Compute them; ``step`` is called as each experiment begins."""
        return [CHAPTERS[name].build(settings, step) for name in self.names]


def book(names: Iterable[str] = ()) -> Book:
    """A book of the named chapters, all by default.

    Raises
    ------
    InputError
        if a name is unknown.
    """
    wanted = tuple(names) or tuple(CHAPTERS)
    for name in wanted:
        if name not in CHAPTERS:
            raise InputError("no such chapter", where="thesis", key="chapter", value=name, allowed=", ".join(CHAPTERS))
    return Book(wanted)
