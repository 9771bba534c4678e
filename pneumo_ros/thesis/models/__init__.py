# SPDX-License-Identifier: Apache-2.0
"""Models that only the thesis's chapters need: quarter cars, similar systems, a moving base, a conventional car."""
