# SPDX-License-Identifier: Apache-2.0
"""Controllers: feedback linearisation, model reference and the sliding mode family. Pure steps, explicit state."""
