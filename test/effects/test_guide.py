# SPDX-License-Identifier: Apache-2.0
"""Every effect says what it is, what it is mistaken for and how to check it by hand; a mistaken file says where."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from pneumo_ros.cli.effects import app
from pneumo_ros.effects.expected import SUPPLY, choked, falling, sagged, settling
from pneumo_ros.effects.guide import displayed
from pneumo_ros.effects.loading import laws_of, load_library
from pneumo_ros.effects.sheet import check_words, effects_page
from pneumo_ros.errors import InputError
from pneumo_ros.plant.air_spring import pressure_rate
from pneumo_ros.plant.half_car import gas_of
from pneumo_ros.rig import load_rig

LIBRARY = laws_of(load_library())
HEAD = (
    "from pneumo_ros.effects.contract import ENDS, Effect\nfrom pneumo_ros.effects.parameters import EffectParameter\n"
)
GOOD = 'EffectParameter("size", "N", 0.0, 9.0, 1.0, size=True)'


@pytest.mark.parametrize("name", LIBRARY)
def test_the_facts_fit_the_effect(name: str) -> None:
    effect = LIBRARY[name]
    assert effect.guide is not None and effect.guide.meaning.endswith(".")
    assert effect.guide.names() <= {p.name for p in effect.parameters}
    assert all(10 < len(p.meaning) < 60 and not p.meaning.endswith(".") for p in effect.parameters)
    assert effect.guide.mistaken_for and set(effect.guide.mistaken_for) <= set(LIBRARY) - {name}
    said = check_words(effect)
    assert "{" not in said and len(said) > 40


def test_the_check_takes_what_was_found() -> None:
    said = check_words(LIBRARY["coulomb_friction"], {"friction_force": 16.2})
    assert "twice 16.2 N between up and down" in said
    assert displayed(0.0042, "m") == "4.2 mm" and displayed(0.03, "1") == "3 %" and displayed(2e-7, "m2") == "0.2 mm2"


RIDDLE = re.compile(r"\bsome (mm|ms|s|kPa|N|periods)\b|in a bend|s/g|N/m\b|by itself|\{")


@pytest.mark.parametrize("name", LIBRARY)
def test_a_check_says_what_to_do_and_what_number_is_seen(name: str) -> None:
    """With a value and its unit; without one it says what is looked for, in which unit, and where to find how much."""
    effect = LIBRARY[name]
    assert effect.guide is not None
    said = check_words(effect)
    assert not RIDDLE.search(said), said
    assert re.search(r"\d (N|Hz|mm|mm2|cm3|ms|kPa|kPa/s|%|kg|N/mm|N s/m)\b|\d %", said), said
    bare = effect.guide.check_with({p.name: (None, p.unit) for p in effect.parameters})
    assert not RIDDLE.search(bare) and bare.endswith("; read the size off the curve in the report"), bare
    assert re.search(r"\bthe [a-z ]+ \((N|Hz|mm|mm2|cm3|ms|kPa|kPa/s|%|kg|N/mm|N s/m)\)", bare), bare


def test_numbers_that_are_no_parameter_follow_from_the_rig() -> None:
    """A hole's fall of pressure by the plant's own equation; heat and sag by what they must give in their limits."""
    rig = load_rig()
    rate = pressure_rate(3e5, rig.design_height.value, 0.0, 0.0, 2e-7, gas_of(rig, reference_pressure=3e5))
    assert falling({"leak_area": 2e-7}) == pytest.approx(-rate, rel=1e-3)
    assert settling({"wall_conductance": 0.4}) == pytest.approx(settling({"wall_conductance": 0.2}) / 2.0)
    assert choked(2e-6, SUPPLY) == pytest.approx(3.7e-3, rel=0.01)  # as the check has it
    assert sagged({"supply_resistance": 1e5}) == pytest.approx(1e5 * choked(2e-6, SUPPLY), rel=1e-3)
    assert sagged({"supply_resistance": 1e12}) == pytest.approx(SUPPLY, rel=1e-3)


@pytest.mark.parametrize("width", ["80", "120"])
def test_an_effect_is_read_on_the_terminal(width: str) -> None:
    done = CliRunner().invoke(app, ["leak"], env={"COLUMNS": width})
    assert done.exit_code == 0 and max(map(len, done.output.splitlines())) <= int(width)
    words = " ".join(done.output.split())
    for part in ("leak:", "acts at front, rear, both", "front_air, rear_air", "leak_area", "2e-07", "by hand",
                 "0.2 mm2", "supply_droop: happens only"):  # fmt: skip
        assert part in words, words
    for word in ("0 a hole,", "area of the"):  # what the parameters are; a narrow terminal breaks the lines
        assert word in words, words
    listed = CliRunner().invoke(app, [], env={"COLUMNS": width})
    assert all(name in listed.output for name in LIBRARY) and "…" not in listed.output


@pytest.mark.parametrize("width", ["80", "120"])
def test_a_family_of_a_rig_of_ones_own_is_read_on_the_terminal(width: str) -> None:
    done = CliRunner().invoke(app, ["backlash"], env={"COLUMNS": width})
    assert done.exit_code == 0 and max(map(len, done.output.splitlines())) <= int(width)
    words = " ".join(done.output.split())
    for part in ("at slots of a rig of your own", "contact", "input", "by hand", "looks like it", "dead_zone:"):
        assert part in words, words


def test_a_wrong_name_is_told_with_all_of_them() -> None:
    error = CliRunner().invoke(app, ["valve_leg"]).exception
    assert isinstance(error, InputError) and "did you mean 'valve_lag'?" in str(error)
    assert all(name in str(error) for name in LIBRARY)


def test_the_page_has_every_effect() -> None:
    page = effects_page(LIBRARY)
    assert all(f"## {name}\n" in page for name in LIBRARY)


MISTAKES = {
    "an unknown field": (
        f'EFFECT = Effect(\n    id="x", sumary="x", sites=ENDS, places=(), parameters=({GOOD},),\n)\n',
        ["mine.py:3", "Effect has no such field", "'sumary'", "summary", "places", "did you mean 'summary'?"],
    ),
    "a missing field": (
        'EFFECT = Effect(id="x", summary="x")\n', ["mine.py:3", "Effect lacks", "sites", "parameters", "guide"],
    ),
    "bounds the wrong way": (
        'SIZE = EffectParameter("size", "N", 9.0, 1.0, 2.0)\n', ["mine.py:3", "low 9 is not below high 1"],
    ),
    "a typical value outside": (
        'SIZE = EffectParameter("size", "N", 0.0, 1.0, 2.0)\n', ["mine.py:3", "typical 2 is outside low 0 to high 1"],
    ),
    "an unknown place": (
        f'EFFECT = Effect(id="x", summary="x", sites=ENDS, places=("frnt_air",), parameters=({GOOD},))\n',
        ["mine.py:3", "unknown place 'frnt_air'", "front_air", "{end}_force"],
    ),
    "an unknown site": (
        f'EFFECT = Effect(id="x", summary="x", sites=("left",), places=(), parameters=({GOOD},))\n',
        ["mine.py:3", "unknown site 'left'", "'both'"],
    ),
    "no place": (
        f'EFFECT = Effect(id="x", summary="x", sites=ENDS, places=(), parameters=({GOOD},))\n',
        ["mine.py:3", "no place", "{end}_force"],
    ),
    "two parameters of one name": (
        f'EFFECT = Effect(id="x", summary="x", sites=ENDS, places=("{{end}}_force",), parameters=({GOOD}, {GOOD}))\n',
        ["mine.py:3", "2 parameters are called 'size'", "a name of its own"],
    ),
    "broken Python": ("def term(:\n", ["mine.py:3", "SyntaxError"]),
    "an error on the way": ("SIZE = 1.0\nSHARE = SIZE / 0.0\n", ["mine.py:4", "ZeroDivisionError"]),
}  # fmt: skip


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_in_a_file_is_one_line_with_its_place(tmp_path: Path, case: str) -> None:
    text, told = MISTAKES[case]
    (tmp_path / "mine.py").write_text(HEAD + text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_library([tmp_path / "mine.py"])
    said = str(error.value)
    assert "\n" not in said and all(part in said for part in told), said
