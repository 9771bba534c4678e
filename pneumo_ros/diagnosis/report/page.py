# SPDX-License-Identifier: Apache-2.0
"""The report as one self-contained HTML file."""

from __future__ import annotations

import re
from importlib import resources
from pathlib import Path
from typing import Final

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup, escape

from pneumo_ros.diagnosis.report.contents import Findings, contents
from pneumo_ros.diagnosis.report.rig_map import colour
from pneumo_ros.diagnosis.report.words import sentence
from pneumo_ros.errors import InputError
from pneumo_ros.files import new_file
from pneumo_ros.printable import shown

TEMPLATE: Final = "template.html.j2"  # file of the page's template [definition]


def render(found: Findings) -> str:
    """The page's HTML; it refers to nothing outside itself."""
    source = resources.files(__package__).joinpath(TEMPLATE).read_text(encoding="utf-8")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, finalize=shown
    )
    environment.filters["whole_options"] = whole_options
    environment.filters["sentence"] = sentence
    return environment.from_string(source).render(contents(found), cold=colour(0.0), hot=colour(1.0))


def whole_options(text: str) -> Markup:
    """A sentence in which no line ends within an option such as --duration."""
    return Markup(re.sub(r"--[\w-]+", r'<span class="option">\g<0></span>', str(escape(text))))


def write_report(path: Path, found: Findings) -> None:
    """Write the page; the name appears only when it is complete.

    Raises
    ------
    InputError
        if the folder cannot be written.
    """
    try:
        with new_file(path) as part:
            part.write_text(render(found), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write the report ({error})", where=path, remedy="choose another folder") from error
