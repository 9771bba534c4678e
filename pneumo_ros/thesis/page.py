# SPDX-License-Identifier: Apache-2.0
"""The HTML page and the Markdown table of claims, from chapters as plain data."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas

from pneumo_ros.files import new_file
from pneumo_ros.thesis.equations import equation_index
from pneumo_ros.thesis.report import Chapter, Claim
from pneumo_ros.thesis.settings import ThesisSettings

TEMPLATE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>The thesis, recomputed</title><style>
body { font: 15px/1.45 system-ui, sans-serif; max-width: 76rem; margin: 2rem auto; padding: 0 1rem; color: #1a1a1a }
table { border-collapse: collapse; margin: .6rem 0 1.4rem; font-size: 13px }
caption { text-align: left; font-weight: 600 }
th, td { border: 1px solid #ccc; padding: .25rem .5rem; text-align: left; vertical-align: top }
th { background: #f3f3f3 } .yes { background: #e7f5e9 } .no { background: #fdecea } img { max-width: 100% }
figure { margin: 1rem 0 } figcaption, .note { color: #555; font-size: 13px } code { font-size: 12px }
</style></head><body>
<h1>The thesis, recomputed</h1>
<p>{{ held }} of {{ total }} claims hold. Each that does not says why. Settings: {{ settings }}.</p>
<nav>{% for c in chapters %}<a href="#c{{ c.number }}">{{ c.title }}</a>{{ " | " if not loop.last }}{% endfor %}
{% if equations %} | <a href="#equations">equations</a>{% endif %}</nav>
{% for c in chapters %}
<h2 id="c{{ c.number }}">{{ heading(c) }}</h2><p>{{ c.lead }}</p>
{% if c.claims %}<table><caption>Claims</caption>
<tr><th>where</th><th>the thesis says</th><th>printed</th><th>here</th><th>holds</th><th>why</th></tr>
{% for k in c.claims %}<tr class="{{ 'yes' if k.holds else 'no' }}"><td>{{ k.where }}</td><td>{{ k.says }}</td>
<td>{{ k.printed }}</td><td>{{ k.ours }}</td><td>{{ "yes" if k.holds else "no" }}</td><td>{{ k.why }}</td></tr>
{% endfor %}</table>{% endif %}
{% for t in c.tables %}<table><caption>{{ t.title }}</caption>
<tr>{% for h in t.header %}<th>{{ h }}</th>{% endfor %}</tr>
{% for r in t.rows %}<tr>{% for x in r %}<td>{{ x }}</td>{% endfor %}</tr>{% endfor %}</table>
{% if t.note %}<p class="note">{{ t.note }}</p>{% endif %}{% endfor %}
{% for p in c.pictures %}<figure><img alt="{{ p.title }}" src="data:image/png;base64,{{ png(p.canvas) }}">
<figcaption><b>{{ p.title }}.</b> {{ p.note }}</figcaption></figure>{% endfor %}
{% endfor %}
{% if equations %}<h2 id="equations">Equations and where they are used</h2><table><tr><th>Eq.</th><th>in</th></tr>
{% for n, names in equations.items() %}<tr><td>{{ n[0] }}.{{ n[1] }}</td>
<td>{% for name in names %}<code>{{ name }}</code>{{ ", " if not loop.last }}{% endfor %}</td></tr>
{% endfor %}</table>{% endif %}
</body></html>
"""


def heading(chapter: Chapter) -> str:
    """Chapters 2 to 6 are the thesis's; what follows is not one."""
    return f"Chapter {chapter.number}. {chapter.title}" if chapter.number <= 6 else chapter.title


def png(canvas: Canvas) -> str:
    """A drawn figure as base64 PNG."""
    buffer = io.BytesIO()
    FigureCanvasAgg(canvas).print_figure(buffer, dpi=90)
    return base64.b64encode(buffer.getvalue()).decode("ascii")


def write_page(path: Path, chapters: Sequence[Chapter], settings: ThesisSettings) -> None:
    """Write the page; a file that exists is whole (written beside it, then renamed)."""
    claims = [claim for chapter in chapters for claim in chapter.claims]
    text = Environment(autoescape=True, trim_blocks=True).from_string(TEMPLATE).render(
        chapters=chapters,
        held=sum(claim.holds for claim in claims),
        total=len(claims),
        settings=", ".join(f"{name} {value}" for name, value in vars(settings).items()),
        equations=equation_index(),
        heading=heading,
        png=png,
    )  # fmt: skip
    _write(path, text)


def write_claims(path: Path, chapters: Sequence[Chapter]) -> None:
    """Write the table of claims as Markdown (docs/thesis-claims.md)."""
    lines = [
        "# What the thesis claims, and what comes out here",
        "",
        "Made by `pneumo thesis --claims docs/thesis-claims.md`; settings in config/thesis.yaml; errata in errata.md.",
    ]
    for chapter in chapters:
        lines += ["", f"## {heading(chapter)}", "", chapter.lead, ""]
        lines += ["| where | the thesis says | printed | here | holds | why |", "|---|---|---|---|---|---|"]
        lines += [_row(claim) for claim in chapter.claims]
    _write(path, "\n".join(lines) + "\n")


def _row(claim: Claim) -> str:
    cells = (claim.where, claim.says, claim.printed, claim.ours, "yes" if claim.holds else "**no**", claim.why)
    return "| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |"


def _write(path: Path, text: str) -> None:
    with new_file(path) as part:
        part.write_text(text, encoding="utf-8")
