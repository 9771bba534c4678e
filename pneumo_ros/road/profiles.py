# SPDX-License-Identifier: Apache-2.0
"""What excites the rig: road profiles under both axles, frozen and repeatable.

Heights are the road's under the scaled rig, m, upwards; a full-scale road at full-scale speed is divided by the length
scale (time scale 1, section 6.2). The rear axle meets what the front axle met, wheelbase/speed later (errata 2).

Kernel arguments
----------------
t : (N,) s
w, a, p : (K,) frequencies, rad/s, amplitudes, m, and phases, rad, of the cosines
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import yaml
from numba import njit
from numpy.typing import ArrayLike, NDArray

from pneumo_ros.errors import InputError
from pneumo_ros.parameters import Parameter, Value, settings
from pneumo_ros.units import KMH

LENGTH_SCALE = 5.0  # full-scale Honda Civic over the rig, Table 3.4
ISO_REFERENCE = 1.0  # rad/m, Omega_0 of Eq. 6.1
ISO_MEAN = {  # m3/cycle at Omega_0, the mean column of Table 6.1; H has no mean, it continues the factor of 4
    "A": 4e-6,
    "B": 16e-6,
    "C": 64e-6,
    "D": 256e-6,
    "E": 1024e-6,
    "F": 4096e-6,
    "G": 16384e-6,
    "H": 65536e-6,
}
KINDS = ("iso", "sine", "sweep", "step", "bump", "flat", "file")

Shape = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]


@dataclass(frozen=True)
class RoadSpec:
    """Everything that determines a road; its text goes into the log.

    Attributes
    ----------
    kind : one of :data:`KINDS`
    iso_class : A to H (kind iso)
    seed : of the random phases; the same seed gives the same road
    speed_kmh : full-scale speed, km/h
    low_hz, high_hz : band of the temporal frequency, Hz (iso; sweep runs through it)
    spacing_hz : width of a frequency cell, Hz: one cosine in each (iso)
    amplitude : of sine, sweep, step and bump on the rig, m
    frequency_hz : of the sine, Hz; a bump is half a period of it
    duration : of the sweep, s
    start : time the excitation begins, s; before it the road is flat
    ramp : time over which iso, sine and sweep grow in smoothly, s
    rear_delay : s; wheelbase over speed, 0 for axles in phase
    path : CSV file with columns time, front[, rear] in s and m (kind file)
    length_scale : full-scale vehicle over the rig
    """

    kind: str = "iso"
    iso_class: str = "D"
    seed: int = 1
    speed_kmh: float = 80.0
    low_hz: float = 0.5
    high_hz: float = 30.0
    spacing_hz: float = 0.05
    amplitude: float = 0.005
    frequency_hz: float = 1.0
    duration: float = 20.0
    start: float = 0.0
    ramp: float = 1.0
    rear_delay: float = 0.1143
    path: str = ""
    length_scale: float = LENGTH_SCALE

    def to_yaml(self) -> str:
        """The text a session log carries."""
        return yaml.safe_dump({"road": asdict(self)}, sort_keys=False)


PARAMETERS: tuple[Parameter, ...] = (
    Parameter("kind", "iso", "", "shape of the road", choices=KINDS, read_only=True),
    Parameter("iso_class", "D", "", "roughness by Table 6.1 (kind iso)", choices=tuple(ISO_MEAN), read_only=True),
    Parameter("seed", 1, "1", "seed of the random phases; one seed is one road", 0, 2**31 - 1, read_only=True),
    Parameter("speed_kmh", 80.0, "km/h", "full-scale speed; sets the rear delay as well", 1.0, 300.0, read_only=True),
    Parameter("low_hz", 0.5, "Hz", "lowest frequency of the road at this speed", 0.01, 50.0, read_only=True),
    Parameter("high_hz", 30.0, "Hz", "highest frequency of the road at this speed", 0.1, 250.0, read_only=True),
    Parameter("spacing_hz", 0.05, "Hz", "frequency cell, one cosine in each (kind iso)", 0.001, 1.0, read_only=True),
    Parameter("amplitude", 0.005, "m", "of sine, sweep, step and bump, on the rig", 0.0, 0.05, read_only=True),
    Parameter("frequency_hz", 1.0, "Hz", "of the sine; a bump is half a period of it", 0.01, 100.0, read_only=True),
    Parameter("duration", 20.0, "s", "time the sweep takes from low_hz to high_hz", 0.1, 3600.0, read_only=True),
    Parameter("start", 0.0, "s", "flat road before this time", 0.0, 3600.0, read_only=True),
    Parameter("ramp", 1.0, "s", "iso, sine and sweep grow in smoothly over this time", 0.0, 60.0, read_only=True),
    Parameter("path", "", "", "CSV file with columns time, front[, rear] in s and m (kind file)", read_only=True),
)


@dataclass(frozen=True)
class Road:
    """A profile under both axles.

    Attributes
    ----------
    spec : what it was made from
    front, rear : each maps times (N,), s, to heights and vertical velocities (N,), m and m/s
    """

    spec: RoadSpec
    front: Shape
    rear: Shape

    def sample(self, times: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Heights (N, 2), m, and vertical velocities (N, 2), m/s, front and rear, at times (N,), s."""
        t = np.atleast_1d(np.asarray(times, dtype=float))
        (zf, vf), (zr, vr) = self.front(t), self.rear(t)
        return np.column_stack([zf, zr]), np.column_stack([vf, vr])


