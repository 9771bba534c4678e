# SPDX-License-Identifier: Apache-2.0
"""Another rig: a base-excited frame whose floor rubs against a wall. What is missing in its published model, and where?

    python examples/frame_friction.py DATA_FOLDER

DATA_FOLDER holds ``frame_450g_x.mat`` and ``frame_450g_y.mat`` of github.com/l-marino/switching-GPLFM (GPL-3.0, not
part of this package): displacement of floor and base in mm, 250 Hz, 10 s, base driven at 1 Hz. Published nominal model:
M = 3.0799 kg, C = 0.6690 N s/m, K = 1191 N/m between base and floor. A brass disc of 450 g presses on a wall that
stands on the ground; its friction is not in the nominal model.

The diagnosis is :func:`pneumo_ros.diagnosis.diagnose.diagnose`, the same as for the half car. This file is all that a
rig of your own needs: a record, a model that predicts it, and effects that might be missing.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from scipy.io import loadmat
from scipy.signal import savgol_filter

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.diagnose import Options, diagnose
from pneumo_ros.diagnosis.model import PlainEffect
from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.effects.parameters import Active, EffectParameter, Parameter
from pneumo_ros.errors import InputError

FLOOR_NOISE = 2e-6  # m, laser: what fourth differences of the log show, times four for what is not white
SUBSTEPS = 4  # RK4 at 1 ms: friction that turns over within 0.5 mm/s needs steps below 3 ms
TURNOVER = 5e-4  # m/s over which dry friction changes sign: below the pixel of any rig, above what stiffens the solver

PARAMETERS = (
    Parameter("mass", "kg", 3.0799, 0.03),
    Parameter("damping", "N s/m", 0.669, 0.13),
    Parameter("stiffness", "N/m", 1191.0, 24.0),
)


EFFECTS: Mapping[str, PlainEffect] = {
    law.id: law
    for law in (
        PlainEffect("coulomb_friction", ("ground", "base"),
            (EffectParameter("friction_force", "N", 0.0, 20.0, 1.0, size=True, starts=(0.3, 3.0)),)),
        PlainEffect("viscous_damping", ("ground", "base"),
            (EffectParameter("damping", "N s/m", 0.0, 200.0, 5.0, size=True),)),
        PlainEffect("spring", ("ground", "base"),
            (EffectParameter("stiffness", "N/m", -800.0, 2000.0, 100.0, size=True),)),
        PlainEffect("hardening", ("base",),
            (EffectParameter("cubic_stiffness", "N/m3", -5e8, 5e8, 2e7, size=True),)),
        PlainEffect("sensor_scale", ("floor",), (EffectParameter("scale_error", "1", -0.6, 0.6, 0.05, size=True),)),
    )
}  # fmt: skip
ORDER = [(name, site) for name, law in EFFECTS.items() for site in law.sites if name != "sensor_scale"]


@dataclass(frozen=True)
class FrameRecord:
    """A log of the frame.

    Attributes
    ----------
    name, period : of the log; s between rows
    measured : (N, 1) displacement of the floor from the ground, m
    base : displacement and rate of the base, m and m/s, at every half integration step
    """

    name: str
    period: float
    measured: Array
    base: Array

    @property
    def weight(self) -> Array:
        """Every sample counts."""
        return np.ones_like(self.measured)

    @property
    def noise(self) -> Array:
        """Standard deviation of the floor's sensor, m."""
        return np.array([FLOOR_NOISE])

    def slice(self, first: int, last: int) -> FrameRecord:
        """Rows ``first`` to ``last`` (excluded)."""
        per = 2 * SUBSTEPS
        base = self.base[per * first : per * (last - 1) + 1]
        return FrameRecord(self.name, self.period, self.measured[first:last], base)


