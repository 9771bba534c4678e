# SPDX-License-Identifier: Apache-2.0
"""Words of the command line that must name something, checked before anything heavy is imported."""

from __future__ import annotations

from pneumo_ros.errors import not_one_of

DEFAULT_CONTROLLER = "smflc"
ALIASES = {DEFAULT_CONTROLLER: "default"}  # what the command line calls a preset
ROAD_CLASSES = "ABCDEFGH"


def check_road(road: str) -> None:
    """Refuse a road that is no class, no shape and no file's name.

    Raises
    ------
    InputError
        with all of them, and the nearest.
    """
    from pneumo_ros.road.profiles import KINDS

    shapes = [kind for kind in KINDS if kind not in ("iso", "file")]
    if road.upper() not in list(ROAD_CLASSES) and road not in shapes and not road.lower().endswith(".csv"):
        raise not_one_of("no such road", road, [*ROAD_CLASSES, *shapes], where="--road", also="a file (.csv)")


def check_controller(name: str) -> None:
    """Refuse a controller that is neither a preset nor one of the family.

    Raises
    ------
    InputError
        with all of them, and the nearest.
    """
    from pneumo_ros.control.half_car import CONTROLLERS, PROFILE
    from pneumo_ros.control.presets import PRESETS

    presets = [preset for preset in PRESETS if preset not in ALIASES.values()]
    known = dict.fromkeys((*ALIASES, *presets, *CONTROLLERS, PROFILE))
    if name not in known and name not in PRESETS:
        raise not_one_of("no such controller", name, known, where="--controller")
