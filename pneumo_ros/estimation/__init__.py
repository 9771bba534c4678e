# SPDX-License-Identifier: Apache-2.0
"""What cannot be measured: derivatives of displacements and effective areas. Pure steps, explicit state."""
