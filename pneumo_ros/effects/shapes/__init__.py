# SPDX-License-Identifier: Apache-2.0
"""Shapes of the families: sums of simple atoms that any law of a kind lies in, run and fitted like an effect."""
