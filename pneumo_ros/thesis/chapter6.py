# SPDX-License-Identifier: Apache-2.0
"""Chapter 6: roads, the quarter car's controllers and estimators, the half car."""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from pneumo_ros.road import ISO_MEAN, LENGTH_SCALE, iso_psd, make_road
from pneumo_ros.thesis import chapter6_half, chapter6_quarter
from pneumo_ros.thesis.report import Chapter, Claim, Picture, Step, Table, canvas, verdict
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.units import KMH

STEPS = 1 + chapter6_quarter.STEPS + chapter6_half.STEPS
CHECK_RATE, CHECK_TIME, CHECK_SEGMENT = 125.0, 300.0, 4.0  # Hz, s, s
CHECK_GROUPS = 24  # the band in as many parts; a single Welch bin holds too few cosines to mean anything


def build(settings: ThesisSettings, step: Step) -> Chapter:
    """The chapter's tables, pictures and claims."""
    step("roads A to H against Eq. 6.1")
    road_claim, road_picture = _roads(settings)
    quarter_claims, quarter_tables, quarter_pictures = chapter6_quarter.build_quarter(settings, step)
    half_claims, half_tables, half_pictures = chapter6_half.build_half(settings, step)
    lead = (
        f"Class {settings.iso_class} at {settings.speed_kmh:g} km/h, {settings.low_hz:g} to {settings.high_hz:g} Hz, "
        f"{settings.seeds} roads; rms after {settings.settle:g} s, times 5 for full scale. The quarter car's mass, "
        f"outlet and "
        "start height and the road's band are not in the thesis (errata 17): claims are judged as orderings and "
        "ratios, "
        "and a claim that fails says why."
    )
    return Chapter(
        6,
        "Nonlinear control of pneumatic suspensions",
        lead,
        (road_claim, *quarter_claims, *half_claims),
        (_road_table(), *quarter_tables, *half_tables),
        (road_picture, *quarter_pictures, *half_pictures),
    )


def spectrum_error(settings: ThesisSettings, iso_class: str) -> tuple[float, np.ndarray, np.ndarray]:
    """Largest difference of a class's spectrum from Eq. 6.1, dB, over the band; frequency and density, m2/Hz, of it."""
    spec = settings.road(1, iso_class=iso_class)
    heights, _ = make_road(spec).sample(np.arange(0.0, CHECK_TIME, 1.0 / CHECK_RATE))
    frequency, density = welch(heights[:, 0] * LENGTH_SCALE, CHECK_RATE, nperseg=round(CHECK_SEGMENT * CHECK_RATE))
    inside = (frequency > settings.low_hz + 0.5) & (frequency < settings.high_hz - 0.5)
    level = 10.0 * np.log10(density[inside] / iso_psd(frequency[inside], iso_class, settings.speed_kmh * KMH))
    worst = max(abs(float(part.mean())) for part in np.array_split(level, CHECK_GROUPS))
    return worst, frequency[inside], density[inside]


def _road_table() -> Table:
    rows = [[name, f"{1e6 * mean:g}"] for name, mean in ISO_MEAN.items()]
    return Table(
        "Table 6.1: roads",
        ["class", "G(Omega_0), 1e-6 m3/cycle"],
        rows,
        "means as printed; H continues the factor of 4",
    )


def _roads(settings: ThesisSettings) -> tuple[Claim, Picture]:
    figure, axes = canvas(1, 1)
    worst = 0.0
    for iso_class in ISO_MEAN:
        error, frequency, density = spectrum_error(settings, iso_class)
        worst = max(worst, error)
        axes[0].loglog(frequency, density, lw=0.7, label=iso_class)
        axes[0].loglog(frequency, iso_psd(frequency, iso_class, settings.speed_kmh * KMH), "k--", lw=0.5)
    axes[0].set(xlabel="Hz", ylabel="full-scale PSD, m2/Hz")
    axes[0].legend(ncols=4, fontsize=7)
    claim = verdict(
        "road-psd",
        f"within {worst:.2f} dB over the band (Welch)",
        worst < 1.0,
        "G is per cycle while Omega_0 is in rad/m; H continues the factor of 4 between classes",
    )
    return claim, Picture("Figures 6.1, 6.2: road spectra", figure, "solid: simulated; dashed: Eq. 6.1")
