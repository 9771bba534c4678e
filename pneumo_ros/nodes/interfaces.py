# SPDX-License-Identifier: Apache-2.0
"""Message classes by interface name; the PyPI wheels have no rosidl_runtime_py that would do it."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def message_class(type_name: str) -> Any:
    """The Python class of an interface, for example ``sensor_msgs/msg/JointState``."""
    package, kind, name = type_name.split("/")
    return getattr(import_module(f"{package}.{kind}"), name)
