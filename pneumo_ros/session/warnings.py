# SPDX-License-Identifier: Apache-2.0
"""What a reader of a session's figures must know: periods missed, estimates too late, commands refused."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence

from pneumo_ros.log.decoded import Log
from pneumo_ros.log.inspection import Event, read_events

MISSED = "missed periods"
STALE, COMPLETE = "estimate_stale", "session_complete"
REFUSED = {  # node and key of its /diagnostics -> what it means
    ("controller", "refused commands"): "commands were not finite, so the valves were held at trim",
    ("daq", "refused commands"): "commands were refused by the driver (too old, or out of range)",
    ("daq", "commands the board refused"): "commands were refused by the board",
    ("daq", "samples withheld"): "samples were withheld: a sensor could not be believed",
    ("daq", "lost frames"): "samples were lost on the line",
}


def warnings_of(log: Log, loop: Mapping[str, Mapping[str, str]], mode: str) -> tuple[str, ...]:
    """One line each, with counts; nothing is missed in lockstep, where a period waits for its command.

    Parameters
    ----------
    log : with /rig/events
    loop : of :func:`pneumo_ros.session.summary.loop_timing`
    mode : lockstep or realtime
    """
    found = [] if mode == "lockstep" else _missed(loop)
    events = of_the_session(list(read_events(log)))
    late = sum(event.code == STALE for event in events)
    if late:
        often = "once" if late == 1 else f"{late} times"
        found.append(f"{often} no estimate came in time; the controller then sent the safe command")
    for (node, key), meaning in REFUSED.items():
        count = int(float(loop.get(node, {}).get(key, "0")))
        if count:
            found.append(f"{count} {meaning}" if count > 1 else f"1 {_one(meaning)}")
    trips = Counter(event.message for event in events if event.is_trip)
    return (*found, *(f"error: {text}" + (f" ({n} times)" if n > 1 else "") for text, n in trips.items()))


def of_the_session(events: Sequence[Event]) -> list[Event]:
    """Without late estimates after its end: the nodes end one after the other, the estimator first."""
    end = next((k for k, event in enumerate(events) if event.code == COMPLETE), len(events))
    return [event for k, event in enumerate(events) if k <= end or event.code != STALE]


def _one(meaning: str) -> str:
    """The same of a single command or sample."""
    return re.sub(r"^(command|sample)s were", r"\1 was", meaning)


def _missed(loop: Mapping[str, Mapping[str, str]]) -> list[str]:
    out = []
    for node, values in loop.items():
        missed, steps = int(values.get(MISSED, "0")), int(values.get("steps", "0"))
        if missed:
            share = missed / max(missed + steps, 1)
            out.append(f"{node} missed {missed} of {missed + steps} periods ({share:.1%}); they were skipped")
    return out
