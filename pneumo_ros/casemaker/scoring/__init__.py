# SPDX-License-Identifier: Apache-2.0
"""Scores of a diagnosis on sealed cases: reads labels and diagnosis.json, nothing else."""
