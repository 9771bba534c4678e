# SPDX-License-Identifier: Apache-2.0
"""The terminal: colours are ours, texts may come from a log; a text is shown and never obeyed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rich.console import Console as RichConsole
from rich.console import ConsoleOptions, RenderableType
from rich.errors import MarkupError
from rich.segment import Segment
from rich.text import Text

from pneumo_ros.printable import printable


class Console(RichConsole):
    """A rich console through which no escape sequence of a log reaches the terminal, and no markup of one fails."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Segments with control characters written out; rich's own control segments stay."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=printable(segment.text))

    def render_str(self, text: str, **options: Any) -> Text:
        """Markup as rich reads it; a text that is no markup, like a name with ``[/]``, as it is."""
        try:
            return super().render_str(text, **options)
        except MarkupError:
            return super().render_str(text, **{**options, "markup": False})
