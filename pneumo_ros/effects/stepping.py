# SPDX-License-Identifier: Apache-2.0
"""Any rig to step: what a session, the emulator and the replayed loop start from."""

from __future__ import annotations

from pneumo_ros.plant.stepping import SteppedRig, plain_rig
from pneumo_ros.rig import Rig


def stepped_rig(rig: Rig, period: float) -> SteppedRig:
    """The nominal equations, or the corrected rig where the rig's configuration holds what a diagnosis found.

    Raises
    ------
    InputError
        if its effects are not those of the library.
    """
    if not rig.diagnosed:
        return plain_rig(rig, period)
    # The library of effects and its kernel are loaded only by those who need them: it costs the others nothing.
    from pneumo_ros.effects.corrected_rig import diagnosed_rig

    return diagnosed_rig(rig, period)
