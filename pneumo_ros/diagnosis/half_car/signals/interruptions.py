# SPDX-License-Identifier: Apache-2.0
"""Where a driver of hardware did not pass the commands on: openings as applied, or else stretches to leave out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.signals.types import Limitation

DRIVER: Final = "daq"  # the node whose events tell of the valves [definition]
ARMED: Final = "armed"  # event by which the driver takes commands [definition]
DISARMED: Final = ("disarmed", "estop")  # events after which it does not [definition]
REFUSED: Final = ("command_stale", "command_invalid")  # events of a command that was not obeyed [definition]
ERROR: Final = 2  # level of an event from which the driver makes the valves safe [definition]
SETTLING: Final = 0.5  # s after arming: no command yet, or a ramp to it [taste]
DIFFERS: Final = 0.01  # share of the largest opening from which applied and commanded differ [taste]
# Share of rows in which they must differ to be told; less is a sample's age at the ends of a ramp [taste]
TELLING: Final = 0.005


class LoggedEvent(NamedTuple):
    """An entry of /rig/events: s from the log's origin, level, node and reason code."""

    time: float
    level: int
    source: str
    code: str


def stretches_unknown(events: Sequence[LoggedEvent], end: float) -> list[tuple[float, float]]:
    """(begin, end), s, of the stretches in which the valves did not follow the command: from a trip to the next arming.

    Only for logs that do not carry the openings themselves. Refusals in a row end in a trip; single ones are rare, and
    are told by :func:`refusals`.
    """
    found, safe_since = [], None
    for event in sorted((e for e in events if e.source == DRIVER), key=lambda e: e.time):
        if event.code == ARMED:
            found.append((event.time if safe_since is None else safe_since, event.time + SETTLING))
            safe_since = None
        elif safe_since is None and (event.level >= ERROR or event.code in DISARMED):
            safe_since = event.time
    return found if safe_since is None else [*found, (safe_since, end)]


def refusals(events: Sequence[LoggedEvent]) -> int:
    """Complaints of the driver about commands that it did not pass on, one a second at most."""
    return sum(event.source == DRIVER and event.code in REFUSED for event in events)


def as_applied(applied: Array, commanded: Array) -> Limitation | None:
    """What is said where openings (N, 4), m2, were not the commanded ones."""
    other = np.any(np.abs(applied - commanded) > DIFFERS * np.abs(commanded).max(), axis=1)
    share = float(np.mean(other))
    if share < TELLING:
        return None
    text = (
        f"The openings that were applied are used: in {share:.1%} of the log they are not the commanded ones "
        "(refused or safe commands, the ramp after arming)."
    )
    return Limitation("applied_differs", text)


def as_commanded(events: Sequence[LoggedEvent], left_out: float) -> list[Limitation]:
    """What is said of a hardware log without openings: ``left_out`` s of it, and commands that were refused."""
    found = []
    if left_out > 0.0:
        text = f"{left_out:.3g} s are left out: the driver held the valves safe, as /rig/events tells."
        found.append(Limitation("valves_safe", text, (), 0.95))
    count = refusals(events)
    if count:
        text = (
            f"The driver refused commands ({count} complaints on /rig/events) and the log does not say what it applied "
            "instead (/valve/applied)."
        )
        found.append(Limitation("commands_refused", text, (), 0.7))
    return found
