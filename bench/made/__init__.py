# SPDX-License-Identifier: Apache-2.0
"""Rigs of other makers: a model of each as its user would write it, and its logs by another program."""
