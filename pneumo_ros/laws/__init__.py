# SPDX-License-Identifier: Apache-2.0
"""What a mechanism does, once for all rigs: friction, hysteresis, stops, what rings, lags, leaks, errors of a signal.

Kernels of plain numbers, each in the coordinates that its law needs and in no rig's units; resistances are positive
where the rate is. The half car's effects (:mod:`pneumo_ros.effects`) and the families at slots of one's own rig
(:mod:`pneumo_ros.slots`) are made of them; which share which, and where the two differ and why, stands in
:mod:`pneumo_ros.slots.half_car` and on docs/families.md.

The kernels are inlined where they are called. Numba looks for changes in the caller's file alone, so whoever names what
is compiled by the content of files counts :func:`sources` among them.
"""

from __future__ import annotations

from pathlib import Path


def sources() -> list[str]:
    """Files of all laws, sorted."""
    return sorted(str(file) for file in Path(__file__).parent.glob("*.py"))
