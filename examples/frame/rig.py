# SPDX-License-Identifier: Apache-2.0
"""A frame of one storey on a shaken base. Does anything rub, and against what?"""

from pneumo_ros.own_rig import Force, Sensor

SLOTS = [
    Force("floor_to_ground", travel=lambda x, u, p: x.floor, rate=lambda x, u, p: x.speed),
    Force("floor_to_base", travel=lambda x, u, p: x.floor - u.base, rate=lambda x, u, p: x.speed - u.base_speed),
    Sensor("floor"),
]


def rhs(x, u, p, f):
    """m x'' = -c (x' - y') - k (x - y), x the floor and y the base, both from the ground."""
    spring = p.stiffness * (x.floor - u.base) + p.damping * (x.speed - u.base_speed)
    return x.speed, (f.floor_to_ground + f.floor_to_base - spring) / p.mass


def outputs(x, u, p, f):
    """The laser sees the floor."""
    return (x.floor,)
