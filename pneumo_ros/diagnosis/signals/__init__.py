# SPDX-License-Identifier: Apache-2.0
"""Any rig's log: noise, time base, and what is missing or doubtful."""
