# SPDX-License-Identifier: Apache-2.0
"""Mistakes of wiring and clocks that would pass for an effect: what is far nearer to the nominal model once undone.

A sensor the other way round, two that are exchanged, gauge pressure in one topic, a topic whose stamps are off: each is
undone and the log held against the nominal run of it. No effect turns a sensor round, so that forbids a verdict; a late
valve does look like a late clock, and a scale like a zero, so those are said and limit what is told.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals.types import MEASURED, Signals
from pneumo_ros.diagnosis.signals.types import NO_VERDICT, Limitation
from pneumo_ros.rig.channels import DISPLACEMENTS, PRESSURES

NEARER: Final = 0.25  # of the mean square that is left at most once the mistake is undone [taste]
# Mean square, over the channel's variance, that the nominal run must miss of one at least: what follows the model is
# not wired wrongly [taste]
MISSED: Final = 0.3
# The same that it must leave of every channel once the mistake is undone: a leak lowers a pressure as gauge does, but
# the rest does not follow the model then [taste]
FOLLOWED: Final = 1.0
SETTLED: Final = 1.0  # s at the start that say nothing: the first state was read from the same sensors [physics]
LEADS: Final = (0.1, 0.15, 0.2, 0.3, 0.5)  # s that stamps may be off by; an effect may be late by less [taste]
LONGEST: Final = 0.2  # share of the log that stamps may be off by [numerics]
DOUBT: Final = 0.5  # most probability of a verdict beside a clock or a zero that may be wrong [taste]
# Channels that each topic carries [definition]
TOPICS: Final = {
    "/rig/displacement": DISPLACEMENTS, "/rig/front/pressure": PRESSURES[:1], "/rig/rear/pressure": PRESSURES[1:],
}  # fmt: skip


class Mistake(NamedTuple):
    """What may be wrong, and the log without it."""

    said: Limitation
    undone: Signals


def check_wiring(log: Signals, run: Callable[[Signals], Array]) -> list[Limitation]:
    """The likeliest mistake, if the nominal model's run comes that much nearer to the log once it is undone.

    Parameters
    ----------
    run : the nominal model's channels (N, 6) along a log, from the log's own start
    """
    as_it_is = _missed(log, run)
    if not np.nanmax(as_it_is, initial=0.0) > MISSED:
        return []
    tried = [(_missed(one.undone, run), one.said) for one in _mistakes(log)]
    left, said = min(tried, key=lambda one: float(np.nansum(one[0])))
    nearer = np.nansum(left) < NEARER * np.nansum(as_it_is) and np.nanmax(left) < FOLLOWED
    return [said] if nearer else []


def _missed(log: Signals, run: Callable[[Signals], Array]) -> Array:
    """(6,) mean square that the run misses of each channel over the channel's variance; NaN without a sample."""
    rows = slice(min(round(SETTLED / log.period), len(log.measured) // 2), None)
    weight, apart = log.weight[rows], (log.measured - run(log))[rows]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        square = np.sum(weight * apart**2, axis=0) / weight.sum(axis=0) / log.scale**2
    return np.where(np.isnan(square) & weight.any(axis=0), np.inf, square)


def _mistakes(log: Signals) -> Iterator[Mistake]:
    """Every mistake that is looked for."""
    for name in DISPLACEMENTS:
        said = Limitation("turned", f"{name} moves against the model: the sensor is the other way round{NO_VERDICT}",
                          (name,), 0.0)  # fmt: skip
        column = MEASURED.index(name)
        for zero in (0.0, float(np.average(log.measured[:, column], weights=log.weight[:, column] + 1e-12))):
            yield Mistake(said, _with(log, column, 2.0 * zero - log.measured[:, column]))
    for one, other in (*combinations(DISPLACEMENTS, 2), PRESSURES):
        text = f"{one} and {other} are each like the other in the model: exchanged{NO_VERDICT}"
        order = np.arange(len(MEASURED))
        order[[MEASURED.index(one), MEASURED.index(other)]] = MEASURED.index(other), MEASURED.index(one)
        crossed = replace(log, measured=log.measured[:, order], weight=log.weight[:, order], noise=log.noise[order])
        yield Mistake(Limitation("exchanged", text, (one, other), 0.0), _begun(crossed))
    ambient = log.rig.ambient_pressure.value
    for name in PRESSURES:
        text = f"{name} is near the model with one atmosphere added: gauge pressure, or an error of that size."
        column = MEASURED.index(name)
        yield Mistake(Limitation("maybe_gauge", text, (name,), DOUBT),
                      _with(log, column, log.measured[:, column] + ambient))  # fmt: skip
    yield from _late_or_early(log)


def _late_or_early(log: Signals) -> Iterator[Mistake]:
    """Each topic with other stamps."""
    rows = np.arange(len(log.measured))
    leads = [sign * lead for lead in LEADS for sign in (1.0, -1.0) if lead < LONGEST * len(rows) * log.period]
    for later in leads:
        why = "its clock is early, or the valves are late" if later > 0.0 else "its clock is late"
        at = np.clip(rows[: len(log.commands)] - round(later / log.period), 0, len(log.commands) - 1)
        yield Mistake(_off("/valve/command", later, why), replace(log, commands=log.commands[at]))
        why = "its clock is early" if later > 0.0 else "its clock is late, or the sensor is"
        at = rows - round(later / log.period)
        there, at = (at >= 0) & (at < len(rows)), np.clip(at, 0, len(rows) - 1)
        for topic, names in TOPICS.items():
            own = [MEASURED.index(name) for name in names]
            measured, weight = log.measured.copy(), log.weight.copy()
            measured[:, own], weight[:, own] = measured[at][:, own], weight[at][:, own] * there[:, None]
            yield Mistake(_off(topic, later, why), _begun(replace(log, measured=measured, weight=weight)))


def _off(topic: str, later: float, why: str) -> Limitation:
    moved = f"{1e3 * abs(later):.0f} ms {'later' if later > 0.0 else 'earlier'}"
    return Limitation("maybe_clock", f"{topic} is near the model with stamps {moved}: {why}.", (), DOUBT)


def _with(log: Signals, column: int, values: Array) -> Signals:
    measured = log.measured.copy()
    measured[:, column] = values
    return _begun(replace(log, measured=measured))


def _begun(log: Signals) -> Signals:
    """The log with its first state estimated anew."""
    return log.slice(0, len(log.measured))
