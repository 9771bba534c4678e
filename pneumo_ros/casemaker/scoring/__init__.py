"""Scores of a diagnosis on sealed cases: reads labels and diagnosis.json, nothing else."""
