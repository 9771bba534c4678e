# SPDX-License-Identifier: Apache-2.0
"""The rig behind a pseudo-terminal: firmware rules, converters, faults and the simulated plant; no hardware needed."""
