# SPDX-License-Identifier: Apache-2.0
"""What excites the rig: road profiles and valve openings over time."""

from pneumo_ros.road.profiles import (
    ISO_MEAN,
    LENGTH_SCALE,
    PARAMETERS,
    Road,
    RoadSpec,
    build_road,
    iso_components,
    iso_psd,
    make_road,
)

__all__ = [
    "ISO_MEAN",
    "LENGTH_SCALE",
    "PARAMETERS",
    "Road",
    "RoadSpec",
    "build_road",
    "iso_components",
    "iso_psd",
    "make_road",
]
