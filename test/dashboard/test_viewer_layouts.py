# SPDX-License-Identifier: Apache-2.0
"""The layouts for other viewers are up to date and name what a session really records."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from helpers.folders import CONFIG
from helpers.rig_logs import signals_of, simulated

from pneumo_ros.dashboard.viewer_layouts import LAYOUTS, recorded_panels
from pneumo_ros.diagnosis.report import write_residual_log
from pneumo_ros.log import topics
from pneumo_ros.log.reading import read_log

FOLDER = CONFIG / "layouts"


@pytest.mark.parametrize("name", LAYOUTS)
def test_the_committed_file_is_what_the_table_makes(name: str) -> None:
    assert (FOLDER / name).read_text() == LAYOUTS[name]()


def leaves(node: object) -> list[str]:
    return [node] if isinstance(node, str) else [*leaves(node["first"]), *leaves(node["second"])]  # type: ignore[index]


def test_foxglove_paths_point_at_the_named_channel() -> None:
    layout = json.loads(LAYOUTS["foxglove.json"]())
    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])
    for panel, plot in zip(recorded_panels(), layout["configById"].values(), strict=True):
        for line, path in zip(panel.lines, plot["paths"], strict=True):
            topic = topics.BY_NAME[line.source]
            found = re.fullmatch(r"(/[\w/]+)\.(\w+)(?:\[(\d+)\])?", path["value"])
            assert found is not None and found[1] == topic.name and topic.recorded
            assert (topic.names[int(found[3])] if found[3] else found[2]) == line.channel


def test_the_3d_layout_shows_the_description_and_its_joints() -> None:
    layout = json.loads(LAYOUTS["foxglove_3d.json"]())
    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])
    shown = layout["configById"]["3D!pneumo"]
    assert shown["topics"] == {topics.ROBOT_DESCRIPTION.name: {"visible": True}} and shown["followTf"] == "ground"
    paths = [path["value"] for path in layout["configById"]["Plot!pneumo"]["paths"]]
    assert paths == [f"/joint_states.position[{i}]" for i in range(4)]


def test_layouts_of_the_residual_name_what_a_diagnosis_writes(tmp_path: Path) -> None:
    clean, road, commands = simulated(4.0, 1)
    held = signals_of(clean, road, commands, 1, "held.mcap")
    write_residual_log(tmp_path / "residual.mcap", held, dict.fromkeys(("nominal", "refit", "best"), clean))
    log = read_log(tmp_path / "residual.mcap")
    layout = json.loads(LAYOUTS["foxglove_residual.json"]())
    paths = [path["value"] for plot in layout["configById"].values() for path in plot["paths"]]
    assert len(paths) == len(set(paths)) == 6 * 4 + 6
    assert {path.split(".")[0] for path in paths} <= set(log.topics)
    curves = [
        c.get("name", "") for c in ElementTree.fromstring(LAYOUTS["plotjuggler_residual.xml"]().encode()).iter("curve")
    ]
    assert len(curves) == len(paths)
    assert all(any(curve.startswith(f"{topic}/") for topic in log.topics) for curve in curves)


def test_plotjuggler_curves_name_recorded_channels() -> None:
    root = ElementTree.fromstring(LAYOUTS["plotjuggler.xml"]().encode())
    curves = [curve.get("name", "") for curve in root.iter("curve")]
    assert len(curves) == sum(len(panel.lines) for panel in recorded_panels()) > 20
    known = {
        f"{topic.name}/{name}" + ("/position" if topic.type == topics.JOINT else "")
        for topic in topics.TOPICS
        for name in topic.names
    }
    assert set(curves) <= known
    for splitter in root.iter("DockSplitter"):
        assert int(splitter.get("count", "0")) == len(splitter) == len(splitter.get("sizes", "").split(";"))
