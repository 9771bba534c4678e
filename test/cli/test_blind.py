# SPDX-License-Identifier: Apache-2.0
"""`pneumo blind` at the command line: seals grow, scores are written, a changed verdict fails, mistakes are told."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from pneumo_ros.casemaker.plan import plan
from pneumo_ros.cli.blind import app, read_manifest, seal_set
from pneumo_ros.errors import InputError

NAMES = [case.name for case in plan("ci")]
RUNNER = CliRunner()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A set whose cases are made and diagnosed: every verdict the truth, but for the leak."""
    for name in ("labels", "diagnoses"):
        (tmp_path / name).mkdir()
    for case in plan("ci"):
        truth = [{"effect": e, "side": s, "places": ["supply"], "parameters": {"x": {"value": 1.0, "unit": "m"}},
                  "comparable": False} for e, s in case.effects]  # fmt: skip
        label = {"case": case.name, "kind": case.kind, "truth": truth, "grade": case.grade,
                 "ratio": {"fit": 20.0, "holdout": 20.0}, "withheld": list(case.withhold)}  # fmt: skip
        (tmp_path / "labels" / f"{case.name}.json").write_text(json.dumps(label))
        outside = case.kind in ("unknown", "withheld")
        verdict = "unknown" if outside else "+".join(e for e, _ in case.effects) or "none"
        diagnosis = {"verdict": "payload" if "leak" in verdict else verdict, "probability": 0.9, "location": []}
        content = {"diagnosis": diagnosis, "seconds": 1.0}
        (tmp_path / "diagnoses" / f"{case.name}.json").write_text(json.dumps(content))
    return tmp_path


def test_seals_of_earlier_cases_stay_when_a_set_grows(folder: Path) -> None:
    seal_set(folder, "ci", NAMES[:2])
    before = read_manifest(folder)["cases"]
    seal_set(folder, "ci", NAMES)
    after = read_manifest(folder)["cases"]
    assert after[:2] == before
    assert [entry["name"] for entry in after] == NAMES
    assert "truth" not in json.dumps(after)
    assert after[-1]["withhold"] == ["lvdt_scale"]


def test_score_writes_the_page_and_holds_verdicts(folder: Path) -> None:
    seal_set(folder, "ci", NAMES)
    expect = folder / "expect.json"
    verdicts = {name: json.loads((folder / "diagnoses" / f"{name}.json").read_text())["diagnosis"]["verdict"]
                for name in NAMES}  # fmt: skip
    expect.write_text(json.dumps(verdicts))
    done = RUNNER.invoke(app, ["score", str(folder), "--expect", str(expect)])
    assert done.exit_code == 0, done.output
    page = (folder / "results.md").read_text()
    assert "| ci-leak | single | leak (front) | 20.0 | payload 0.90 |" in page
    assert "0.500 (1/2;" in page
    expect.write_text(json.dumps({**verdicts, "ci-leak": "leak"}))
    done = RUNNER.invoke(app, ["score", str(folder), "--expect", str(expect)])
    assert done.exit_code == 1
    assert "ci-leak: verdict must be leak, is now payload (0.90)" in done.output and "1 of 6" in done.output
    (folder / "diagnoses" / "ci-pair.json").unlink()
    expect.write_text(json.dumps(verdicts))
    done = RUNNER.invoke(app, ["score", str(folder), "--expect", str(expect)])
    assert done.exit_code == 1 and "ci-pair: verdict must be valve_lag+tyre_damping, was not diagnosed" in done.output


def test_a_tampered_label_is_not_opened(folder: Path) -> None:
    seal_set(folder, "ci", NAMES)
    labels = folder / "labels.json"
    labels.write_text(labels.read_text().replace('"leak"', '"payload"'))
    done = RUNNER.invoke(app, ["score", str(folder)])
    assert isinstance(done.exception, InputError) and "ci-leak" in str(done.exception)
    assert "differs from the one that was sealed" in str(done.exception) and not (folder / "results.md").exists()


def test_mistakes_are_said(tmp_path: Path) -> None:
    other, foreign = tmp_path / "other", tmp_path / "foreign"
    for path, content in ((other, {"set": "dev", "cases": []}), (foreign, {"cases": [{"name": "a"}]})):
        path.mkdir()
        (path / "manifest.json").write_text(json.dumps(content))
    for arguments, message in (
        (["diagnose", str(tmp_path)], "cannot read the manifest"),
        (["make", str(tmp_path), "--set", "nope"], "unknown set"),
        (["make", str(tmp_path), "--set", "ci", "--only", "nope"], "no case has this"),
        (["make", str(other), "--set", "ci"], "holds another set"),
        (["diagnose", str(other), "--only", "nope"], "no case has this"),
        (["diagnose", str(foreign)], "not a manifest of cases"),
        (["score", str(other), "--expect", str(tmp_path / "nope.json")], "cannot read the expected verdicts"),
    ):
        done = RUNNER.invoke(app, arguments)
        assert isinstance(done.exception, InputError)
        assert message in str(done.exception)
