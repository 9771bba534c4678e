# SPDX-License-Identifier: Apache-2.0
"""What a simulation takes from a log of the half car, and changes of it: half the rate, commands earlier or later."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol, TypeVar, cast

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.rig import Rig

JUMP = 12.0  # medians of the command's change from row to row
SPARSE = 0.1  # more jumps than this share of rows are a signal, not events


class Drive(Protocol):
    """What a simulation takes from a log of the half car, N rows on one time base.

    ``commands`` (N, 4) m2, row i held from row i to row i + 1; ``road`` (N, 2) m, linear between rows; ``initial``
    (10,) with its standard deviation.
    """

    @property
    def rig(self) -> Rig: ...
    @property
    def period(self) -> float: ...
    @property
    def measured(self) -> Array: ...
    @property
    def weight(self) -> Array: ...
    @property
    def commands(self) -> Array: ...
    @property
    def road(self) -> Array: ...
    @property
    def initial(self) -> Array: ...
    @property
    def initial_std(self) -> Array: ...


Log = TypeVar("Log", bound=Drive)


def shifted(commands: Array, samples: float) -> Array:
    """Held commands a part of a sample later (positive) or earlier, as means over the rows."""
    share = min(abs(samples), 1.0)
    moved = np.empty_like(commands)
    if samples >= 0.0:
        moved[1:], moved[0] = commands[:-1], commands[0]
    else:
        moved[:-1], moved[-1] = commands[1:], commands[-1]
    return (1.0 - share) * commands + share * moved


def _replaced(record: Log, **changes: object) -> Log:
    """A copy of a frozen record with other values."""
    return cast(Log, replace(cast(Any, record), **changes))


def coarsened(record: Log) -> Log:
    """Every other row, commands averaged in pairs."""
    rows = len(record.measured) // 2 * 2
    return _replaced(
        record,
        period=2.0 * record.period,
        measured=record.measured[:rows:2],
        weight=record.weight[:rows:2],
        commands=record.commands[:rows].reshape(-1, 2, 4).mean(axis=1),
        road=record.road[:rows:2],
    )


def command_jumps(record: Drive) -> list[tuple[int, int]]:
    """Jumps of the inlet commands (row, column); none where the command moves all the time."""
    found = []
    for column in (0, 1):
        steps = np.abs(np.diff(record.commands[:, column]))
        limit = max(JUMP * float(np.median(steps)), 0.02 * float(np.ptp(record.commands[:, column])), 1e-12)
        rows = np.flatnonzero(steps > limit) + 1
        if len(rows) < SPARSE * len(steps):
            found += [(int(row), column) for row in rows]
    return found


def with_earlier_jumps(record: Log, events: list[tuple[int, int]], lead: Array) -> Log:
    """The record with jumps ``lead`` samples earlier: the row before takes that share of the jump."""
    commands = record.commands.copy()
    for (row, column), share in zip(events, lead, strict=True):
        commands[row - 1, column] += share * (record.commands[row, column] - record.commands[row - 1, column])
    return _replaced(record, commands=commands)


def with_push(record: Log, column: int, rows: slice, amount: float) -> Log:
    """The record with one command raised by ``amount``, m2, over some rows."""
    commands = record.commands.copy()
    commands[rows, column] += amount
    return _replaced(record, commands=commands)
