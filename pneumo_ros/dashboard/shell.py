# SPDX-License-Identifier: Apache-2.0
"""What every page of the dashboard shares: a page as wide as the screen, and plots side by side where there is room."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bokeh.core.templates import get_env
from bokeh.document import Document
from bokeh.layouts import row
from bokeh.models import InlineStyleSheet, Legend, LegendItem

from pneumo_ros.printable import one_line

NARROW = 720  # px below which there is one plot in a row
ROOM = 44  # characters of a legend's line; a telephone cuts off what is longer
# Without it a telephone draws a page of 980 px and shrinks it.
_TEMPLATE = """{% extends base %}
{% block preamble %}<meta name="viewport" content="width=device-width, initial-scale=1">{% endblock %}
"""
# How wide a text is depends on the fonts of who looks: in DejaVu Sans the longest name is wider than its field.
_WHOLE = ".bk-input-group, .bk-btn { white-space: normal; }"
_WRAP = ":host { flex-wrap: wrap; }"
_HALF = f"""
:host {{ flex: 1 1 45%; min-width: 0; }}
@media (max-width: {NARROW}px) {{ :host {{ flex-basis: 100%; max-width: 100%; overflow: hidden; }} }}
"""


def furnish(document: Document, title: str) -> None:
    """Title and page frame of a document."""
    document.title = f"pneumo: {one_line(title)}"
    document.template = get_env().from_string(_TEMPLATE)


def side_by_side(plots: Sequence[Any]) -> Any:
    """Two in a row, one on a narrow screen."""
    for plot in plots:
        plot.stylesheets = [*plot.stylesheets, InlineStyleSheet(css=_HALF)]  # a model belongs to one document
    return wrapping(*plots, sizing_mode="stretch_width")


def legend_above(plot: Any, lines: Sequence[tuple[str, Any]], size: str = "10px") -> Any:
    """The plot with its legend between title and curves, where it covers none of them; a click hides a curve."""
    items = [LegendItem(label=name, renderers=[line]) for name, line in lines]
    legend = Legend(items=items, click_policy="hide", label_text_font_size=size, orientation="horizontal", padding=2,
                    margin=0, location="left", border_line_alpha=0.0, background_fill_alpha=0.0)  # fmt: skip
    if sum(len(name) for name, _ in lines) > ROOM:
        legend.ncols = max(1, ROOM // max(len(name) for name, _ in lines))
    plot.add_layout(legend, "above")
    return plot


def whole_label() -> InlineStyleSheet:
    """A widget's name in as many lines as it needs, so that it does not run into its neighbour's."""
    return InlineStyleSheet(css=_WHOLE)


def wrapping(*widgets: Any, **options: Any) -> Any:
    """Widgets in a row that goes on below where the screen ends."""
    return row(*widgets, stylesheets=[InlineStyleSheet(css=_WRAP)], **options)
