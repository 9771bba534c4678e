# SPDX-License-Identifier: Apache-2.0
"""Atoms of what happens to a signal on its way: valves, exciter and sensors.

A slow part is a mixture of lags and delays with nonnegative shares, and one follower whose rate limit and two lags are
fitted (mixtures of limits are not like a limit between them); a dead zone takes away ramps that end at a corner, and
what a play of some width does not pass, and one spool that sticks and jumps, whose band is fitted for the same reason;
a sensor's error is a polynomial of its own reading that ends somewhere, with kinks; its zero creeps from where it stood
when the log began, by exponentials of every length.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.effects.contract import (
    ENDS,
    PRESSURES_OR_BOTH,
    Effect,
    Ends,
    Inputs,
    Memory,
    Values,
    by_column,
)
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.effects.shapes.atoms import Atom, amplitude
from pneumo_ros.laws.filters import delayed_hold, first_order_line, followed, lagged_hold, play, sampled_hold, stick
from pneumo_ros.laws.signal import bent, crept, dead
from pneumo_ros.rig.channels import DISPLACEMENTS

Filter = Callable[[Array, float, Memory], tuple[Array, Memory]]
CRITICAL = 1.0  # damping ratio of a lag's two equal poles
VALVE_LAGS = (0.002, 0.006, 0.015, 0.04)  # s, of each of two equal poles
DELAYS = (0.004, 0.008, 0.016, 0.032, 0.064)  # s
CORNERS = (2e-8, 6e-8, 1.5e-7, 4e-7)  # m2
PLAYS = (2e-8, 8e-8, 2e-7)  # m2, half width
EXCITER_LAGS = (0.002, 0.006, 0.02)  # s
SENSOR_LAGS = (0.002, 0.006, 0.02, 0.06)  # s
WAYS = ("rising", "falling")
UNEVEN = (0.008, 0.03)  # s, lags one way of a valve that is quick the other way
QUICK = 0.001  # s
TWICE = 2.0  # of a filter's share: what is more is no part of a signal
SHARE = 0.3
BEGINS = ((0.05, 0.005), (0.005, 0.05))  # s, lags up and down from which a follower that does all of it is fitted
LIMITS = (0.5, 1.5)  # of the typical rate limit, the same with lags of LIMITED s
LIMITED = 0.01
RESTS = (0.0291, 0.0207, -0.0166, -0.0250, 2.77e5, 4.29e5)  # m, Pa absolute: CHANNELS of the nominal rig at rest
PRESSURE_SWING, LVDT_SWING = 5e4, 0.01  # Pa, m: of a session
KINKED = "scale above 0"
KINKS = (0.0, 1.0)  # swings from the rest beyond which a sensor may have another sensitivity
STRAIGHT = 2  # powers from which on a sensor's curve ends: what is straight goes on
# Swings from the rest beyond which a sensor's curve bends no further: a polynomial has no bounds where no fitted log
# has been, a sensor's error has
CURVE_END = EffectParameter("end of the curve", "1", 0.4, 4.0, 1.0, ends=(0.4, 4.0), spread=10.0)
CREEPS = (1.0, 4.0, 15.0, 60.0)  # s; the longest is a straight line in most logs
CREEPS_TRIED = (1, 3)  # which of them are tried alone
LVDT_CREEP, PRESSURE_CREEP = 1e-3, 5e3  # m, Pa: where a creeping zero typically ends


def _lag(tau: float) -> Filter:
    return lambda u, period, memory: lagged_hold(u, period, tau, CRITICAL, memory)


def _delay(tau: float) -> Filter:
    return lambda u, period, memory: delayed_hold(u, period, tau, memory)


def _line(tau: float) -> Filter:
    return lambda u, period, memory: first_order_line(u, period, tau, memory)


def _play(half: float) -> Filter:
    return lambda u, period, memory: play(u, half, memory)


def _stick(band: float) -> Filter:
    return lambda u, period, memory: stick(u, band, memory)


def _take(every: float, phase: float) -> Filter:
    return lambda u, period, memory: sampled_hold(u, period, every, phase, memory)


def _follow(slew: float, rising: float, falling: float) -> Filter:
    """A part of first order, with a lag on the way up and another on the way down, no faster than ``slew``."""

    def passed(u: Array, period: float, memory: Memory) -> tuple[Array, Memory]:
        up, down = (1.0 - math.exp(-period / tau) for tau in (rising, falling))
        held = float(u[0]) if memory is None else memory
        y = followed(np.ascontiguousarray(u), up, down, slew * period, held)
        return y, float(y[-1])

    return passed


def _corner(end: float) -> Filter:
    return lambda u, period, memory: (u - dead(u, end), None)


def mixed(filters: Sequence[Filter], u: Array, period: float, shares: Values, memory: Memory) -> tuple[Array, Memory]:
    """A signal of which shares pass through filters, (N,); a filter of no share is passed over."""
    kept, out = list(memory or [None] * len(filters)), u.copy()
    for k, (through, share) in enumerate(zip(filters, shares, strict=True)):
        if share != 0.0:
            y, kept[k] = through(u, period, kept[k])
            out += share * (y - u)
    return out, tuple(kept)


def _shares(names: Sequence[str], every_sign: bool = False, most: Sequence[float] = ()) -> tuple[EffectParameter, ...]:
    """Shares by name, at most ``most``, or twice the whole."""
    highs = most or [TWICE] * len(names)
    return tuple(
        EffectParameter(n, "1", -high if every_sign else 0.0, high, SHARE, size=True, spread=10.0)
        for n, high in zip(names, highs, strict=True)
    )


def _valve(name: str, summary: str, names: Sequence[str], filters: Sequence[Filter], inlets_only: bool,
           fitted: tuple[EffectParameter, ...] = (), made: Callable[..., Filter] | None = None,
           alone: bool = False, taken: bool = False, most: Sequence[float] = ()) -> Effect:  # fmt: skip
    """A valve's shape of filters, each with ``most`` as its largest share; one filter whose numbers are fitted is
    ``made`` of the last parameters, after its share, and tried ``alone`` as well, or scanned for where these are an
    interval and a phase (``taken``); a follower is begun with as all of it.
    """

    def inputs(given: Inputs, period: float, ends: Ends, values: Values, memory: Memory) -> tuple[Inputs, Memory]:
        columns = [c for end in ends.columns for c in ((end,) if inlets_only else (end, 2 + end))]
        count = len(names) + (0 if made is None else 1)
        shares, own = values[:count], [*filters, *([] if made is None else [made(*values[count:])])]
        commands, memory = by_column(
            lambda u, kept: mixed(own, u, period, shares, kept), given.commands, columns, memory
        )
        return given._replace(commands=np.maximum(commands, 0.0)), memory

    parameters = (*_shares(names, name.startswith("anything"), most), *fitted)
    screened = (len(names),) if alone else ()
    sticks = (len(names), len(names) + 1) if made is _stick else ()
    at = (len(names), len(names) + 1, len(names) + 2) if taken else ()
    begins = _begun(parameters) if made is _follow else ()
    return Effect(name, summary, ENDS, ("{end}_air",), parameters, inputs=inputs, screened=screened, taken=at,
                  sticks=sticks, begins=begins)  # fmt: skip


def _exciter(given: Inputs, period: float, ends: Ends, values: Values, memory: Memory) -> tuple[Inputs, Memory]:
    gain, *shares = values[: 2 + len(EXCITER_LAGS)]
    filters = [*(_line(t) for t in EXCITER_LAGS), _follow(*values[-3:])]

    def driven(u: Array, kept: Memory) -> tuple[Array, Memory]:
        out, kept = mixed(filters, u, period, tuple(shares), kept)
        return out + gain * u, kept

    road, memory = by_column(driven, given.road, ends.columns, memory)
    return given._replace(road=road), memory


def _static_error(x: Array, rest: float, swing: float, powers: Sequence[int], values: Values) -> Array:
    """A sensor's error over its own reading, in the reading's unit: a polynomial about the rest that bends no further
    from its end on, with kinks.
    """
    z, end = (x - rest) / swing, values[len(powers) + 2 * len(KINKS)]
    out = bent(z, powers[:STRAIGHT], values[:STRAIGHT])
    out += bent(np.clip(z, -end, end), powers[STRAIGHT:], values[STRAIGHT : len(powers)])
    for k, kink in enumerate(KINKS):
        above, below = values[len(powers) + 2 * k : len(powers) + 2 * k + 2]
        if above != 0.0 or below != 0.0:
            out += above * np.maximum(z - kink, 0.0) + below * np.minimum(z + kink, 0.0)
    return np.asarray(swing * out)


def _sensor(name: str, summary: str, sites: tuple[str, ...], swing: float, powers: Sequence[int],
            lags: Sequence[float], follower: tuple[EffectParameter, ...] = ()) -> Effect:  # fmt: skip
    kinks = [f"{way} {kink:g}" for kink in KINKS for way in ("above", "below")] if powers else []
    ended = (CURVE_END,) if powers else ()
    count = len(powers) + len(kinks) + len(ended)
    some = count + len(lags) + (1 if follower else 0)

    def error(x: Array, channel: int, values: Values) -> Array:
        return _static_error(x, RESTS[channel], swing, powers, values[:count]) if powers else np.zeros_like(x)

    def outputs(
        given: Array, period: float, channels: tuple[int, ...], values: Values, memory: Memory
    ) -> tuple[Array, Memory]:
        filters = [*(_line(t) for t in lags), *([_follow(*values[some:])] if follower else [])]
        out, kept = given, memory
        for channel in channels:

            def shown(x: Array, state: Memory, channel: int = channel) -> tuple[Array, Memory]:
                late, state = mixed(filters, x, period, values[count:some], state)
                return late + error(x, channel, values), state

            out, kept = by_column(shown, out, (channel,), kept)
        return out, kept

    def undo(measured: Array, channels: tuple[int, ...], values: Values) -> Array:
        for channel in channels:  # the error is small: once is enough for a start
            measured[:, channel] -= error(measured[:, channel], channel, values)
        return measured

    atoms = [
        *(Atom(f"error of power {power}", "1", 0.03, signed=True) for power in powers),
        *(Atom(f"scale {kink}", "1", 0.03, signed=True) for kink in kinks),
    ]
    # A scale that is off does nothing like them; a kink on the other side is one with another scale.
    alone = tuple(k for k, atom in enumerate(atoms) if atom.name in ("error of power 2", "error of power 3", KINKED))
    every_sign = name.startswith("anything")
    own = _shares([f"lag {t:g} s" for t in lags], every_sign)
    parameters = (*(amplitude(atom) for atom in atoms), *ended, *own, *follower)
    begins = _begun(parameters) if follower else ()
    return Effect(name, summary, sites, (), parameters, outputs=outputs, undo=undo, screened=alone, begins=begins)


def _creeping(name: str, sites: tuple[str, ...], typical: float, unit: str) -> Effect:
    def outputs(
        given: Array, period: float, channels: tuple[int, ...], values: Values, memory: Memory
    ) -> tuple[Array, Memory]:
        begun = memory or 0  # rows: a time would add up otherwise in other blocks
        time = period * np.arange(begun, begun + len(given))
        moved = sum(v * crept(time, tau) for v, tau in zip(values, CREEPS, strict=True))
        given[:, channels] += np.reshape(moved, (-1, 1))
        return given, begun + len(given)

    atoms = [Atom(f"creep {tau:g} s", unit, typical, signed=True) for tau in CREEPS]
    parameters = tuple(amplitude(atom) for atom in atoms)
    return Effect(name, "a zero that creeps", sites, (), parameters, outputs=outputs, screened=CREEPS_TRIED)


def _follower(unit: str, slew: float, fastest: float) -> tuple[EffectParameter, ...]:
    """Share of a follower, its rate limit and its lags; at ``fastest`` the limit is none."""
    return (
        *_shares(["follower"]),
        EffectParameter("slew", unit, 0.1 * slew, fastest, slew, ends=(fastest,), spread=10.0),
        *(
            EffectParameter(f"{way} lag", "s", 1e-4, 0.2, 0.01, ends=(1e-4,), spread=10.0)
            for way in ("rising", "falling")
        ),
    )


def _begun(parameters: Sequence[EffectParameter]) -> tuple[Values, ...]:
    """Values of a shape that ends with a follower, which does all of it: without a rate limit and with a lag one way,
    or with a limit.
    """
    before, slew = [0.0 if p.size else p.typical for p in parameters[:-4]], parameters[-3]
    uneven = [(*before, 1.0, slew.high, *lags) for lags in BEGINS]
    return (*uneven, *((*before, 1.0, share * slew.typical, LIMITED, LIMITED) for share in LIMITS))


LAG_NAMES, DELAY_NAMES = [f"lag {t:g} s" for t in VALVE_LAGS], [f"delay {t:g} s" for t in DELAYS]
UNEVEN_NAMES = [f"slow {way} {t:g} s" for t in UNEVEN for way in ("opening", "closing")]
ONE_WAY = [_follow(math.inf, *pair) for t in UNEVEN for pair in ((t, QUICK), (QUICK, t))]
ZONE_NAMES = [*(f"corner {c:g} m2" for c in CORNERS), *(f"play {c:g} m2" for c in PLAYS)]
SLOW, LATE = [_lag(t) for t in VALVE_LAGS], [_delay(t) for t in DELAYS]
# Of two shares of a narrow corner's zone one of twice its width is made: each may be as wide as the widest.
ZONE_SHARES = [*(TWICE * CORNERS[-1] / c for c in CORNERS), *([TWICE] * len(PLAYS))]
ZONES = [*(_corner(c) for c in CORNERS), *(_play(c) for c in PLAYS)]
STICKING = (*_shares(["sticking"]),
            EffectParameter("band", "m2", 3e-9, 1e-6, 1.2e-7, starts=(4e-8, 2.5e-7)))  # fmt: skip
TAKING = (*_shares(["taken"]), EffectParameter("interval", "s", 4e-3, 0.25, 0.05, spread=10.0),
          EffectParameter("phase", "1", 0.0, 1.0, 0.5, spread=10.0))  # fmt: skip
EXCITER = (EffectParameter("gain", "1", -0.5, 0.5, 0.03, size=True, spread=10.0),
           *_shares([f"lag {t:g} s" for t in EXCITER_LAGS]), *_follower("m/s", 0.06, 1.0))  # fmt: skip
EFFECTS = (
    _valve("valve_lag.shape", "a slow valve of any law: lags of every length, rate limits",
           [*LAG_NAMES, *UNEVEN_NAMES, DELAY_NAMES[0]], [*SLOW, *ONE_WAY, LATE[0]], False,
           _follower("m2/s", 1.5e-6, 3e-5), _follow),
    _valve("transport_delay.shape", "commands that come late by delays of many lengths, or at a driver's intervals",
           DELAY_NAMES, LATE, False, TAKING, _take, taken=True),
    _valve("valve_deadband.shape", "a dead zone of any law: hard, soft, with play, or a spool that sticks and jumps",
           ZONE_NAMES, ZONES, True, STICKING, _stick, alone=True, most=ZONE_SHARES),
    _valve("anything.valve", "whatever acts there", [*LAG_NAMES, *DELAY_NAMES, *ZONE_NAMES], [*SLOW, *LATE, *ZONES],
           True),
    Effect("exciter_lag.shape", "a slow exciter of any law", ENDS, ("road_input",), EXCITER, inputs=_exciter,
           begins=_begun(EXCITER)),
    _creeping("lvdt_offset.shape", DISPLACEMENTS, LVDT_CREEP, "m"),
    _creeping("pressure_offset.shape", PRESSURES_OR_BOTH, PRESSURE_CREEP, "Pa"),
    _sensor("lvdt_scale.shape", "a sensitivity that is off, or not constant", DISPLACEMENTS, LVDT_SWING,
            (0, 1, 2, 3), ()),
    _sensor("pressure_scale.shape", "a sensitivity that is off, or not constant", PRESSURES_OR_BOTH, PRESSURE_SWING,
            (0, 1, 2, 3), ()),
    _sensor("pressure_lag.shape", "a late pressure sensor of any law", PRESSURES_OR_BOTH, PRESSURE_SWING,
            (), SENSOR_LAGS, _follower("Pa/s", 5e5, 1e7)),
    _sensor("anything.lvdt", "whatever the sensor does", DISPLACEMENTS, LVDT_SWING, (0, 1, 2, 3),
            SENSOR_LAGS[1:3]),
    _sensor("anything.pressure", "whatever the sensor does", PRESSURES_OR_BOTH, PRESSURE_SWING,
            (0, 1, 2, 3), SENSOR_LAGS),
)  # fmt: skip
