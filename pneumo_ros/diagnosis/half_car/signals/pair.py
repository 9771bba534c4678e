# SPDX-License-Identifier: Apache-2.0
"""Do logs belong together: one rig, different sessions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from pneumo_ros.diagnosis.half_car.signals.types import Signals
from pneumo_ros.errors import InputError
from pneumo_ros.rig import LIMITS, Rig

# Relative difference of two configs that is none: one written with six digits still names the same rig [definition]
SAME: Final = 1e-5
# Sensors may be changed between sessions without the rig being another one [definition]
NOT_THE_RIG: Final = ("displacement_noise", "pressure_noise")


def check_pair(fit: Sequence[Signals], holdout: Signals | None = None) -> None:
    """Refuse logs of different rigs, a log given twice, and a holdout that is one of the fit logs.

    Raises
    ------
    InputError
        naming the two logs and the parameter that differs.
    """
    logs = [*fit, *([holdout] if holdout is not None else [])]
    for other in logs[1:]:
        different = _difference(logs[0].rig, other.rig)
        if different:
            rigs = [log.rig for log in (logs[0], other)]
            beyond = different == "effects"
            values = [r.findings if beyond else getattr(r, different).value for r in rigs]
            raise InputError(
                f"{logs[0].name} and {other.name} are of two rigs", key=different, value=values,
                remedy="diagnose each rig from its own logs, or give --rig if the configs are known to be wrong",
            )  # fmt: skip
    for k, log in enumerate(fit):
        same = next((other for other in fit[:k] if _same_data(other, log)), None)
        if same is not None:
            raise InputError(
                "the same log is given twice", where=f"{same.name}, {log.name}",
                remedy="give each session once: a second copy makes every interval too narrow",
            )  # fmt: skip
    if holdout is not None and any(_same_data(log, holdout) for log in fit):
        raise InputError(
            "the holdout is one of the logs to fit", where=holdout.name,
            remedy="hold out another session, or leave --holdout away to split by time",
        )  # fmt: skip


def _difference(one: Rig, two: Rig) -> str | None:
    for name in LIMITS:
        a, b = getattr(one, name).value, getattr(two, name).value
        if name not in NOT_THE_RIG and abs(a - b) > SAME * max(abs(a), abs(b)):
            return name
    return "effects" if (one.ends, one.effects) != (two.ends, two.effects) else None


def _same_data(one: Signals, two: Signals) -> bool:
    rows = min(len(one.measured), len(two.measured), 500)
    return bool(np.array_equal(one.measured[:rows], two.measured[:rows]))
