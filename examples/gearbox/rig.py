# SPDX-License-Identifier: Apache-2.0
"""A DC motor that turns a flywheel through a gearbox. Is there anything between them but an elastic shaft?"""

from pneumo_ros.own_rig import Contact, Force, Input, Sensor

SLOTS = [
    Contact("teeth", travel=lambda x, u, p: x.motor / p.ratio - x.load, unit="N m", travel_unit="rad",
            rate=lambda x, u, p: x.motor_speed / p.ratio - x.load_speed),
    Force("bearing", travel=lambda x, u, p: x.load, rate=lambda x, u, p: x.load_speed, unit="N m", travel_unit="rad"),
    Input("voltage"),
    Sensor("load"),
]  # fmt: skip


def rhs(x, u, p, f):
    """Motor (inductance left out) and flywheel, a shaft between them."""
    twist, rate = x.motor / p.ratio - x.load, x.motor_speed / p.ratio - x.load_speed
    shaft = p.stiffness * twist + p.shaft_damping * rate - f.teeth
    drive = p.torque * (u.voltage - p.torque * x.motor_speed) / p.resistance
    motor = (drive - shaft / p.ratio) / p.motor_inertia
    return x.motor_speed, x.load_speed, motor, (shaft - p.drag * x.load_speed + f.bearing) / p.load_inertia


def outputs(x, u, p, f):
    """Both encoders."""
    return x.motor, x.load
