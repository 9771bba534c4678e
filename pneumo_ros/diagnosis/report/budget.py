# SPDX-License-Identifier: Apache-2.0
"""The budget as a picture and as rows: what makes the gap, largest first, and each law as it was measured."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.report.quantities import readable
from pneumo_ros.diagnosis.report.words import effect_name, place_words, site_words

INK: Final = "#212529"  # colour of text [display]
SOFT: Final = "#5c6670"  # colour of lines and notes [display]
NAMED: Final = "#1c6fb8"  # colour of a named effect [display]
OTHER: Final = "#adb5bd"  # colour of the tolerances [display]
LEFT: Final = "#f06514"  # colour of the remainder [display]
DENSE: Final = 0.25  # share of the fullest bin: thinner ones are drawn faint [display]
LETTER: Final = 0.07  # inch, width of a label's letters in the mean [display]
BARS: Final = 2.8  # inch, width of the waterfall [display]
SHOWN: Final = 0.005  # share of the gap below which the waterfall has no row [display]


def budget_rows(summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of the waterfall: words, share of the nominal gap, kind ("effect", "refit", "rest", "floor")."""
    rows = [_row(_entry_words(e), e["share"], "effect", entry=e) for e in summary.get("budget", [])]
    rows.append(_row("the rig's own tolerances", summary.get("refit_share"), "refit"))
    rest = summary.get("remainder")
    if rest:
        where = " and ".join(place_words(place) for place in rest["places"])
        rows.append(_row(f"unnamed, at {where}" if where else "unnamed", rest["share"], "rest"))
    rows.append(_row("sensor noise and model form", summary.get("floor_share"), "floor"))
    return [row for row in rows if abs(row["share"]) >= SHOWN or row["kind"] == "effect"]


def _row(words: str, share: object, kind: str, **more: object) -> dict[str, Any]:
    return {"words": words, "share": float(str(share or 0.0)), "kind": kind, **more}


def _entry_words(entry: Mapping[str, Any]) -> str:
    name = " and ".join(effect_name(effect) for effect in entry["effects"])
    where = site_words(entry.get("side") or "") or ", ".join(place_words(place) for place in entry["places"])
    return f"{name} ({where})" if where else name


def waterfall(rows: Sequence[Mapping[str, Any]], blamed: bool = True) -> str:
    """Shares of the squared nominal gap as an inline SVG, from the whole gap down to nothing.

    ``blamed`` : whether something is missing; where nothing is, what is left is painted as quietly as the rest
    """
    height = 0.36 * len(rows) + 0.55
    before = LETTER * max(len(row["words"]) for row in rows) + 0.15
    width = before + BARS + 0.75
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((before / width, 0.45 / height, BARS / width, 1.0 - 0.5 / height))
    left = 1.0
    colours = {"effect": NAMED, "refit": OTHER, "rest": LEFT if blamed else OTHER, "floor": "#dee2e6"}
    for k, row in enumerate(rows):
        share = row["share"]
        axes.barh(k, -share, left=left, color=colours[row["kind"]], height=0.66)
        text = f"{100 * share:.0f} %" if abs(share) >= 0.095 else f"{100 * share:.1f} %"
        axes.text(1.03, k, text, va="center", color=INK, fontsize=9)
        left -= share
    axes.set_yticks(range(len(rows)), [row["words"] for row in rows], fontsize=9, color=INK)
    axes.set_xlim(min(0.0, left) - 0.01, 1.02)
    axes.invert_yaxis()
    axes.set_xlabel("share of the squared held-out gap of the nominal model", fontsize=8, color=SOFT)
    _quiet(axes)
    return _svg(figure)


def curve_plot(curve: Mapping[str, Any]) -> str:
    """A measured law with its 90 % band; faint where the log was seldom there."""
    points = np.asarray(curve["points"], dtype=float)
    figure = Figure(figsize=(5.6, 2.7))
    axes = figure.add_axes((0.16, 0.2, 0.8, 0.75))
    (along, x_factor), (up, y_factor) = (readable(curve[key]["unit"], points[:, k]) for k, key in enumerate("xy"))
    x, y, low, high, weight = points.T * np.array([[x_factor], [y_factor], [y_factor], [y_factor], [1.0]])
    dense = weight >= DENSE * weight.max()
    axes.fill_between(x, low, high, color=NAMED, alpha=0.15, linewidth=0)
    axes.plot(x, y, color=NAMED, linewidth=1.2, alpha=0.5)
    axes.plot(np.where(dense, x, np.nan), y, color=NAMED, linewidth=2.4)
    axes.axhline(0.0, color=OTHER, linewidth=0.8)
    axes.set_ylim(*_limits(y, low, high, dense))
    axes.set_xlabel(f"{curve['x']['name']}, {along}", fontsize=9)
    axes.set_ylabel(f"{curve['y']['name']}, {up}", fontsize=9)
    axes.ticklabel_format(axis="both", style="sci", scilimits=(-3, 4))
    _quiet(axes)
    return _svg(figure)


def _limits(y: Array, low: Array, high: Array, dense: Array) -> tuple[float, float]:
    """Of the value axis: what the dense part needs, so that a wide band at the ends does not flatten the law."""
    rows = dense.astype(bool)
    bottom, top = min(0.0, float(low[rows].min()), float(y.min())), max(0.0, float(high[rows].max()), float(y.max()))
    pad = 0.06 * (top - bottom) or 1e-12
    return bottom - pad, top + pad


def _quiet(axes: Axes) -> None:
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8, colors=SOFT)


def _svg(figure: Figure) -> str:
    out = io.StringIO()
    figure.savefig(out, format="svg", transparent=True, metadata={"Date": None})
    text = out.getvalue()
    return text[text.index("<svg") :]
