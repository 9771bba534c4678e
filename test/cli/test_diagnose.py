# SPDX-License-Identifier: Apache-2.0
"""`pneumo diagnose` as a user types it: an effect of one's own, a known change, installed effects, bad input."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.folders import DOCS
from helpers.rig_logs import noisy, simulated, write_log
from helpers.small_logs import STRING, T0, contract_log, text, write
from typer.testing import CliRunner

from pneumo_ros.cli import own_laws
from pneumo_ros.cli.diagnose import _bench, app
from pneumo_ros.diagnosis.half_car.from_logs import prepared
from pneumo_ros.diagnosis.half_car.signals import read_signals
from pneumo_ros.effects.composition import PlantTerm
from pneumo_ros.effects.loading import laws_of, load_library
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError
from pneumo_ros.rig import load_rig

PAGE = DOCS / "diagnosis.md"
SIZE = 900.0  # N s2/m2
KEPT = ("leak", "valve_lag")  # rivals that stay, so that the test does not fit the whole library


@pytest.fixture(scope="module")
def own_effect(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example of the manual as a file."""
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert code is not None
    path = tmp_path_factory.mktemp("own") / "quadratic.py"
    path.write_text(code.group(1), encoding="utf-8")
    return path


def test_what_comes_next_runs_on_the_bench_that_the_log_is_of(tmp_path: Path) -> None:
    daq = "node: daq\nparameters: {port: /dev/ttyACM0, calibration: mine.yaml, baud: 921600}\n"
    bench = write(tmp_path / "bench.mcap", [*contract_log(20), ("/rig/setup", STRING, T0, text(daq))])
    assert _bench(bench) == ("--source", "serial", "--port", "/dev/ttyACM0", "--calibration", "mine.yaml")
    plant = "node: plant\nparameters: {simulated_rig: 'my rig.yaml', seed: 1}\n"
    hidden = write(tmp_path / "hidden.mcap", [*contract_log(20), ("/rig/setup", STRING, T0, text(plant))])
    assert _bench(hidden) == ("--set", "plant.simulated_rig=my rig.yaml")  # not the rig that the nodes were told
    (tmp_path / "my rig.yaml").touch()  # typed beside the log, diagnosed from elsewhere
    assert _bench(hidden) == ("--set", f"plant.simulated_rig={tmp_path / 'my rig.yaml'}")
    nominal = ("/rig/setup", STRING, T0, text(plant.replace("'my rig.yaml'", "''")))
    plain = write(tmp_path / "plain.mcap", [*contract_log(20), nominal])
    assert _bench(plain) == ("--source", "sim")
    assert _bench(write(tmp_path / "foreign.mcap", contract_log(20))) == ()


@pytest.fixture(scope="module")
def short_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log that is long enough to be diagnosed."""
    return write_log(tmp_path_factory.mktemp("log") / "fit.mcap", *simulated(3.0), [load_rig().to_yaml()])


def damped_log(path: Path, seed: int, own_effect: Path, payload: float = 0.0) -> Path:
    """A log of the nominal rig that has the example's effect at both ends and, stated by its config, a payload, kg."""
    clean, road, commands = simulated(7.0, seed)
    carrier = read_signals(write_log(path.with_suffix(".carrier.mcap"), clean, road, commands, [load_rig().to_yaml()]))
    model = RigModel(load_rig(), load_library([own_effect]))
    values = [p.nominal + payload * (p.name == "sprung_mass") for p in model.parameters]
    channels = model.simulate(carrier, np.array(values), active=(Active("quadratic_damping", "both", (SIZE,)),))
    stated = load_rig().with_values(sprung_mass=load_rig().sprung_mass.value + payload)
    return write_log(path, noisy(channels, seed), road, commands, [stated.to_yaml()])


