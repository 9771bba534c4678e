"""The rig's parameters: typed, in SI, each with the tolerance its maker states, read from YAML."""

from pneumo_ros.rig.parameters import END_LIMITS, LIMITS, Limit, NamedEffect, Quantity, Rig, load_rig, parse_rig

__all__ = ["END_LIMITS", "LIMITS", "Limit", "NamedEffect", "Quantity", "Rig", "load_rig", "parse_rig"]
