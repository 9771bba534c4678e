# SPDX-License-Identifier: Apache-2.0
"""The rig's data acquisition: serial protocol, calibration, device clock, safety, driver core and emulator; no ROS."""
