# SPDX-License-Identifier: Apache-2.0
"""A pneumatic cylinder whose rod is drawn to and fro under pressure. Is its force pressure times area?"""

from pneumo_ros.own_rig import Force, Sensor

SLOTS = [
    Force("seal", travel=lambda x, u, p: u.position, rate=lambda x, u, p: u.speed),
    Sensor("force"),
]


def outputs(x, u, p, f):
    """The load cell in the rod, positive where it pushes; a seal's drag opposes the rod."""
    return (u.pressure * p.area - f.seal,)
