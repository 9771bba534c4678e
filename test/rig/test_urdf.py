# SPDX-License-Identifier: Apache-2.0
"""The URDF agrees with the rig: it parses, its masses and arms are the rig's, and joints turn the right way."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest
from helpers.folders import ROOT

from pneumo_ros.log import topics
from pneumo_ros.rig import load_rig
from pneumo_ros.rig.joints import JOINTS, MOUNTS, frames, joint_positions
from pneumo_ros.rig.urdf import urdf

RIG = load_rig()


@pytest.fixture(scope="module")
def robot() -> ElementTree.Element:
    return ElementTree.fromstring(urdf(RIG).encode())


def test_the_committed_file_is_the_nominal_rig_s() -> None:
    assert (ROOT / "urdf" / "half_car.urdf").read_text(encoding="utf-8") == urdf(RIG), "run `make docs`"


def test_masses_inertia_and_arms_are_the_rig_s(robot: ElementTree.Element) -> None:
    masses = {link.get("name"): float(link.find("inertial/mass").get("value"))  # type: ignore[union-attr, arg-type]
              for link in robot.iter("link") if link.find("inertial") is not None}  # fmt: skip
    assert masses == {
        "body": RIG.sprung_mass.value,
        "front_axle": RIG.unsprung_mass_front.value,
        "rear_axle": RIG.unsprung_mass_rear.value,
    }
    inertia = robot.find("link[@name='body']/inertial/inertia")
    assert inertia is not None and float(inertia.get("iyy", "")) == RIG.pitch_inertia.value
    for side, arm in (("front", RIG.front_arm.value), ("rear", -RIG.rear_arm.value)):
        for joint in (f"unsprung_{side}", f"{side}_air_spring_mount"):
            origin = robot.find(f"joint[@name='{joint}']/origin")
            assert origin is not None and float(origin.get("xyz", "").split()[0]) == arm


def test_it_is_one_tree_from_the_ground(robot: ElementTree.Element) -> None:
    links = {link.get("name") for link in robot.iter("link")}
    parents = {j.find("child").get("link"): j.find("parent").get("link") for j in robot.iter("joint")}  # type: ignore[union-attr]
    assert set(parents) == links - {"ground"} and set(parents.values()) <= links
    for link in links - {"ground"}:
        way = [link]
        while way[-1] != "ground":
            assert len(way) <= len(links)
            way.append(parents[way[-1]])


def test_moving_joints_are_those_of_joint_states(robot: ElementTree.Element) -> None:
    kinds = {joint.get("name"): joint.get("type") for joint in robot.iter("joint")}
    moving = {name: kind for name, kind in kinds.items() if kind != "fixed"}
    assert tuple(moving) == JOINTS == topics.JOINT_STATES.names
    assert sorted(moving.values()) == ["prismatic", "prismatic", "prismatic", "revolute"]


def test_frames_of_stamped_topics_are_in_the_tree(robot: ElementTree.Element) -> None:
    links = {link.get("name") for link in robot.iter("link")}
    assert set(MOUNTS) | {"ground"} <= links
    stamped = {topic.frame_id for topic in topics.TOPICS if topic.frame_id}
    assert stamped - links == {"converter", "supply"}  # electronics and the compressor are nowhere on the car


def place(link: str, positions: np.ndarray) -> np.ndarray:
    """(x, z) of a link's origin in the ground frame, by the transforms that /tf would carry."""
    tree = {frame.child: frame for frame in frames(positions, RIG)}
    point, at = np.zeros(3), link
    while at != "ground":
        frame = tree[at]
        x, y, z, w = frame.quaternion
        q, v = np.array([x, y, z]), point
        point = np.array(frame.position) + v + 2 * w * np.cross(q, v) + 2 * np.cross(q, np.cross(q, v))
        at = frame.parent
    return point[[0, 2]]


def test_sprung_points_are_where_the_displacements_say() -> None:
    """From LVDT readings to joints to transforms: mounts and axles are back at the readings, nose up included."""
    measured = np.array([0.055, 0.041, -0.012, -0.016])
    positions = joint_positions(measured, RIG)
    assert positions[1] > 0  # the front is higher: nose up
    for link, x, height in (
        ("front_air_spring", RIG.front_arm.value, measured[0]),
        ("rear_air_spring", -RIG.rear_arm.value, measured[1]),
        ("front_axle", RIG.front_arm.value, measured[2]),
        ("rear_axle", -RIG.rear_arm.value, measured[3]),
    ):
        np.testing.assert_allclose(place(link, positions), (x, height), atol=2e-4)  # small angles: 1 - cos(0.03)


def test_joints_of_many_samples_at_once() -> None:
    rows = np.random.default_rng(1).normal(0.0, 0.02, (5, 4))
    together = joint_positions(rows, RIG)
    np.testing.assert_allclose(together, [joint_positions(row, RIG) for row in rows])