def build_road(
    values: dict[str, Value] | None = None,
    *,
    wheelbase: float,
    length_scale: float = LENGTH_SCALE,
    where: object = "road",
) -> Road:
    """A road from parameters (names of :data:`PARAMETERS`) and the rig's wheelbase, m, and scale.

    The rear delay follows from both and the full-scale speed.
    """
    checked = settings(PARAMETERS, values, where)
    speed = float(checked["speed_kmh"]) * KMH / length_scale
    spec = RoadSpec(**checked, rear_delay=wheelbase / speed, length_scale=length_scale)  # type: ignore[arg-type]
    return make_road(spec, where)


def make_road(spec: RoadSpec, where: object = "road") -> Road:
    """The road a spec describes.

    Raises
    ------
    InputError
        if the band is empty, the class unknown or the file unreadable.
    """
    if spec.kind not in KINDS:
        raise InputError("unknown road", where=where, key="kind", value=spec.kind, allowed=", ".join(KINDS))
    if spec.low_hz >= spec.high_hz:
        raise InputError(
            "empty band", where=where, key="low_hz", value=spec.low_hz, allowed=f"below high_hz = {spec.high_hz:g} Hz"
        )
    if spec.kind == "file":
        return _from_file(spec)
    shape = _SHAPES[spec.kind](spec)

    def front(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return shape(t - spec.start)

    def rear(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return shape(t - spec.start - spec.rear_delay)

    return Road(spec, front, rear)


def iso_psd(frequency_hz: ArrayLike, iso_class: str, speed: float) -> NDArray[np.float64]:
    """One-sided temporal PSD of the full-scale road, m2/Hz (Eqs. 6.1-6.3; over 2 pi it is Eq. 6.4, per rad/s).

    Parameters
    ----------
    frequency_hz : temporal frequency, Hz
    iso_class : A to H
    speed : full-scale, m/s

    Omega = 2 pi f / V is in rad/m because Omega_0 is, while G is per cycle: a distance of one cycle is 1/V seconds, so
    G(f) = G(Omega)/V carries no 2 pi.
    """
    if iso_class not in ISO_MEAN:
        raise InputError("unknown road class", key="iso_class", value=iso_class, allowed=", ".join(ISO_MEAN))
    omega = 2.0 * math.pi * np.asarray(frequency_hz, dtype=float) / speed
    slope = np.where(omega <= ISO_REFERENCE, 2.0, 1.5)
    return ISO_MEAN[iso_class] * (omega / ISO_REFERENCE) ** -slope / speed


def iso_components(spec: RoadSpec) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Angular frequencies (rad/s), full-scale amplitudes (m) and phases (rad) of Eq. 6.5, each (K,).

    One frequency is drawn in each cell of the band, not put at its centre: equal spacing would repeat the road after
    1/spacing. Amplitudes by Eq. 6.6 with the PSD at the drawn frequency, so sum(A^2)/2 is the band's variance.
    """
    rng = np.random.default_rng(spec.seed)
    count = max(1, round((spec.high_hz - spec.low_hz) / spec.spacing_hz))
    cell = (spec.high_hz - spec.low_hz) / count
    frequency = spec.low_hz + cell * (np.arange(count) + rng.random(count))
    phase = rng.uniform(0.0, 2.0 * math.pi, count)
    amplitude = np.sqrt(2.0 * iso_psd(frequency, spec.iso_class, spec.speed_kmh * KMH) * cell)
    return 2.0 * math.pi * frequency, amplitude, phase


ROTATION_BLOCK = 64  # samples between exact sines; rotating in between loses less than 1e-14


@njit(cache=True, fastmath={"contract"})
def _cosines(
    t: NDArray[np.float64], w: NDArray[np.float64], a: NDArray[np.float64], p: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sum of A cos(wt + p) (Eq. 6.5) and its rate; times before zero give zero.

    Evenly spaced times, the usual case, are reached by rotating each phasor: thirty times quicker than a sine a sample.
    """
    z, v = np.zeros(t.shape[0]), np.zeros(t.shape[0])
    even = t.shape[0] > 2 and np.max(np.abs(np.diff(t) - (t[1] - t[0]))) < 1e-9
    block = ROTATION_BLOCK if even else 1
    dt = t[1] - t[0] if even else 0.0
    for k in range(w.shape[0]):
        turn_re, turn_im = math.cos(w[k] * dt), math.sin(w[k] * dt)
        rate = a[k] * w[k]
        for start in range(0, t.shape[0], block):
            angle = w[k] * t[start] + p[k]
            re, im = math.cos(angle), math.sin(angle)
            for i in range(start, min(start + block, t.shape[0])):
                z[i] += a[k] * re
                v[i] -= rate * im
                re, im = re * turn_re - im * turn_im, re * turn_im + im * turn_re
    for i in range(t.shape[0]):
        if t[i] <= 0.0:
            z[i], v[i] = 0.0, 0.0
    return z, v


def ramp_in(t: NDArray[np.float64], ramp: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Factor 0 to 1 over ``ramp`` seconds and its rate, 1/s: 10x^3 - 15x^4 + 6x^5, so acceleration starts at zero."""
    if ramp <= 0.0:
        return (t > 0.0).astype(float), np.zeros_like(t)
    x = np.clip(t / ramp, 0.0, 1.0)
    return x**3 * (10.0 + x * (6.0 * x - 15.0)), 30.0 * x**2 * (1.0 - x) ** 2 / ramp


def _grown(spec: RoadSpec, shape: Shape) -> Shape:
    """``shape`` with the smooth start laid over it."""

    def grown(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        z, v = shape(t)
        factor, rate = ramp_in(t, spec.ramp)
        return factor * z, factor * v + rate * z

    return grown


def _iso(spec: RoadSpec) -> Shape:
    w, a, p = iso_components(spec)
    a = a / spec.length_scale
    return _grown(spec, lambda t: _cosines(t, w, a, p))


def _sine(spec: RoadSpec) -> Shape:
    w, a = 2.0 * math.pi * spec.frequency_hz, spec.amplitude
    return _grown(spec, lambda t: (a * np.sin(w * t), a * w * np.cos(w * t)))


def _sweep(spec: RoadSpec) -> Shape:
    """Logarithmic sine sweep from low to high over the duration; flat afterwards would jump, so it holds the top."""
    w0, rate = 2.0 * math.pi * spec.low_hz, math.log(spec.high_hz / spec.low_hz) / spec.duration

    def shape(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        inside = np.clip(t, 0.0, spec.duration)
        w = w0 * np.exp(rate * inside)
        angle = (w - w0) / rate + w * (np.maximum(t, 0.0) - inside)
        return spec.amplitude * np.sin(angle), spec.amplitude * w * np.cos(angle)

    return _grown(spec, shape)


def _step(spec: RoadSpec) -> Shape:
    """A rise by ``amplitude`` over 20 ms (an exciter cannot jump), smooth at both ends."""
    rise = 0.02

    def shape(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        factor, rate = ramp_in(t, rise)
        return spec.amplitude * factor, spec.amplitude * rate

    return shape


def _bump(spec: RoadSpec) -> Shape:
    """A single raised cosine of ``amplitude``, half a period of ``frequency_hz`` long."""
    length = 0.5 / spec.frequency_hz
    w = 2.0 * math.pi / length

    def shape(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        on = (t > 0.0) & (t < length)
        half = 0.5 * spec.amplitude
        return np.where(on, half * (1.0 - np.cos(w * t)), 0.0), np.where(on, half * w * np.sin(w * t), 0.0)

    return shape


def _flat(_: RoadSpec) -> Shape:
    return lambda t: (np.zeros_like(t), np.zeros_like(t))


_SHAPES: dict[str, Callable[[RoadSpec], Shape]] = {
    "iso": _iso,
    "sine": _sine,
    "sweep": _sweep,
    "step": _step,
    "bump": _bump,
    "flat": _flat,
}


def _from_file(spec: RoadSpec) -> Road:
    """Heights of a CSV file, linear between rows, held beyond the ends; a missing rear is the front's, delayed."""
    table = _read_table(Path(spec.path))

    def column(index: int, delay: float) -> Shape:
        def shape(t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            at = t - spec.start - delay
            slope = np.append(np.diff(table[:, index]) / np.diff(table[:, 0]), 0.0)
            row = np.searchsorted(table[:, 0], at, side="right") - 1
            velocity = np.where((row >= 0) & (row < len(table) - 1), slope[np.clip(row, 0, None)], 0.0)
            return np.interp(at, table[:, 0], table[:, index]), velocity

        return shape

    rear = column(2, 0.0) if table.shape[1] > 2 else column(1, spec.rear_delay)
    return Road(spec, column(1, 0.0), rear)


def _read_table(path: Path) -> NDArray[np.float64]:
    try:
        with path.open(newline="", encoding="utf-8") as handle:
            rows = [row for row in csv.reader(handle) if row and not row[0].lstrip().startswith("#")]
        if rows and not _is_number(rows[0][0]):
            rows = rows[1:]
        table = np.array([[float(cell) for cell in row] for row in rows])
    except (OSError, ValueError, UnicodeDecodeError) as error:
        raise _file_error(path, f"cannot read the road ({error})") from error
    if table.ndim != 2 or table.shape[0] < 2 or table.shape[1] not in (2, 3) or not np.isfinite(table).all():
        raise _file_error(path, "a road needs two rows or more of two or three finite numbers")
    if np.any(np.diff(table[:, 0]) <= 0.0):
        raise _file_error(path, "times do not increase")
    return table


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _file_error(path: Path, what: str) -> InputError:
    return InputError(what, where=path, allowed="columns time_s, front_m[, rear_m]", remedy="mend or replace the file")
