# SPDX-License-Identifier: Apache-2.0
"""A quarter car on a shaker. What does its strut do beside spring and damper?"""

from pneumo_ros.own_rig import Force, Sensor

SLOTS = [
    Force("strut", travel=lambda x, u, p: x.body - x.wheel, rate=lambda x, u, p: x.body_speed - x.wheel_speed),
    Force("tyre", travel=lambda x, u, p: x.wheel - u.road, rate=lambda x, u, p: x.wheel_speed - u.road_speed),
    Sensor("body"),
    Sensor("wheel"),
]


def rhs(x, u, p, f):
    """Heights from rest, so that weights and static forces cancel."""
    strut = p.stiffness * (x.wheel - x.body) + p.damping * (x.wheel_speed - x.body_speed) + f.strut
    tyre = p.tyre * (u.road - x.wheel) + f.tyre
    return x.body_speed, x.wheel_speed, strut / p.body_mass, (tyre - strut) / p.wheel_mass


def outputs(x, u, p, f):
    """Both heights."""
    return x.body, x.wheel
