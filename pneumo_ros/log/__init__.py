# SPDX-License-Identifier: Apache-2.0
"""Session logs: MCAP and bags read, checked, repaired, converted, compared and written; knows no ROS graph."""
