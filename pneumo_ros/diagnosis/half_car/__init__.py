# SPDX-License-Identifier: Apache-2.0
"""The half car's adapter to the diagnosis: its logs, its saved rig, its next experiment, its closed loop."""
