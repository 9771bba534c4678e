"""The maker of sealed cases: a richer rig than any model here, its logs with a hidden effect, and the scoring of verdicts."""
