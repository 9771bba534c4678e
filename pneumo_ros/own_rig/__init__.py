# SPDX-License-Identifier: Apache-2.0
"""A rig of one's own: one Python file of physics, one YAML file of names, any log; diagnosed like every other.

from pneumo_ros.own_rig import Force, Sensor

SLOTS = [Force("seal", rate=lambda x, u, p: u.speed), Sensor("force")]

def rhs(x, u, p, f): ...      # derivatives of the states, a tuple
def outputs(x, u, p, f): ...  # the measured channels, a tuple
"""

from pneumo_ros.slots.kinds import Contact, Flow, Force, Input, Sensor

__all__ = ["Contact", "Flow", "Force", "Input", "Sensor"]
