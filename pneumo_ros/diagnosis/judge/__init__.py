"""From what was fitted to a verdict: held-out runs, probabilities, ambiguity, ranking."""
