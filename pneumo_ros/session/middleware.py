# SPDX-License-Identifier: Apache-2.0
"""What a session's processes are told about ROS's middleware, where the user has said nothing."""

from __future__ import annotations

from collections.abc import Mapping

from pneumo_ros.paths import share_file

DISCOVERY_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
FAST_DDS_PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"  # of Fast DDS 2; any other middleware leaves it unread


def middleware_settings(environment: Mapping[str, str]) -> dict[str, str]:
    """Environment variables to add: a session stays on this computer, and its writers repair within 0.1 s.

    Parameters
    ----------
    environment : what the user has set; that stays
    """
    settings = {DISCOVERY_RANGE: "LOCALHOST", FAST_DDS_PROFILES: str(share_file("config", "fastdds.xml"))}
    return {name: value for name, value in settings.items() if name not in environment}
