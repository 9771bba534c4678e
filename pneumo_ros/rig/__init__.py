# SPDX-License-Identifier: Apache-2.0
"""The rig: its parameters with tolerances, read from YAML, and the names of its channels and state columns."""

from pneumo_ros.rig.limits import END_LIMITS, LIMITS, Limit
from pneumo_ros.rig.parameters import NamedEffect, Quantity, Rig
from pneumo_ros.rig.reading import load_rig, parse_rig

__all__ = ["END_LIMITS", "LIMITS", "Limit", "NamedEffect", "Quantity", "Rig", "load_rig", "parse_rig"]