@dataclass(frozen=True)
class Frame:
    """The published model: m x'' = -c (x' - y') - k (x - y), x the floor and y the base, both from the ground."""

    channels: tuple[str, ...] = ("floor",)
    parameters: tuple[Parameter, ...] = PARAMETERS
    effects: Mapping[str, PlainEffect] = field(default_factory=lambda: EFFECTS)

    def initial(self, record: FrameRecord, active: Sequence[Active] = ()) -> tuple[Array, Array]:
        """Displacement and velocity at the first row, from a parabola through the first 40 ms."""
        rows = 11
        t = np.arange(rows) * record.period
        curve = np.polyfit(t, record.measured[:rows, 0], 2)
        scale = 1.0 + _scale_error(active)
        return np.array([curve[2], curve[1]]) / scale, np.array([2e-6, 4e-4])

    def predict(
        self, record: FrameRecord, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> Array:
        """Free-running floor displacement, (rows or N, 1), m."""
        count = len(record.measured) if rows is None else rows
        sizes = np.zeros(len(ORDER))
        for one in active:
            if (one.effect, one.site) in ORDER:
                sizes[ORDER.index((one.effect, one.site))] = one.values[0]
        path = _simulate(np.asarray(initial), record.base, count, record.period, np.asarray(nuisance), sizes)
        return path[:, None] * (1.0 + _scale_error(active))

    def places(self, active: Active) -> tuple[str, ...]:
        """What the effect pulls against."""
        return (f"sensor:{active.site}",) if active.effect == "sensor_scale" else (f"floor_to_{active.site}",)

    def side(self, active: Active) -> str | None:
        """The site is the side here: friction against the ground is not friction against the base."""
        return active.site


def _scale_error(active: Sequence[Active]) -> float:
    return sum(one.values[0] for one in active if one.effect == "sensor_scale")


@njit(cache=True)
def _acceleration(x: float, v: float, y: float, w: float, nuisance: Array, sizes: Array) -> float:
    """Forces in the order of ORDER: Coulomb ground, base; viscous ground, base; spring ground, base; cubic."""
    mass, damping, stiffness = nuisance
    stretch, rate = x - y, v - w
    force = -damping * rate - stiffness * stretch
    force -= sizes[0] * np.tanh(v / TURNOVER) + sizes[1] * np.tanh(rate / TURNOVER)
    force -= sizes[2] * v + sizes[3] * rate + sizes[4] * x + sizes[5] * stretch + sizes[6] * stretch**3
    return force / mass


@njit(cache=True)
def _simulate(start: Array, base: Array, count: int, period: float, nuisance: Array, sizes: Array) -> Array:
    """RK4 with the base given at half steps."""
    out = np.empty(count)
    x, v = start[0], start[1]
    h = period / SUBSTEPS
    out[0] = x
    for i in range(count - 1):
        for j in range(SUBSTEPS):
            at = 2 * (SUBSTEPS * i + j)
            y0, w0, y1, w1 = base[at, 0], base[at, 1], base[at + 1, 0], base[at + 1, 1]
            y2, w2 = base[at + 2, 0], base[at + 2, 1]
            a1 = _acceleration(x, v, y0, w0, nuisance, sizes)
            a2 = _acceleration(x + 0.5 * h * v, v + 0.5 * h * a1, y1, w1, nuisance, sizes)
            a3 = _acceleration(x + 0.5 * h * (v + 0.5 * h * a1), v + 0.5 * h * a2, y1, w1, nuisance, sizes)
            a4 = _acceleration(x + h * (v + 0.5 * h * a2), v + h * a3, y2, w2, nuisance, sizes)
            x += h * (v + h * (a1 + a2 + a3) / 6.0)
            v += h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        out[i + 1] = x
    return out


def read_record(folder: Path) -> FrameRecord:
    """The measurement, in metres; the base smoothed over 36 ms (it moves at 1 Hz) and interpolated to half steps.

    Raises
    ------
    InputError
        if the files are not there.
    """
    series = {}
    for key in ("x", "y"):
        path = folder / f"frame_450g_{key}.mat"
        if not path.is_file():
            raise InputError("measurement not found", where=path, remedy="fetch it from l-marino/switching-GPLFM")
        series[key] = loadmat(path)
    time = series["x"]["t"].ravel()
    period = float(np.median(np.diff(time)))
    x, y = series["x"]["x"].ravel() * 1e-3, series["y"]["y"].ravel() * 1e-3
    smooth = savgol_filter(y, 9, 3)
    rate = savgol_filter(y, 9, 3, deriv=1, delta=period)
    fine = np.linspace(0, len(y) - 1, 2 * SUBSTEPS * (len(y) - 1) + 1)
    rows = np.arange(len(y))
    base = np.column_stack([np.interp(fine, rows, smooth), np.interp(fine, rows, rate)])
    return FrameRecord("frame_450g", period, x[:, None], base)


def diagnose_frame(folder: Path, progress: Any | None = None) -> Diagnosis:
    """First half fitted, second half simulated freely."""
    record = read_record(folder)
    half = len(record.measured) // 2
    parts = record.slice(0, half), record.slice(half, len(record.measured))
    return diagnose(Frame(), [parts[0]], parts[1], Options(), progress)


def main() -> None:
    """Print the verdict."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder with frame_450g_x.mat and frame_450g_y.mat")
    found = diagnose_frame(parser.parse_args().folder)
    print(f"verdict      {found.verdict} ({100 * found.probability:.0f} %)")
    print("where        " + ", ".join(f"{place} {100 * share:.0f} %" for place, share in found.location))
    gap = found.gap
    print(f"gap          nominal {gap.nominal:.3f}, re-estimated {gap.refit:.3f}, best {gap.best:.3f}")
    against = {"nominal": gap.nominal, "re-estimated": gap.refit}
    print("shrink       " + ", ".join(f"{100 * (1 - gap.best / g):.0f} % of {name}" for name, g in against.items()))
    for entry in found.ranking[:6]:
        sizes = ", ".join(f"{name} {e.value:.3g} {e.unit}" for name, e in entry.parameters.items())
        print(f"  {' + '.join(entry.effects)} ({', '.join(entry.sites)}): gap {entry.gap_after:.3f}; {sizes}")


if __name__ == "__main__":
    main()
