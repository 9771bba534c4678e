# SPDX-License-Identifier: Apache-2.0
"""What README and docs/ tell a user to type exists: verbs, their options, make targets, files."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest
import typer.main
from helpers.folders import ROOT

from pneumo_ros.cli.main import VERBS, app
from pneumo_ros.effects.loading import laws_of, load_library

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
TYPED = re.compile(r"\bpneumo ((?:[a-z][a-z-]* )*[a-z][a-z-]*)([^`|\n]*)")


@cache
def options(verb: str, sub: str = "") -> frozenset[str]:
    """Every option of a verb (and its sub-command), as typed."""
    group = typer.main.get_command(app)
    command = group.get_command(None, verb)  # type: ignore[attr-defined]
    if sub:
        command = command.commands[sub]
    return frozenset(name for parameter in command.params for name in (*parameter.opts, *parameter.secondary_opts))


def subs(verb: str) -> set[str]:
    command = typer.main.get_command(app).get_command(None, verb)  # type: ignore[attr-defined]
    return set(getattr(command, "commands", {}))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_of_the_page_can_be_typed(page: Path) -> None:
    for words, rest in TYPED.findall(page.read_text(encoding="utf-8")):
        verb, *more = words.split()
        if verb not in VERBS:
            continue  # a sentence, not a command: "pneumo is ..."
        sub = more[0] if more and more[0] in subs(verb) else ""
        wanted = re.findall(r"(?<![\w-])--?[a-z][a-z-]*", rest.split("#")[0].split("&")[0])
        assert set(wanted) <= options(verb, sub), f"pneumo {words}{rest}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_make_target_of_the_page_exists(page: Path) -> None:
    rules = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    text = page.read_text(encoding="utf-8")
    named = set(re.findall(r"(?:`|^ {4})make ([a-z][a-z-]*)", text, re.MULTILINE))
    assert named <= rules


def test_every_phony_target_has_a_rule() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    phony = re.search(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)
    assert phony is not None
    assert set(phony.group(1).split()) <= set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_leads_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_the_families_of_the_readme_are_the_librarys() -> None:
    table = (ROOT / "README.md").read_text(encoding="utf-8").split("## What it can name")[1].split("##")[0]
    named = re.findall(r"`([a-z_]+)`", table.split("`pneumo effects")[0])
    assert sorted(named) == sorted(laws_of(load_library()))


def test_the_picture_of_the_readme_is_small() -> None:
    assert (ROOT / "docs" / "images" / "report.png").stat().st_size < 150_000
