# SPDX-License-Identifier: Apache-2.0
"""The rig in a browser: a recorded session played back, or a running one with gains and an emergency stop."""
