# SPDX-License-Identifier: Apache-2.0
"""From what was fitted to a verdict: held-out runs, probabilities, ambiguity, ranking."""
