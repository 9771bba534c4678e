# SPDX-License-Identifier: Apache-2.0
"""How a ride is judged: comfort by ISO 2631 and what the rig's own limits say."""
