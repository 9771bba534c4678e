# SPDX-License-Identifier: Apache-2.0
"""Small inline SVG plots: overlays of log and models, residuals, bars. No script, no outside file."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array

LEFT: Final = 62  # px, margin for the value axis [display]
RIGHT: Final = 10  # px, margin [display]
TOP: Final = 8  # px, margin [display]
BOTTOM: Final = 22  # px, margin for the time axis [display]
MAX_POINTS: Final = 700  # vertices a line is reduced to; extremes of each piece are kept [display]


class Line(NamedTuple):
    """One line of a plot: a CSS class, its name in the legend, its values (N,)."""

    style: str
    name: str
    values: Array


def plot(time: Array, lines: Sequence[Line], unit: str, width: int = 860, height: int = 190, band: float = 0.0) -> str:
    """Lines over time (N,), s; ``band`` shades +- a value about zero (sensor noise).

    Scales are linear, ticks at round numbers, the value axis carries ``unit``.
    """
    finite = np.concatenate([line.values[np.isfinite(line.values)] for line in lines])
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    low, high = min(low, -band) if band else low, max(high, band)
    pad = 0.06 * (high - low) or 1e-9
    scale = _Scale(float(time[0]), float(time[-1]), low - pad, high + pad, width, height)
    shade = ""
    if band:
        top, bottom = scale.y(band), scale.y(-band)
        shade = (
            f'<rect class="noise" x="{LEFT}" y="{top:.1f}" width="{width - LEFT - RIGHT}" height="{bottom - top:.1f}"/>'
        )
    paths = "".join(f'<path class="line {line.style}" d="{_path(time, line.values, scale)}"/>' for line in lines)
    return (
        f'<svg class="plot" viewBox="0 0 {width} {height}" role="img" aria-label="{", ".join(n.name for n in lines)}">'
        f"{shade}{_axes(scale, unit)}{paths}</svg>"
    )


class _Scale(NamedTuple):
    start: float
    end: float
    low: float
    high: float
    width: int
    height: int

    def x(self, t: Array | float) -> Array | float:
        return LEFT + (t - self.start) / max(self.end - self.start, 1e-12) * (self.width - LEFT - RIGHT)

    def y(self, value: Array | float) -> Array | float:
        return self.height - BOTTOM - (value - self.low) / (self.high - self.low) * (self.height - TOP - BOTTOM)


def _path(time: Array, values: Array, scale: _Scale) -> str:
    keep = thinned(values)
    x, y = np.asarray(scale.x(time[keep])), np.asarray(scale.y(values[keep]))
    out, pen = [], "M"
    for px, py in zip(x, y, strict=True):
        if not np.isfinite(py):
            pen = "M"
            continue
        out.append(f"{pen}{px:.1f} {py:.1f}")
        pen = "L"
    return "".join(out)


def thinned(values: Array) -> NDArray[np.intp]:
    """Indices that keep the lowest and highest value of each of about ``MAX_POINTS / 2`` pieces, in order."""
    count = len(values)
    if count <= MAX_POINTS:
        return np.arange(count)
    edges = np.linspace(0, count, MAX_POINTS // 2 + 1).astype(int)
    picked = {0, count - 1}
    for i, j in pairwise(edges.tolist()):
        piece = np.where(np.isfinite(values[i:j]), values[i:j], 0.0)
        picked |= {int(i + piece.argmin()), int(i + piece.argmax())}
    return np.array(sorted(picked))


def scatter(
    x: Array, y: Array, curve: tuple[Array, Array], labels: tuple[str, str], width: int = 560, height: int = 250
) -> str:
    """A cloud of points, the curve of its means, and zero lines; ``labels`` of the axes with their units."""
    low, high = (float(v) for v in np.quantile(y, [0.002, 0.998]))
    pad = 0.06 * (high - low) or 1e-12
    left, right = (float(v) for v in np.quantile(x, [0.002, 0.998]))
    scale = _Scale(left, max(right, left + 1e-12), low - pad, high + pad, width, height)
    keep = (x >= left) & (x <= right) & (y >= low) & (y <= high)
    picked = np.flatnonzero(keep)[:: max(1, int(keep.sum()) // MAX_POINTS)]
    dots = "".join(f"M{float(scale.x(x[k])):.1f} {float(scale.y(y[k])):.1f}h0" for k in picked)
    centres, means = curve
    points = " ".join(f"{float(scale.x(c)):.1f},{float(scale.y(m)):.1f}" for c, m in zip(centres, means, strict=True))
    zero = ""
    if scale.low < 0.0 < scale.high:
        at = float(scale.y(0.0))
        zero = f'<line class="zero" x1="{LEFT}" y1="{at:.1f}" x2="{width - RIGHT}" y2="{at:.1f}"/>'
    return (
        f'<svg class="law" viewBox="0 0 {width} {height + 16}" role="img" aria-label="{labels[1]} over {labels[0]}">'
        f'{_axes(scale, "", "")}{zero}<path class="dots" d="{dots}"/><polyline class="curve" points="{points}"/>'
        f'<text class="tick unit" x="{width - RIGHT}" y="{height + 12}" text-anchor="end">{escape(labels[0])}</text>'
        f'<text class="tick unit" x="{LEFT + 6}" y="{TOP + 10}">{escape(labels[1])}</text></svg>'
    )


def _axes(scale: _Scale, unit: str, along: str = "s") -> str:
    parts = []
    for value in ticks(scale.low, scale.high, 4):
        y = float(scale.y(value))
        parts.append(f'<line class="grid" x1="{LEFT}" y1="{y:.1f}" x2="{scale.width - RIGHT}" y2="{y:.1f}"/>')
        parts.append(f'<text class="tick" x="{LEFT - 6}" y="{y + 3.5:.1f}" text-anchor="end">{value:g}</text>')
    for t in ticks(scale.start, scale.end, 8):
        x = float(scale.x(t))
        if x > scale.width - RIGHT - 14:
            continue  # the unit stands there
        parts.append(f'<text class="tick" x="{x:.1f}" y="{scale.height - 6}" text-anchor="middle">{t:g}</text>')
    parts.append(f'<text class="tick unit" x="4" y="{TOP + 8}">{unit}</text>')
    parts.append(
        f'<text class="tick unit" x="{scale.width - RIGHT}" y="{scale.height - 6}" text-anchor="end">{along}</text>'
    )
    return "".join(parts)


def ticks(low: float, high: float, count: int) -> list[float]:
    """Round numbers (1, 2 or 5 times a power of ten apart) inside low..high, about ``count`` of them."""
    span = high - low
    if not np.isfinite(span) or span <= 0.0:
        return []
    raw = span / count
    power = 10.0 ** np.floor(np.log10(raw))
    step = float(min((m * power for m in (1.0, 2.0, 5.0, 10.0)), key=lambda s: abs(np.log(s / raw))))
    first = np.ceil(low / step - 1e-9)
    return [float(np.round(k * step, 12)) + 0.0 for k in np.arange(first, np.floor(high / step + 1e-9) + 1)]


def shrink_bar(value: float, interval: tuple[float, float], width: int = 170, height: int = 18) -> str:
    """A bar of a shrink of 0..1 with its interval as a whisker; below zero the bar is empty."""

    def x(share: float) -> float:
        return 1.0 + min(max(share, 0.0), 1.0) * (width - 2.0)

    low, high = interval
    middle = height / 2
    return (
        f'<svg class="bar" viewBox="0 0 {width} {height}" role="img" aria-label="shrink {100 * value:.0f} %">'
        f'<rect x="0.5" y="3.5" width="{width - 1}" height="{height - 7}" class="track"/>'
        f'<rect x="1" y="4" width="{x(value) - 1:.1f}" height="{height - 8}" class="fill"/>'
        f'<path class="whisker" d="M{x(low):.1f} {middle}H{x(high):.1f}M{x(low):.1f} 5V{height - 5}'
        f'M{x(high):.1f} 5V{height - 5}"/></svg>'
    )


def ladder(steps: Sequence[tuple[str, float, str]]) -> str:
    """The gap's way down on a logarithmic scale: (label, gap, CSS class) per row; a bar's row fits any screen."""
    values = [gap for _, gap, _ in steps if gap > 0.0]
    low = 10.0 ** np.floor(np.log10(min(values) * 0.9)) if values else 1e-3
    high = max(values) if values else 1.0
    rows = []
    for label, gap, style in steps:
        width = 100.0 * float(np.log(max(gap, low) / low) / np.log(high / low))
        rows.append(
            f'<div class="rung"><span class="label">{escape(label)}</span>'
            f'<span class="track"><i class="{style}" style="width:{width:.1f}%"></i></span>'
            f'<b class="value">{gap:.3g}</b></div>'
        )
    return "".join(rows)
