# SPDX-License-Identifier: Apache-2.0
"""The thesis's tables, figures and claims, recomputed: one module a chapter on top of plant, estimation and control."""
