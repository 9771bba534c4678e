# SPDX-License-Identifier: Apache-2.0
"""The same road with the valves at trim, on the rig of the log with whatever a diagnosis found in it."""

from __future__ import annotations

from pneumo_ros.effects.stepping import stepped_rig
from pneumo_ros.rig import Rig
from pneumo_ros.session.passive import passive_session, road_period
from pneumo_ros.session.summary import Recorded


def passive_run(session: Recorded, rig: Rig | None = None) -> Recorded | None:
    """None where the log lacks motion or road; ``rig`` stands for the log's, with files of effects it may name."""
    if max(len(session.truth), len(session.measured)) < 2 or len(session.road) < 2:
        return None
    rig = rig or session.rig
    return passive_session(session, stepped_rig(rig, road_period(session)) if rig.diagnosed else None)
