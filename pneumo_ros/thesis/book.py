# SPDX-License-Identifier: Apache-2.0
"""All chapters in order, and how many experiments each announces."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

from pneumo_ros.errors import not_one_of

if TYPE_CHECKING:
    from pneumo_ros.thesis.report import Chapter, Step
    from pneumo_ros.thesis.settings import ThesisSettings

CHAPTERS = {"2": "chapter2", "3": "chapter3", "4": "chapter4", "5": "chapter5", "6": "chapter6", "beyond": "beyond"}
"""Name of a chapter -> its module, imported when it is built: together they take seconds."""


def chapter(name: str) -> ModuleType:
    """The module of a chapter."""
    return import_module(f"pneumo_ros.thesis.{CHAPTERS[name]}")


@dataclass(frozen=True)
class Book:
    """The chapters asked for, not yet computed."""

    names: tuple[str, ...]

    @property
    def steps(self) -> int:
        """Experiments the chapters announce in all."""
        return sum(int(chapter(name).STEPS) for name in self.names)

    def build(self, settings: ThesisSettings, step: Step) -> list[Chapter]:
        """Compute them; ``step`` is called as each experiment begins."""
        return [chapter(name).build(settings, step) for name in self.names]


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
            raise not_one_of("no such chapter", name, CHAPTERS, where="thesis", key="chapter")
    return Book(wanted)
