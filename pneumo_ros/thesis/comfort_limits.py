# SPDX-License-Identifier: Apache-2.0
"""Ride comfort by frequency: ISO 2631 (1972 limits and today's Wk), Janeway's limits, Healey's table.

All take a full-scale vertical acceleration, m/s2. Sources: Section 2.2; ISO 2631-1974 for the 1972 limits' values;
ISO 2631-1:1997, annex A for Wk.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import welch

from pneumo_ros.units import GRAVITY

# Fatigue-decreased proficiency, vertical, 4 to 8 Hz where the body is most sensitive: exposure in h -> m/s2 rms.
ISO_1972_HOURS = {1 / 60: 2.80, 16 / 60: 2.12, 25 / 60: 1.80, 1.0: 1.18, 2.5: 0.71, 4.0: 0.53, 8.0: 0.315, 24.0: 0.140}
EXPOSURE_FACTOR = 2.0  # health or safety: 6 dB up
COMFORT_FACTOR = 1.0 / 3.15  # reduced comfort: 10 dB down

JANEWAY_JERK = 12.6  # m/s3 peak, 1 to 6 Hz
JANEWAY_ACCELERATION = 0.33  # m/s2 peak, 6 to 20 Hz
JANEWAY_VELOCITY = 2.7e-3  # m/s peak, 20 to 60 Hz

HEALEY = ((0.03, "smooth", "4-5"), (0.055, "medium", "3-4"), (float("inf"), "rough", "2-3"))  # Table 2.1, rms g


@dataclass(frozen=True)
class Bands:
    """One-third-octave spectrum: centre frequencies, Hz, and rms in each band, m/s2."""

    centres: NDArray[np.float64]
    rms: NDArray[np.float64]


def third_octaves(acceleration: ArrayLike, rate: float, low: float = 1.0, high: float = 80.0) -> Bands:
    """rms of an acceleration in one-third-octave bands (base 10), from its Welch spectrum.

    Parameters
    ----------
    acceleration : (N,) m/s2
    rate : Hz; bands above 0.4 of it are left out
    low, high : first and last nominal centre, Hz
    """
    x = np.asarray(acceleration, dtype=float)
    top = min(high, 0.4 * rate)
    first, last = round(10 * np.log10(low)), int(np.floor(10 * np.log10(top) + 1e-9))
    centres = 10.0 ** (np.arange(first, last + 1) / 10.0)
    frequency, density = welch(x, rate, nperseg=min(len(x), round(8 * rate)))
    power = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(frequency))])
    edges = np.outer([10**-0.05, 10**0.05], centres)
    inside = np.interp(edges[1], frequency, power) - np.interp(edges[0], frequency, power)
    return Bands(centres, np.sqrt(inside))


def iso_1972_limit(frequency: ArrayLike, hours: float = 8.0) -> NDArray[np.float64]:
    """Limit of fatigue-decreased proficiency, vertical, m/s2 rms per one-third octave (Figure 2.3).

    Falls with sqrt(f) from 1 to 4 Hz, is flat to 8 Hz, rises with f to 80 Hz; between tabulated exposures it is
    interpolated in the logarithms.
    """
    f = np.asarray(frequency, dtype=float)
    times, levels = np.array(list(ISO_1972_HOURS)), np.array(list(ISO_1972_HOURS.values()))
    level = np.exp(np.interp(np.log(hours), np.log(times), np.log(levels)))
    return level * np.where(f < 4.0, np.sqrt(4.0 / f), np.where(f > 8.0, f / 8.0, 1.0))


def permitted_hours(bands: Bands, factor: float = 1.0) -> float:
    """Longest tabulated exposure, h, at which every band stays under ``factor`` times the 1972 limit; 0 if none."""
    times = [hours for hours in ISO_1972_HOURS if np.all(bands.rms <= factor * iso_1972_limit(bands.centres, hours))]
    return max(times, default=0.0)


def wk(frequency: ArrayLike) -> NDArray[np.float64]:
    """Magnitude of the weighting Wk (vertical, seated) of ISO 2631-1:1997 at frequencies, Hz."""
    s = 2j * np.pi * np.asarray(frequency, dtype=float)

    def w(hz: float) -> float:
        return 2.0 * np.pi * hz

    root = np.sqrt(2.0)
    high = s**2 / (s**2 + root * w(0.4) * s + w(0.4) ** 2)
    low = w(100.0) ** 2 / (s**2 + root * w(100.0) * s + w(100.0) ** 2)
    transition = (1 + s / w(12.5)) / (1 + s / (0.63 * w(12.5)) + (s / w(12.5)) ** 2)
    step = (1 + s / (0.91 * w(2.37)) + (s / w(2.37)) ** 2) / (1 + s / (0.91 * w(3.35)) + (s / w(3.35)) ** 2)
    return np.abs(high * low * transition * step * (2.37 / 3.35) ** 2)


def weighted_rms(acceleration: ArrayLike, rate: float) -> float:
    """Wk-weighted rms, m/s2, by weighting the spectrum of the whole record (no filter transient)."""
    x = np.asarray(acceleration, dtype=float)
    spectrum = np.fft.rfft(x) * wk(np.maximum(np.fft.rfftfreq(len(x), 1.0 / rate), 1e-6))
    weights = np.full(len(spectrum), 2.0)
    weights[0] = 1.0
    if len(x) % 2 == 0:
        weights[-1] = 1.0
    return float(np.sqrt(np.sum(weights * np.abs(spectrum) ** 2)) / len(x))


def janeway_use(bands: Bands) -> float:
    """Largest share of Janeway's limit used in any band (1 = at the limit), each band taken as a sine of its rms.

    Jerk rules from 1 to 6 Hz, acceleration to 20 Hz, velocity to 60 Hz (Section 2.2.2).
    """
    w, peak = 2.0 * np.pi * bands.centres, np.sqrt(2.0) * bands.rms
    use = np.where(
        bands.centres < 6.0,
        peak * w / JANEWAY_JERK,
        np.where(bands.centres < 20.0, peak / JANEWAY_ACCELERATION, peak / w / JANEWAY_VELOCITY),
    )
    inside = (bands.centres > 0.99) & (bands.centres <= 60.0)
    return float(np.max(use[inside]))


def healey(vertical_rms: float) -> tuple[str, str]:
    """Kind of road and rating range of Table 2.1 for a full-scale vertical rms, m/s2."""
    g = vertical_rms / GRAVITY
    return next((road, rating) for bound, road, rating in HEALEY if g < bound or bound == float("inf"))
