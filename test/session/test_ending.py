# SPDX-License-Identifier: Apache-2.0
"""Whether a session is complete, from what its nodes said."""

from __future__ import annotations

import pytest

from pneumo_ros.session.ending import Ending
from pneumo_ros.session.supervisor import NodeProcess, describe_end

RIG = frozenset({"plant"})
STARTED, OVER = ("session_started", "first sample"), ("session_complete", "the duration has passed")
CUT, TRIP = ("session_stopped", "cut short after 1.000 s of 20 s"), ("!sensor_rail", "a rail")


@pytest.mark.parametrize(
    ("heard", "rigs", "failure", "complete", "reason"),
    [
        ([STARTED, OVER], RIG, "", True, ""),
        ([STARTED, TRIP, OVER], RIG, "", True, ""),
        ([STARTED, CUT], RIG, "", False, "cut short after 1.000 s of 20 s"),
        ([STARTED, TRIP, CUT], RIG, "", False, "cut short after 1.000 s of 20 s; a rail"),
        ([STARTED], RIG, "", False, "cut short"),
        ([], RIG, "", False, "ended before the first sample"),
        ([STARTED, OVER], RIG, "node plant was killed", False, "node plant was killed"),
        ([], frozenset(), "", True, ""),
        ([], frozenset(), "stopped by SIGTERM", False, "stopped by SIGTERM"),
    ],
)
def test_verdict(heard: list[tuple[str, str]], rigs: frozenset[str], failure: str, complete: bool, reason: str) -> None:
    ending = Ending()
    for code, message in heard:
        ending.hear(code.startswith("!"), {"code": code.lstrip("!")}, message)
    assert ending.verdict(rigs, failure) == (complete, reason)


@pytest.mark.parametrize(
    "said, words",
    [
        (["[INFO] [1.0] [plant]: stepping", "error: the port is gone"], "exit code 1: error: the port is gone"),
        (
            ["Fatal Python error: Aborted", "Current thread 0x1:", "Extension modules: yaml._yaml, numpy"],
            "error: Aborted",
        ),
        (["[INFO] [1.0] [plant]: stepping"], "exit code 1"),
    ],
)
def test_the_end_of_a_node_is_told_by_its_last_words_not_by_a_dump(said: list[str], words: str) -> None:
    told = describe_end(NodeProcess("plant", "pneumo_ros.nodes.plant", said=said), 1)
    assert told.endswith(words) and told.startswith("node plant ended with exit code 1")
