# SPDX-License-Identifier: Apache-2.0
"""A chamber of compressed air, shut after filling. Does it leak?"""

from pneumo_ros.own_rig import Flow, Sensor

SLOTS = [
    Flow("wall", up=lambda x, u, p: x.pressure, down=lambda x, u, p: p.ambient, unit="Pa/s"),
    Sensor("pressure"),
]


def rhs(x, u, p, f):
    """p' = -seepage (p - ambient): what a tight chamber is allowed to lose."""
    return (-p.seepage * (x.pressure - p.ambient) - f.wall,)


def outputs(x, u, p, f):
    """The transducer."""
    return (x.pressure,)
