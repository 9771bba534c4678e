# SPDX-License-Identifier: Apache-2.0
"""The sim-to-real gap from a log: where it lies, which unmodelled effect makes it, how far it shrinks."""
