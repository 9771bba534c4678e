# SPDX-License-Identifier: Apache-2.0
"""The session's page as one self-contained HTML file."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from jinja2 import Environment, StrictUndefined

from pneumo_ros.errors import InputError
from pneumo_ros.files import new_file
from pneumo_ros.log.decoded import Log
from pneumo_ros.printable import shown
from pneumo_ros.session.report.contents import contents
from pneumo_ros.session.summary import Recorded

TEMPLATE = "template.html.j2"


def render(log: Log, passive: Recorded | None = None) -> str:
    """The page's HTML; it refers to nothing outside itself."""
    source = resources.files(__package__).joinpath(TEMPLATE).read_text(encoding="utf-8")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, finalize=shown
    )
    return environment.from_string(source).render(contents(log, passive))


def write_report(log: Log, path: Path, passive: Recorded | None = None) -> None:
    """Write the page; the name appears only when it is complete.

    Parameters
    ----------
    log : of this rig, with its configuration
    path : .html
    passive : see :func:`pneumo_ros.session.report.contents.contents`

    Raises
    ------
    InputError
        if the log is of no rig, or the page cannot be written.
    """
    page = render(log, passive)
    try:
        with new_file(path) as part:
            part.write_text(page, encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write the report ({error})", where=path, remedy="choose another folder") from error
