"""The maker of sealed cases: a richer rig than any model here, logs with a hidden effect, the scoring of verdicts."""
