# SPDX-License-Identifier: Apache-2.0
"""The maker of sealed cases: a richer rig than any model here, logs with a hidden effect, the scoring of verdicts."""
