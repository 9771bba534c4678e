# SPDX-License-Identifier: Apache-2.0
"""Active pneumatic half-car rig: simulate, drive, log, replay, and diagnose the sim-to-real gap."""

from importlib.metadata import PackageNotFoundError, version

# As it was installed: setup.py and package.xml carry the number, and ROS's release tool writes both in one step.
try:
    __version__ = version("pneumo_ros")
except PackageNotFoundError:  # run from a copy of the sources that was never installed
    __version__ = "unknown"
