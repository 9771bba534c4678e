# SPDX-License-Identifier: Apache-2.0
"""Unmodelled effects as laws: their contract, the library, the compiled kernel that holds them, rigs that have them."""
