# SPDX-License-Identifier: Apache-2.0
"""The table of docs/security.md says what the tests and benches are: they exist, and their counts are theirs."""

from __future__ import annotations

import re

import pytest
from helpers.bombs import BOMBS
from helpers.folders import ROOT
from helpers.hostile import hostile_texts
from helpers.line_proxy import KINDS

TABLE = re.compile(r"^\| (?P<line>[^|]+) \| (?P<shown>[^|]+) \| (?P<counts>[^|]+) \|$", re.MULTILINE)
COUNTS = {"bombs": len(BOMBS), "kinds of spoiling": len(KINDS), "texts in": len(hostile_texts())}
ROWS = TABLE.findall((ROOT / "docs" / "security.md").read_text(encoding="utf-8"))[1:]


def test_every_line_is_shown_by_something_that_exists() -> None:
    assert len(ROWS) == 9
    for line, shown, counts in ROWS:
        places = re.findall(r"`([^`]+)`", shown)
        assert places and counts.strip(), line
        assert all((ROOT / place).exists() for place in places), line


@pytest.mark.parametrize("what", COUNTS)
def test_the_counts_of_the_table_are_those_of_the_tests(what: str) -> None:
    stated = [int(number) for _, _, counts in ROWS for number in re.findall(rf"(\d+) {what}", counts)]
    assert stated == [COUNTS[what]]
