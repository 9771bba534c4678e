# SPDX-License-Identifier: Apache-2.0
"""What a chapter hands to the page: claims, tables and figures, as plain data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import yaml
from matplotlib.figure import Figure as Canvas

from pneumo_ros.paths import share_file

Step = Callable[[str], None]  # called with the name of each experiment as it begins


@dataclass(frozen=True)
class Claim:
    """One sentence of the thesis against our figure.

    Attributes
    ----------
    key : short and stable, for tests
    where : section, figure or table of the thesis
    says : the claim, in our words
    printed, ours : the figures, with units
    holds : whether it is true here
    why : the reason if it does not hold, or what the figure rests on
    """

    key: str
    where: str
    says: str
    printed: str
    ours: str
    holds: bool
    why: str = ""


@lru_cache(maxsize=1)
def printed_claims() -> dict[str, dict[str, str]]:
    """The thesis's claims by key: where, says and, unless it is computed from a table, printed."""
    text = share_file("config", "thesis_claims.yaml").read_text(encoding="utf-8")
    return dict(yaml.safe_load(text)["claims"])


def verdict(key: str, ours: str, holds: bool, why: str = "", *, printed: str | None = None) -> Claim:
    """The claim of a key of config/thesis_claims.yaml with our figure; ``printed`` where the file leaves it out."""
    said = printed_claims()[key]
    figure = printed if printed is not None else said["printed"]
    return Claim(key, said["where"], said["says"], figure, ours, bool(holds), why)


@dataclass(frozen=True)
class Table:
    """A table of strings; ``note`` says what is compared with what."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


@dataclass(frozen=True)
class Picture:
    """A drawn figure with its caption."""

    title: str
    canvas: Canvas
    note: str = ""


@dataclass(frozen=True)
class Chapter:
    """Everything a chapter shows."""

    number: int
    title: str
    lead: str
    claims: Sequence[Claim] = field(default_factory=tuple)
    tables: Sequence[Table] = field(default_factory=tuple)
    pictures: Sequence[Picture] = field(default_factory=tuple)


def canvas(rows: int = 1, columns: int = 1, width: float = 7.5, height: float = 3.2) -> tuple[Canvas, list]:  # type: ignore[type-arg]
    """A figure and its axes as a flat list, drawn without a display."""
    figure = Canvas(figsize=(width, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel().tolist()
    for axis in axes:
        axis.grid(alpha=0.3)
    return figure, axes
