# SPDX-License-Identifier: Apache-2.0
"""A writer notices stamps that repeat, go back or leave a gap, and names the topic."""

from __future__ import annotations

from pathlib import Path

import pytest

from pneumo_ros.log.cdr import JointEncoder
from pneumo_ros.log.topics import COMMAND
from pneumo_ros.log.writing import LogWriter

START = 10**18


@pytest.mark.parametrize(
    ("step", "stamps", "word"),
    [
        (0, [0, 2, 4, 11], ""),
        (2, [0, 2, 4, 6], ""),
        (0, [0, 2, 2], "repeats"),
        (0, [0, 4, 2], "goes back"),
        (2, [0, 2, 2], "repeats"),
        (2, [0, 2, 0], "goes back"),
        (2, [0, 2, 6], "leaves a gap"),
        (None, [0, 2, 0], ""),
    ],
)
def test_disorder(tmp_path: Path, step: int | None, stamps: list[int], word: str) -> None:
    writer = LogWriter(tmp_path / "x.mcap")
    channel = writer.add_topic(COMMAND.name, COMMAND.type, step_ns=step)
    encode = JointEncoder(COMMAND.frame_id, COMMAND.names).encode
    for stamp in stamps:
        writer.write(channel, encode(START + stamp, [0.0] * 4))
    back = word in ("repeats", "goes back")
    assert writer.finish().counts[COMMAND.name] == len(stamps) - back, "what goes back is somebody else's"
    assert word in writer.disorder and bool(word) == bool(writer.disorder)
    assert not word or COMMAND.name in writer.disorder
