# SPDX-License-Identifier: Apache-2.0
"""A free run of an FMU is rig.py's, for each version and interface; it bounces where it should, and fails alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.fmus import FRAME_YAML, built, frame_log, with_names
from helpers.folders import ROOT

from pneumo_ros.diagnosis.diagnose import Options
from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.effects.parameters import Active
from pneumo_ros.own_rig.description import read_description
from pneumo_ros.own_rig.fmu.model import load_fmu
from pneumo_ros.own_rig.fmu.names import fmu_names
from pneumo_ros.own_rig.from_files import OwnTask, prepared
from pneumo_ros.own_rig.outputs import save_rig

RUBBED = (Active("coulomb_friction", "floor_to_ground", (1.3,)),)
CASES = [(2, "ModelExchange"), (2, "CoSimulation"), (3, "ModelExchange"), (3, "CoSimulation")]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return frame_log(tmp_path_factory.mktemp("frame") / "log.csv")


@pytest.fixture(scope="module")
def own(log: Path) -> OwnTask:
    folder = log.parent
    names = FRAME_YAML.partition("fmu:")[0]
    (folder / "rig.yaml").write_text(names, encoding="utf-8")
    return prepared(ROOT / "examples/frame/rig.py", [log], rig=folder / "rig.yaml")


Found = tuple[OwnTask, Diagnosis]


@pytest.fixture(scope="module")
def stepping(log: Path) -> Found:
    """A co-simulation and what is found with it."""
    task = prepared(with_names(built(log.parent / "CoSimulation.fmu", 2, ("CoSimulation",))), [log])
    return task, task.diagnose(Options(pairs=False))


def free(task: OwnTask) -> np.ndarray:
    record, nominal = task.fit[0], np.array([p.nominal for p in task.model.parameters])
    return task.model.predict(record, nominal, task.model.initial(record)[0], RUBBED)


@pytest.mark.slow
@pytest.mark.parametrize(("version", "interface"), CASES)
def test_a_free_run_is_the_rig_files(version: int, interface: str, own: OwnTask, log: Path, tmp_path: Path) -> None:
    task = prepared(with_names(built(tmp_path / "frame.fmu", version, (interface,))), [log])
    first, again, wanted = free(task), free(task), free(own)
    assert np.array_equal(first, again)  # one instance, reset between runs
    tolerance = 1e-12 if interface == "ModelExchange" else 0.02  # friction is held over a co-simulation's step
    assert np.abs(first - wanted).max() < tolerance * np.abs(wanted).max()
    assert task.model.scaling.mobility == pytest.approx(own.model.scaling.mobility, rel=0.02)
    assert task.model.physics.kernel.alone and [s.place for s in task.model.physics.slots] == [
        "floor_to_ground", "floor_to_base", "sensor:floor"]  # fmt: skip


BALL_YAML = """
rig: ball
time: 5 ms
channels: {height: {field: x, unit: m}}
states: {height: 1 m, speed: 0 m/s}
parameters: {mass: 3 kg, bounce: 0.8 +- 0.01}
fmu:
  names: {height: body.s, speed: body.v}
  slots: {height: sensor}
