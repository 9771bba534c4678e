# SPDX-License-Identifier: Apache-2.0
"""Is a measured channel believable: dead, frozen, saturated, glitching, in the wrong unit, or missing altogether."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals.types import MEASURED
from pneumo_ros.diagnosis.signals.noise import quantum, white_noise
from pneumo_ros.diagnosis.signals.types import NO_VERDICT, Limitation
from pneumo_ros.errors import InputError

MIN_RUN: Final = 10  # equal samples in a row that are suspicious at all [taste]
QUANTISED_RUN: Final = 250  # the same where values are visibly quantised: slow motion stays within a step [taste]
FEW: Final = 100  # samples from which a typical run length is taken [numerics]
RUN_FACTOR: Final = 5.0  # times the run length that quantisation explains elsewhere in the channel [taste]
GLITCH_SIGMA: Final = 15.0  # robust sigmas from which a lone sample is a glitch [taste]
# share of samples that tells a channel's usual deviation: a chattering valve makes a zigzag of the pressure, each of
# whose tips stands alone, which the median of a median filter's rest does not see [taste]
COMMON: Final = 0.98
COMMON_SIGMA: Final = 2.33  # sigmas within which a normal law has that share of its samples (98 %) [definition]
MOSTLY: Final = 0.5  # a channel with fewer real samples than this share is left out [taste]
NOISE_FACTOR: Final = 2.0  # estimated against stated noise, either way [taste]
DISPLACEMENT_LIMIT: Final = 0.5  # m; the rig is 0.5 m long and moves by centimetres [physics]
PRESSURE_RANGE: Final = (5e4, 3e6)  # Pa absolute, half an atmosphere to thirty [physics]

# what the diagnosis cannot do without a channel [display]
LOST: Final = {
    "sprung_front": "the body's motion at the front is inferred, and a front force error is less sharply located",
    "sprung_rear": "the body's motion at the rear is inferred, and a rear force error is less sharply located",
    "unsprung_front": "the front tyre cannot be told from the front spring",
    "unsprung_rear": "the rear tyre cannot be told from the rear spring",
    "front_pressure": "an error of the front air or valve cannot be told from one of the front force",
    "rear_pressure": "an error of the rear air or valve cannot be told from one of the rear force",
}


class Checked(NamedTuple):
    """A channel after the checks: weights with the doubtful samples out, noise std, what was found."""

    weight: Array
    noise: float
    limitations: list[Limitation]


def check_channel(
    name: str, values: Array, weight: Array, stated_noise: float, log: str = "log", drive: Array | None = None
) -> Checked:
    """Look at one channel of :data:`MEASURED` on the uniform base.

    Parameters
    ----------
    values, weight : (N,)
    stated_noise : the config's standard deviation, 0 if it states none
    log : its name, for messages
    drive : (N, k) held inputs that enter the channel's rate, for :func:`white_noise`

    Raises
    ------
    InputError
        if the values cannot be in the contract's unit.
    """
    if not weight.any():
        return Checked(weight, stated_noise, [missing(name)])
    _check_unit(name, values[weight > 0], log)
    if np.ptp(values[weight > 0]) == 0.0:
        return Checked(np.zeros_like(weight), stated_noise, [_left_out(name, "constant", "never changes")])
    found: list[Limitation] = []
    kept = _without_stuck(name, values, weight, found)
    if kept.sum() < MOSTLY * weight.sum():
        return Checked(np.zeros_like(weight), stated_noise, [*found, _left_out(name, "mostly_stuck", "mostly stands")])
    weight, noise = kept, white_noise(values, kept, drive)
    noise = noise if np.isfinite(noise) and noise > 0.0 else stated_noise
    weight = _without_glitches(name, values, weight, noise, found)
    if weight.mean() < MOSTLY and not _merely_slow(weight):
        return Checked(np.zeros_like(weight), noise, [*found, _left_out(name, "mostly_missing", "is mostly missing")])
    _compare_noise(name, noise, stated_noise, found)
    return Checked(weight, noise, found)


def missing(name: str, why: str = "is not in the log") -> Limitation:
    """The limitation of a channel that the log does not carry."""
    return Limitation("missing_channel", f"{name} {why}: {LOST[name]}.", (name,), 0.85)


def _left_out(name: str, code: str, why: str) -> Limitation:
    return Limitation(code, f"{name} {why} and is left out: {LOST[name]}.", (name,), 0.85)


def _merely_slow(weight: Array) -> bool:
    """Evenly spread samples of a topic slower than the base, not a hole."""
    steps = np.diff(np.flatnonzero(weight))
    return len(steps) > 0 and float(np.percentile(steps, 99)) <= 1.5 * float(np.median(steps)) + 1.0


def _check_unit(name: str, values: Array, log: str) -> None:
    middle = float(np.median(np.abs(values)))
    if name.endswith("pressure"):
        low, high = PRESSURE_RANGE
        if not low <= middle <= high:
            raise InputError(
                "pressure not in Pa absolute", where=f"{log}, /rig/{name.replace('_', '/')}", value=round(middle, 6),
                allowed=f"{low:g} to {high:g} Pa", remedy="convert the log (gauge to absolute, bar or psi to Pa)",
            )  # fmt: skip
    elif middle > DISPLACEMENT_LIMIT:
        raise InputError(
            "displacement not in metres", where=f"{log}, /rig/displacement", key=name, value=round(middle, 6),
            allowed=f"up to {DISPLACEMENT_LIMIT} m", remedy="convert the log (mm or in to m)",
        )  # fmt: skip


def _without_stuck(name: str, values: Array, weight: Array, found: list[Limitation]) -> Array:
    real = np.flatnonzero(weight)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(values[real]) != 0.0]))
    lengths = np.diff(np.append(starts, len(real)))
    # The median run, weighted by samples, is what quantisation makes of normal motion. The levels where a channel may
    # stand (its ends, its most frequent one) say nothing of that: a channel that mostly stands would excuse itself.
    moving = _moving(values[real])
    runs = lengths[moving[starts]]
    typical = float(np.median(np.repeat(runs, runs))) if len(runs) else 1.0
    shortest = QUANTISED_RUN if quantum(values[real][moving]) > 0.0 else MIN_RUN
    stuck = np.flatnonzero(lengths >= max(shortest, RUN_FACTOR * typical))
    if not len(stuck):
        return weight
    kept, levels = weight.copy(), values[real[starts[stuck]]]
    for run in stuck:
        kept[real[starts[run] : starts[run] + lengths[run]]] = 0.0
    share = 1.0 - kept.sum() / weight.sum()
    at_end = bool(np.all(np.isin(levels, [values[real].min(), values[real].max()])))
    code, word = ("saturated", "is saturated") if at_end else ("frozen", "is frozen")
    text = f"{name} {word} in {100 * share:.1f} % of its samples; these are not used."
    found.append(Limitation(code, text, (name,), 1.0 if share < 0.02 else 0.8))
    return kept


def _moving(values: Array) -> NDArray[np.bool_]:
    """Samples at levels other than the lowest, the highest and the most frequent one; all, if that leaves few."""
    levels, counts = np.unique(values, return_counts=True)
    doubtful = (levels[0], levels[-1], levels[int(np.argmax(counts))])
    inner = ~np.isin(values, doubtful)
    return inner if np.count_nonzero(inner) >= FEW else np.ones(len(values), dtype=bool)


def _without_glitches(name: str, values: Array, weight: Array, noise: float, found: list[Limitation]) -> Array:
    rest = np.abs(values - median_filter(values, 5, mode="nearest"))
    spread = float(np.quantile(rest[weight > 0], COMMON)) / COMMON_SIGMA if weight.any() else 0.0
    bad = (weight > 0) & (rest > GLITCH_SIGMA * max(noise, spread, 1e-12))
    count = int(np.count_nonzero(bad))
    if not count:
        return weight
    found.append(
        Limitation("glitches", f"{name} has {count} single-sample glitches; they are not used.", (name,),
                   1.0 if count < 0.01 * len(values) else 0.8)
    )  # fmt: skip
    return np.where(bad, 0.0, weight)


def _compare_noise(name: str, noise: float, stated: float, found: list[Limitation]) -> None:
    if stated <= 0.0 or stated / NOISE_FACTOR <= noise <= stated * NOISE_FACTOR:
        return
    unit = "Pa" if name.endswith("pressure") else "m"
    text = f"{name}: white noise is {noise:.2g} {unit}, the config states {stated:.2g} {unit}; the data's is used."
    found.append(Limitation("noise_differs", text, (name,)))


def all_limits(weight: Array, measured: Array, noise: Array) -> list[Limitation]:
    """What holds for all channels together: too few of them, or nothing that moved."""
    used = np.asarray(weight.any(axis=0))
    found = []
    if np.count_nonzero(used) < 3:
        names = ", ".join(name for name, ok in zip(MEASURED, used, strict=True) if ok) or "none"
        found.append(Limitation("too_few_channels", f"Only these channels are usable: {names}{NO_VERDICT}", (), 0.0))
    moved = [np.std(measured[weight[:, i] > 0, i]) > 5.0 * noise[i] for i in range(len(MEASURED)) if used[i]]
    if moved and not any(moved):
        found.append(Limitation("no_motion", f"Nothing moved: every channel is within its noise{NO_VERDICT}", (), 0.0))
    return found
