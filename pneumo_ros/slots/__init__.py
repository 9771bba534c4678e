# SPDX-License-Identifier: Apache-2.0
"""Where something could be missing in a model, by kind, and what could be missing there: laws, shapes, anything.

Pure numerics: no rig, no file. A family (friction, leak, lag ...) is written once for a kind of slot, in the slot's own
coordinates and in multiples of the scales that the data show, so that it attaches to any rig that has such a slot.
"""

from pneumo_ros.slots.kinds import Contact, Flow, Force, Input, Sensor, Slot

__all__ = ["Contact", "Flow", "Force", "Input", "Sensor", "Slot"]