@pytest.mark.slow
def test_an_effect_of_ones_own_wins_and_predicts_a_known_change(
    tmp_path: Path, own_effect: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PNEUMO_KERNEL_CACHE", str(tmp_path / "kernels"))
    fit, held = (damped_log(tmp_path / f"{name}.mcap", k, own_effect) for k, name in enumerate(("fit", "held")))
    edit = damped_log(tmp_path / "heavier.mcap", 3, own_effect, payload=4.0)
    library = load_library()
    without = [word for name in library if name not in KEPT for word in ("--without", name)]
    done = CliRunner().invoke(app, [
        str(fit), "--holdout", str(held), "--edit", str(edit), "--effect", str(own_effect), "--no-pairs", *without,
        "-o", str(tmp_path / "out"), "--save-rig", str(tmp_path / "rig.yaml"),
    ])  # fmt: skip
    assert done.exit_code == 0, done.output
    said = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert said["verdict"] == "quadratic_damping" and said["probability"] > 0.9
    size = said["ranking"][0]["parameters"]["square_damping"]
    assert size["value"] == pytest.approx(SIZE, rel=0.1) and size["unit"] == "N s2/m2"
    test = said["edit_test"]
    assert test["changes"] == {"sprung_mass": pytest.approx(1.0 + 4.0 / load_rig().sprung_mass.value, rel=1e-5)}
    assert test["gap_best"] < 0.4 * test["gap_refit"] and test["gap_best"] < 3 * said["gap"]["noise_floor"]
    assert "effects of your own that competed: quadratic_damping" in said["notes"]
    assert "edit test on heavier.mcap (sprung_mass +7.9 %)" in done.output.replace("\n", " ")
    assert "quadratic_damping" in (tmp_path / "rig.yaml").read_text()
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["diagnosis.json", "report.html", "residual.mcap"]


TAKEN = r"allowed: id, summary, sites, places, parameters, .*; did you mean 'summary'\?"


@pytest.mark.parametrize(
    ("right", "wrong", "line", "words"),
    [
        ("low=0.0", "low=6000.0", 21, r"low 6000 is not below high 5000"),
        ("{end}_force", "{end}_forze", 15, r"unknown place '{end}_forze'; allowed: {end}_force, {end}_air, "),
        ("summary=", "sumary=", 15, rf"Effect has no such field, key 'sumary'; {TAKEN}"),
        ("force(strut, z, p)", "force(strut, p)", 10, r"another form, key 'force', value '\(strut, p\)'; "
         r"allowed: \(strut, z, p\)"),
        ("@njit", "#", 11, r"an ordinary function, key 'force'; write @njit\(cache=True, error_model=\"numpy\"\)"),
        pytest.param("p[0]", "q[0]", 10, r"cannot be compiled \(NameError: name 'q' is not defined\); mend the law; "
                     r".*hooks\.py", marks=pytest.mark.slow),
        pytest.param("* strut.rate", "* strut.rat", 12, r"Strut has no such field, key 'rat'; allowed: height, rate, "
                     r"gauge, area, force, middle, middle_rate; did you mean 'rate'\?", marks=pytest.mark.slow),
    ],
    ids=["low above high", "place", "field", "arguments", "not compiled", "name", "signal"],
)  # fmt: skip
def test_a_mistake_in_an_effect_is_one_line_with_file_and_line(
    tmp_path: Path, own_effect: Path, short_log: Path, right: str, wrong: str, line: int, words: str
) -> None:
    """What numba finds ended in 95 lines of traceback; whatever it was, an empty folder was left."""
    file, folder = tmp_path / "mine.py", tmp_path / "report"
    file.write_text(own_effect.read_text().replace(right, wrong, 1))
    without = [word for name in load_library() for word in ("--without", name)]
    told = [str(short_log), "--output", str(folder), "--effect", str(file), *without]
    error = CliRunner().invoke(app, told).exception
    assert isinstance(error, InputError) and re.fullmatch(rf"{re.escape(str(file))}:{line}: .*{words}.*", str(error))
    assert not folder.exists()


def test_an_installed_package_offers_effects(tmp_path: Path, own_effect: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As an installer leaves it: the module, and entry_points.txt in its .dist-info."""
    (tmp_path / "my_rig_effects.py").write_text(own_effect.read_text())
    info = tmp_path / "my_rig-0.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-rig\nVersion: 0.1\n")
    (info / "entry_points.txt").write_text("[pneumo_ros.effects]\nquadratic_damping = my_rig_effects:EFFECT\n")
    assert "quadratic_damping" not in load_library()
    monkeypatch.syspath_prepend(tmp_path)
    assert load_library()["quadratic_damping"].summary == "the strut's damping grows with the square of its speed"
    log = write_log(tmp_path / "a.mcap", *simulated(4.0), [load_rig().to_yaml()])
    assert "effects of your own that competed: quadratic_damping" in prepared([log]).notes


def test_an_edit_log_that_states_no_change_is_said_to_be_none(tmp_path: Path) -> None:
    logs = [write_log(tmp_path / f"{k}.mcap", *simulated(4.0, k), [load_rig().to_yaml()]) for k in range(3)]
    notes = prepared(logs[:1], logs[1], edit=logs[2]).notes
    assert any("2.mcap" in note and "states no change" in note for note in notes)


def test_inputs_that_throw_the_model_off_are_refused(tmp_path: Path) -> None:
    """A road in inches stays below half a metre, but no rig can follow it."""
    clean, road, commands = simulated(4.0)
    log = write_log(tmp_path / "inches.mcap", clean, road / 0.0254, commands, [load_rig().to_yaml()])
    with pytest.raises(InputError, match=r"inches\.mcap: the nominal model runs away.*check the units"):
        prepared([log])


def test_an_output_that_cannot_be_written_is_said_before_the_work(tmp_path: Path) -> None:
    """The folder is looked at before anything is diagnosed."""
    write(tmp_path / "nothing.mcap", contract_log(5))
    (tmp_path / "file").write_text("")
    for options in (
        ["-o", str(tmp_path / "file" / "out")],
        ["-o", str(tmp_path / "out"), "--save-rig", str(tmp_path / "file" / "rig.yaml")],
        ["-o", str(tmp_path / "out"), "--save-rig", str(tmp_path)],
    ):
        done = CliRunner().invoke(app, [str(tmp_path / "nothing.mcap"), *options])
        assert isinstance(done.exception, InputError) and "nothing.mcap" not in str(done.exception)


def test_of_effects_to_do_without_those_are_listed_that_a_verdict_may_name(short_log: Path) -> None:
    with pytest.raises(InputError, match=r"unknown effect.*'leek'.*did you mean 'leak'") as told:
        prepared([short_log], without=["leek"])
    listed = str(told.value).partition("allowed: ")[2].partition(";")[0].split(", ")
    assert listed == sorted(laws_of(load_library()))


def test_a_log_given_twice_is_refused(tmp_path: Path) -> None:
    logs = [write_log(tmp_path / name, *simulated(4.0), [load_rig().to_yaml()]) for name in ("a.mcap", "b.mcap")]
    with pytest.raises(InputError, match=r"a\.mcap, b\.mcap: the same log is given twice"):
        prepared(logs)


def test_the_form_of_every_function_of_a_law_is_known() -> None:
    """One that is not would end in a traceback where its mistake should be told; arguments as PlantTerm states them."""
    hooks = {name for name, given in PlantTerm.__dataclass_fields__.items() if given.default is None}
    assert set(own_laws.TAKEN) == hooks
    stated = dict(re.findall(r"^ +(\w+) : \(([\w, ]+)\) ->", PlantTerm.__doc__ or "", re.MULTILINE))
    assert stated == own_laws.TAKEN
