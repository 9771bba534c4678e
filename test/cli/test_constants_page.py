# SPDX-License-Identifier: Apache-2.0
"""Every constant of the diagnosis states what it is and where its value comes from."""

from __future__ import annotations

import pytest
from helpers.folders import ROOT

from pneumo_ros.cli.constants_page import ORIGINS, Constant, constants_of, constants_page, declared


@pytest.mark.parametrize("name", list(declared()))
def test_every_constant_is_final_and_has_a_meaning_and_an_origin(name: str) -> None:
    bare = [c.name for c in declared()[name] if not (c.final and c.text and c.origin in ORIGINS)]
    assert not bare, f"{name}: declare as NAME: Final = value  # meaning [one of {', '.join(ORIGINS)}]"


def test_a_calibrated_constant_names_what_gave_it() -> None:
    calibrated = [c for constants in declared().values() for c in constants if c.origin == "calibration"]
    assert calibrated and all(c.detail for c in calibrated)
    for constant in calibrated:
        if constant.detail.startswith("bench/"):
            assert (ROOT / constant.detail).exists(), constant.name


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("SHARE: Final = 0.1  # of the gap [taste]", Constant("SHARE", "0.1", True, "of the gap", "taste")),
        ("# Of the\n# gap [calibration: a run]\nSHARE: Final = 0.1",
         Constant("SHARE", "0.1", True, "Of the gap", "calibration", "a run")),
        ("SHARE: Final = 0.1  # of the gap", Constant("SHARE", "0.1", True)),
        ("SHARE = 0.1  # of the gap [taste]", Constant("SHARE", "0.1", False, "of the gap", "taste")),
        ("MASS: Final[Mapping[str, float]] = {}  # kg [physics]", Constant("MASS", "{}", True, "kg", "physics")),
        ('NAME: Final = "µ"  # micro [display]', Constant("NAME", "'µ'", True, "micro", "display")),
    ],
)  # fmt: skip
def test_a_declaration_is_read_as_it_stands(source: str, found: Constant) -> None:
    assert constants_of(source) == [found]


def test_the_page_is_up_to_date() -> None:
    assert (ROOT / "docs" / "constants.md").read_text(encoding="utf-8") == constants_page()
