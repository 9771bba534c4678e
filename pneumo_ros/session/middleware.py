# SPDX-License-Identifier: Apache-2.0
"""What a session's processes are told about ROS's middleware, where the user has said nothing."""

from __future__ import annotations

from collections.abc import Mapping

from pneumo_ros.paths import share_file

DISCOVERY_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
FAST_DDS_PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"  # of Fast DDS 2; any other middleware leaves it unread
HERE = ("LOCALHOST", "OFF")  # ranges whose nodes need no network
ELSEWHERE = ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER")  # who sets one names other computers


def middleware_settings(environment: Mapping[str, str], discovery: str = "LOCALHOST") -> dict[str, str]:
    """Environment variables to add: a session stays on this computer, and its writers repair within 0.1 s.

    Parameters
    ----------
    environment : what the user has set; that stays
    discovery : how far nodes look for one another where the user has not said; only what stays here closes its
        sockets to the network
    """
    stays = environment.get(DISCOVERY_RANGE, discovery) in HERE and not any(map(environment.get, ELSEWHERE))
    profiles = "fastdds_loopback.xml" if stays else "fastdds.xml"
    settings = {DISCOVERY_RANGE: discovery, FAST_DDS_PROFILES: str(share_file("config", profiles))}
    return {name: value for name, value in settings.items() if name not in environment}
