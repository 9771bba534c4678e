# SPDX-License-Identifier: Apache-2.0
"""Every row of the table of bad FMUs in docs/fmu.md: its one line, exit code 2, nothing written."""

from __future__ import annotations

import re
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.fmus import FRAME_YAML, built, frame_log, with_names
from helpers.folders import ROOT
from typer.testing import CliRunner

from pneumo_ros.cli import diagnose
from pneumo_ros.errors import InputError

Change = Callable[[Path], None]
XML = "modelDescription.xml"


def remade(change: Callable[[dict[str, bytes]], None]) -> Change:
    """The archive with other files in it."""

    def apply(fmu: Path) -> None:
        with zipfile.ZipFile(fmu) as archive:
            files = {name: archive.read(name) for name in archive.namelist()}
        change(files)
        with zipfile.ZipFile(fmu, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in files.items():
                archive.writestr(name, content)

    return apply


def text(old: str, new: str) -> Change:
    def change(files: dict[str, bytes]) -> None:
        assert old in files[XML].decode()
        files[XML] = files[XML].decode().replace(old, new, 1).encode()

    return remade(change)


def names(old: str, new: str) -> Change:
    def apply(fmu: Path) -> None:
        assert old in FRAME_YAML
        with_names(fmu, FRAME_YAML.replace(old, new, 1))

    return apply


def without(word: str) -> Change:
    def change(files: dict[str, bytes]) -> None:
        for name in [name for name in files if word in name]:
            del files[name]

    return remade(change)


UNIT = '<UnitDefinitions><Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit></UnitDefinitions><ModelVariables>'
BASE = 'name="base" valueReference="7" causality="input" variability="continuous"><Real '


def in_millimetres(fmu: Path) -> None:
    text("<ModelVariables>", UNIT)(fmu)
    text(BASE, BASE + 'unit="mm" ')(fmu)


BAD: dict[str, Change] = {
    "model.fmu is not there": lambda fmu: fmu.unlink(),
    "it is no zip": lambda fmu: fmu.write_bytes(b"PK" + fmu.read_bytes()[400:]) and None,
    "nothing in it describes a model": without(XML),
    "a path in it leads elsewhere": remade(lambda files: files.update({"resources/../../out.so": b"x"})),
    "it unpacks to too much": remade(lambda files: files.update({"resources/zeros": bytes(60_000_000)})),
    "its description has a document type": text("<fmiModelDescription", "<!DOCTYPE x><fmiModelDescription"),
    "its description is broken": text("</ModelVariables>", ""),
    "FMI 1": text('fmiVersion="2.0"', 'fmiVersion="1.0"'),
    "no binary for this platform": without("binaries"),
    "its library is none": remade(lambda files: files.update({next(n for n in files if "bin" in n): b"no library"})),
    "its library belongs to another description": text("{frame}", "{other}"),
    "it lacks the interface that is asked for": names("fmu:\n", "fmu:\n  interface: co-simulation\n"),
    "an entry of fmu that does not exist": names("  names: {floor", "  name: {floor"),
    "a variable that is not there": names("floor: body.s", "floor: body.z"),
    "a slot at what is no input": names("force: to_base", "force: swing"),
    "a parameter that cannot be set": names("speed: body.v}", "speed: body.v, mass: swing}"),
    "a variable that is not in SI": in_millimetres,
    "a state that is none": names("speed: body.v}", "speed: swing}"),
    "a force slot without its rate": names(", rate: body.v}", "}"),
    "rig.yaml has no entry fmu": lambda fmu: with_names(fmu, FRAME_YAML.partition("fmu:")[0]) and None,
}


def rows() -> dict[str, str]:
    """What is wrong -> what is said, of the page's table."""
    page = (ROOT / "docs/fmu.md").read_text(encoding="utf-8").partition("## What is refused")[2]
    return dict(re.findall(r"^\| (.+?) \| (.+?) \|$", page, re.MULTILINE)[1:])


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return built(tmp_path_factory.mktemp("fmu") / "frame.fmu").read_bytes()


def said(fmu: Path) -> str:
    words = [frame_log(fmu.with_name("log.csv"), seconds=1.0), "--fmu", fmu, "-o", fmu.with_name("out")]
    done = CliRunner().invoke(diagnose.app, [str(word) for word in words])
    assert isinstance(done.exception, InputError), done.output  # the command ends with code 2
    assert not (fmu.with_name("out") / "diagnosis.json").exists()
    return str(done.exception)


def test_the_page_lists_what_is_tested() -> None:
    assert set(rows()) == {*BAD, "fmpy is not installed"}


@pytest.mark.parametrize("wrong", sorted(BAD))
def test_a_bad_fmu_is_told_in_one_line(wrong: str, whole: bytes, tmp_path: Path) -> None:
    fmu = tmp_path / "model.fmu"
    fmu.write_bytes(whole)
    BAD[wrong](with_names(fmu))
    told = said(fmu)
    assert rows()[wrong] in told and len(told.splitlines()) == 1
    assert not (tmp_path.parent / "out.so").exists()


def test_without_fmpy_the_remedy_is_said(whole: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fmu = tmp_path / "model.fmu"
    fmu.write_bytes(whole)
    monkeypatch.setitem(sys.modules, "fmpy", None)
    told = said(with_names(fmu))
    assert rows()["fmpy is not installed"] in told and "pneumo_ros[fmu]" in told