"""


@pytest.mark.slow
@pytest.mark.parametrize("completed", [False, True])
def test_a_ball_bounces_where_its_height_is_zero(completed: bool, tmp_path: Path) -> None:
    """From 1 m it is down after sqrt(2 h / g) and up again to e^2 h; a change is found at the end of a step."""
    fmu = with_names(built(tmp_path / "ball.fmu", 2, defines=("BALL",), completed=completed), BALL_YAML)
    physics, rig = load_fmu(fmu, read_description(fmu.with_suffix(".yaml")))
    nothing = np.zeros((0, 0))
    p, rows, period = np.array([3.0, 0.8]), 1300, 1e-3
    out, _, _ = physics.kernel.run(np.array([1.0, 0.0]), np.zeros((rows, 0)), np.zeros(0, bool), period, 1, p,
                                   np.zeros(0, np.int64), np.zeros(0, bool), nothing, nothing, 0.0)  # fmt: skip
    height, down = out[:, 0], np.sqrt(2.0 / 9.81)
    assert list(rig.states) == ["height", "speed"]
    assert height.min() > -0.01
    second = height[int(down / period) :]
    assert second.max() == pytest.approx(0.64, abs=0.01)
    assert int(np.argmax(second)) * period == pytest.approx(0.8 * down, abs=3 * period)


@pytest.mark.slow
def test_a_run_that_fails_is_a_divergence_and_the_next_one_is_whole(log: Path, tmp_path: Path) -> None:
    fmu = with_names(built(tmp_path / "frame.fmu", 2, defines=("FAILS",)))
    task = prepared(fmu, [log])
    record, nominal = task.fit[0], np.array([p.nominal for p in task.model.parameters])
    start = task.model.initial(record)[0]
    whole = task.model.predict(record, nominal, start, ())
    assert np.isnan(task.model.predict(record, nominal, np.array([0.9, 1e3]), ())[5:]).all()
    assert np.array_equal(task.model.predict(record, nominal, start, ()), whole) and np.isfinite(whole).all()


@pytest.mark.slow
def test_the_verdict_and_the_budget_are_the_rig_files(log: Path, own: OwnTask, stepping: Found, tmp_path: Path) -> None:
    """By either interface; friction against the ground, which the log has. One effect at a time: pairs take thrice as
    long and are the search's business, which knows of no FMU.
    """
    wanted = own.diagnose(Options(pairs=False))
    assert wanted.verdict == "coulomb_friction" and wanted.location[0][0] == "floor_to_ground"
    exchanging = prepared(with_names(built(tmp_path / "ModelExchange.fmu", 2)), [log])
    for found in (exchanging.diagnose(Options(pairs=False)), stepping[1]):
        assert found.verdict == wanted.verdict and found.location[0][0] == "floor_to_ground"
        assert [(one.effects, one.places) for one in found.budget] == [(o.effects, o.places) for o in wanted.budget]
        assert [one.share for one in found.budget] == pytest.approx([one.share for one in wanted.budget], abs=0.03)


@pytest.mark.slow
def test_a_saved_rig_of_an_fmu_is_a_model_of_it(log: Path, stepping: Found, tmp_path: Path) -> None:
    task, found = stepping
    again = prepared(log.parent / "CoSimulation.fmu", [log], rig=save_rig(found, task.model, tmp_path / "saved.yaml"))
    assert {(one.effect.partition(".")[0], one.site) for one in again.model.configured} == {
        ("coulomb_friction", "floor_to_ground")}  # fmt: skip
    assert again.diagnose(Options(pairs=False)).verdict == "none"


def test_slots_are_read_by_kind(tmp_path: Path) -> None:
    entry = {"slots": {
        "valve": {"flow": "q", "up": "tank.p", "down": "air.p", "nominal": "m_dot", "gas": False, "unit": "m3/s"},
        "teeth": {"contact": "t", "travel": "a.phi - b.phi", "rate": "a.w - b.w", "load": "tau", "unit": "N m"},
        "speed": "sensor", "motor": "input",
    }}  # fmt: skip
    found = fmu_names(entry, tmp_path / "rig.yaml")
    valve, teeth = found.inside
    assert (valve.slot.kind, valve.variable, valve.slot.gas) == ("flow", "q", False)  # type: ignore[attr-defined]
    assert valve.coordinates == ((("tank.p", 1.0),), (("air.p", 1.0),), (("m_dot", 1.0),))
    assert teeth.slot.kind == "contact" and teeth.coordinates[0] == (("a.phi", 1.0), ("b.phi", -1.0))
    assert [slot.place for slot in found.signals] == ["sensor:speed", "input:motor"]
