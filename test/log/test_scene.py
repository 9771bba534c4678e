# SPDX-License-Identifier: Apache-2.0
"""`pneumo log scene`: joint states, transforms and URDF made from a log."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers.small_logs import contract_log, joint, text, write
from mcap_ros2.reader import read_ros2_messages
from typer.testing import CliRunner

from pneumo_ros.cli.main import app
from pneumo_ros.errors import InputError
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.scene import write_scene
from pneumo_ros.rig import load_rig
from pneumo_ros.rig.joints import JOINTS, joint_positions


def test_a_scene_shows_what_the_log_holds(tmp_path: Path) -> None:
    source = write(tmp_path / "a.mcap", contract_log(200))
    said = CliRunner().invoke(app, ["log", "scene", str(source), "--output", str(tmp_path / "scene.mcap")])
    assert said.exit_code == 0 and "40 instants" in said.output  # 200 samples at 500 Hz, shown at 100 Hz
    found: dict[str, list[object]] = {}
    for message in read_ros2_messages(str(tmp_path / "scene.mcap")):
        found.setdefault(message.channel.topic, []).append(message.ros_msg)
    assert {topic: len(messages) for topic, messages in found.items()} == {
        "/robot_description": 1, "/tf": 40, "/joint_states": 40,
    }  # fmt: skip
    assert ElementTree.fromstring(found["/robot_description"][0].data).tag == "robot"  # type: ignore[attr-defined]
    log = read_log(source)
    wanted = joint_positions(log.joint("/rig/displacement").position[::5], log.config or load_rig())
    states = found["/joint_states"]
    assert tuple(states[0].name) == JOINTS  # type: ignore[attr-defined]
    np.testing.assert_allclose([list(state.position) for state in states], wanted, atol=1e-12)  # type: ignore[attr-defined]
    for transform, position in zip(found["/tf"], wanted, strict=True):
        by_child = {one.child_frame_id: one.transform for one in transform.transforms}  # type: ignore[attr-defined]
        assert by_child["centre_of_mass"].translation.z == pytest.approx(position[0])
        assert by_child["body"].rotation.y == pytest.approx(-np.sin(position[1] / 2))
        assert by_child["front_axle"].translation.z == pytest.approx(position[2])


def test_a_log_without_displacements_is_refused(tmp_path: Path) -> None:
    source = write(tmp_path / "a.mcap", [("/note", "std_msgs/msg/String", 1, text("x"))])
    with pytest.raises(InputError, match="/rig/displacement"):
        write_scene(read_log(source), tmp_path / "scene.mcap")
    two = ("sprung_front", "sprung_rear")
    message = ("/rig/displacement", "sensor_msgs/msg/JointState", 1, joint(1, (0.1, 0.1), two))
    with pytest.raises(InputError, match="displacements are missing"):
        write_scene(read_log(write(tmp_path / "b.mcap", [message])), tmp_path / "scene.mcap")
    assert not list(tmp_path.glob("scene.mcap*"))
