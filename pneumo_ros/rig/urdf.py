# SPDX-License-Identifier: Apache-2.0
"""The half car as a URDF: masses, arms and inertia of a rig, four joints named as the channels of the logs.

The heights of a joint are those of the model, from the ground datum where the unloaded tyres just touch. What the model
does not know (sizes of beam and wheels, inertia about the other axes) is for the eye only and marked so below.
"""

from __future__ import annotations

from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from pneumo_ros.rig.joints import JOINTS, LINK_OF, MOUNTS, frames
from pneumo_ros.rig.parameters import Rig

TRAVEL = 0.2  # m either way; LVDTs and bump stops are reached long before
TILT = 0.5  # rad either way
BEAM = (0.06, 0.04)  # m, width and thickness of the drawn body; for the eye
WHEEL = (0.04, 0.03)  # m, radius and width of the drawn wheels; for the eye
COLOURS = {"body": "0.35 0.35 0.4 1", "front_axle": "0.12 0.47 0.71 1", "rear_axle": "0.84 0.15 0.16 1"}


def urdf(rig: Rig) -> str:
    """The description that /robot_description carries."""
    root = Element("robot", name=rig.name)
    SubElement(root, "link", name="ground")
    SubElement(root, "link", name=LINK_OF["heave"])
    length = rig.wheelbase
    middle = (rig.front_arm.value - rig.rear_arm.value) / 2
    _link(root, "body", rig.sprung_mass.value, rig.pitch_inertia.value, "box", (length, *BEAM), (middle, 0.0, 0.0))
    for end, mass in (("front", rig.unsprung_mass_front.value), ("rear", rig.unsprung_mass_rear.value)):
        # A solid wheel's inertia; the model's axles do not turn.
        _link(root, f"{end}_axle", mass, mass * WHEEL[0] ** 2 / 2, "cylinder", WHEEL, (0.0, 0.0, 0.0))
    for name in MOUNTS:
        SubElement(root, "link", name=name)
    for frame in frames(np.zeros(len(JOINTS)), rig):
        _joint(root, frame.parent, frame.child, frame.position)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _link(
    root: Element, name: str, mass: float, inertia: float, shape: str, size: tuple[float, ...],
    centre: tuple[float, float, float],
) -> None:  # fmt: skip
    """A link with its centre of mass at its origin; what is drawn is centred at ``centre``."""
    link = SubElement(root, "link", name=name)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "mass", value=f"{mass:.9g}")
    # Only iyy acts in this plane; ixx and izz are set to it because a URDF must have them.
    about = f"{inertia:.9g}"
    SubElement(inertial, "inertia", ixx=about, ixy="0", ixz="0", iyy=about, iyz="0", izz=about)
    visual = SubElement(link, "visual")
    turned = f"{np.pi / 2:.9g} 0 0" if shape == "cylinder" else "0 0 0"
    SubElement(visual, "origin", xyz=_words(centre), rpy=turned)
    geometry = SubElement(visual, "geometry")
    if shape == "box":
        SubElement(geometry, "box", size=_words(size))
    else:
        SubElement(geometry, "cylinder", radius=f"{size[0]:.9g}", length=f"{size[1]:.9g}")
    SubElement(SubElement(visual, "material", name=name), "color", rgba=COLOURS[name])


def _joint(root: Element, parent: str, child: str, place: tuple[float, float, float]) -> None:
    """A joint of :data:`JOINTS` for the links they move, a fixed one for the others."""
    name = next((joint for joint, link in LINK_OF.items() if link == child), f"{child}_mount")
    kind = "fixed" if child in MOUNTS else "revolute" if name == "pitch_nose_up" else "prismatic"
    joint = SubElement(root, "joint", name=name, type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    SubElement(joint, "origin", xyz=_words(place), rpy="0 0 0")
    if kind == "fixed":
        return
    SubElement(joint, "axis", xyz="0 -1 0" if kind == "revolute" else "0 0 1")
    reach = TILT if kind == "revolute" else TRAVEL
    # Nothing drives these joints directly: the air springs do. Effort and velocity are what a URDF must state.
    SubElement(joint, "limit", lower=f"{-reach:g}", upper=f"{reach:g}", effort="1e4", velocity="10")


def _words(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
