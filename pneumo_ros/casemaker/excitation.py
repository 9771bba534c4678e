# SPDX-License-Identifier: Apache-2.0
"""What shakes the rig: roads of ISO 8608 class C to E at the scale of the rig, sweeps, multisines, and valve steps.

Every road is still for the first half second, so that the first sample of a log is the rig at rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

STILL = 0.5  # s
LENGTH_SCALE = 5.0  # the rig is a 1:5 model: heights are a fifth, times are the car's
REFERENCE_PSD = {"iso_c": 256e-6, "iso_d": 1024e-6, "iso_e": 4096e-6}  # m3 at 0.1 cycles/m (ISO 8608)
REFERENCE_NUMBER = 0.1  # cycles/m
SPEED = {"iso_c": 22.0, "iso_d": 8.0, "iso_e": 2.5}  # m/s of the car: rougher roads are driven slower
BAND = (0.3, 25.0)  # Hz
ROADS = ("iso_c", "iso_d", "iso_e", "sweep", "multisine")


def road(kind: str, time: NDArray[np.float64], wheelbase: float, gain: float, seed: int) -> NDArray[np.float64]:
    """Commanded ground under both tyres, (N, 2) m; the rear follows the front by the time the wheelbase takes.

    Parameters
    ----------
    kind : one of ROADS
    time : (N,) s, equidistant
    wheelbase : of the rig, m
    gain : factor on the heights
    seed : of the phases
    """
    rng = np.random.default_rng(seed)
    curve: _Waves | _Sweep
    if kind == "sweep":
        delay, curve = 0.1143, _sweep(rng)
    elif kind == "multisine":
        delay, curve = 0.1143, _multisine(rng)
    else:
        delay, curve = wheelbase * LENGTH_SCALE / SPEED[kind], _iso(kind, rng)
        delay = min(delay, 0.4)
    heights = np.column_stack([_faded(curve, time), _faded(curve, time - delay)])
    return np.ascontiguousarray(gain * heights)


def valve_steps(time: NDArray[np.float64], size: float, seed: int) -> NDArray[np.float64]:
    """Relative steps on both inlets, (N, 2): random levels within +-``size``, each held 0.1 to 0.5 s."""
    rng = np.random.default_rng(seed)
    out = np.zeros((len(time), 2))
    for end in range(2):
        edges = STILL + np.cumsum(rng.uniform(0.1, 0.5, int(time[-1] / 0.1) + 2))
        levels = rng.uniform(-size, size, len(edges) + 1)
        levels[0] = 0.0
        out[:, end] = np.where(time < STILL, 0.0, levels[np.searchsorted(edges, time)])
    return out


def valve_waves(time: NDArray[np.float64], size: float, seed: int) -> NDArray[np.float64]:
    """Relative multisine on both inlets, (N, 2), 0.3 to 8 Hz, largest value about ``size``."""
    rng = np.random.default_rng(seed)
    out = np.zeros((len(time), 2))
    for end in range(2):
        frequencies = np.exp(rng.uniform(np.log(0.3), np.log(8.0), 9))
        phases = rng.uniform(0.0, 2.0 * np.pi, 9)
        wave = np.sin(2.0 * np.pi * frequencies * time[:, None] + phases).sum(axis=1)
        out[:, end] = size * wave / np.abs(wave).max() * _fade(time)
    return out


class _Waves:
    """Sum of sines, callable at any time."""

    def __init__(self, amplitudes: NDArray[np.float64], frequencies: NDArray[np.float64], phases: NDArray[np.float64]):
        self.amplitudes, self.frequencies, self.phases = amplitudes, frequencies, phases

    def __call__(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        angles = 2.0 * np.pi * np.outer(time, self.frequencies) + self.phases
        return np.asarray(np.sin(angles) @ self.amplitudes)


class _Sweep:
    """Logarithmic sweep whose speed is bounded."""

    def __init__(self, low: float, high: float, duration: float, height: float, speed: float):
        self.low, self.rate = low, np.log(high / low) / duration
        self.height, self.speed = height, speed

    def __call__(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        frequency = self.low * np.exp(self.rate * time)
        angle = 2.0 * np.pi * (frequency - self.low) / self.rate
        return np.minimum(self.height, self.speed / (2.0 * np.pi * frequency)) * np.sin(angle)


def _iso(kind: str, rng: np.random.Generator) -> _Waves:
    edges = np.geomspace(*BAND, 201)
    frequencies = np.sqrt(edges[:-1] * edges[1:]) * rng.uniform(0.98, 1.02, 200)
    psd = REFERENCE_PSD[kind] * REFERENCE_NUMBER**2 * SPEED[kind] / frequencies**2  # m2/Hz
    amplitudes = np.sqrt(2.0 * psd * np.diff(edges)) / LENGTH_SCALE
    return _Waves(amplitudes, frequencies, rng.uniform(0.0, 2.0 * np.pi, 200))


def _multisine(rng: np.random.Generator) -> _Waves:
    frequencies = np.geomspace(0.5, 18.0, 25) * rng.uniform(0.97, 1.03, 25)
    amplitudes = np.minimum(1.0e-3, 0.02 / (2.0 * np.pi * frequencies))
    return _Waves(amplitudes, frequencies, rng.uniform(0.0, 2.0 * np.pi, 25))


def _sweep(rng: np.random.Generator) -> _Sweep:
    return _Sweep(rng.uniform(0.5, 0.8), rng.uniform(14.0, 18.0), 14.5, 2.0e-3, 0.05)


def _faded(curve: _Waves | _Sweep, time: NDArray[np.float64]) -> NDArray[np.float64]:
    return curve(time - STILL) * _fade(time)


def _fade(time: NDArray[np.float64]) -> NDArray[np.float64]:
    share = np.clip(time - STILL, 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)
