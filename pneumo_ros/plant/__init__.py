# SPDX-License-Identifier: Apache-2.0
"""The rig's physics: gas flow, air spring, half car, trim and sensors. Knows nothing of ROS, files or ports."""
