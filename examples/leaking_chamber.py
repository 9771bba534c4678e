# SPDX-License-Identifier: Apache-2.0
"""Another rig: compressed-air chambers, shut after filling. Which of them leaks, and how fast?

    python examples/leaking_chamber.py DATA_FOLDER

DATA_FOLDER holds ``chamber_*.csv`` of github.com/EvaZillen/3D-printed-pneumatic-actuator (CC0, not part of this
package): time in ms (1.003.000 is 1003 ms), transducer in V, gauge pressure in bar, 10 readings a second for 140 s.
Nominal model: the chamber is tight, the pressure stays.

The aluminium chamber is the control. Its slope is statistically beyond doubt and physically of no account, so the
question must be put in terms of size: a chamber counts as tight if it loses at most 0.5 % of its (absolute) pressure in
140 s. That is the tolerance of the nominal model's only parameter, and what stays inside a tolerance is no unmodelled
effect.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.diagnose import Options, diagnose
from pneumo_ros.diagnosis.fit.pace import HALF_CAR
from pneumo_ros.diagnosis.fit.problem import REACH
from pneumo_ros.diagnosis.model import PlainEffect
from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.diagnosis.search.selection import Thresholds
from pneumo_ros.effects.parameters import Active, EffectParameter, Parameter
from pneumo_ros.errors import InputError
from pneumo_ros.units import ATMOSPHERE

BAR = 1e5  # Pa
TIGHT = 0.005  # share of the absolute pressure that a tight chamber may lose ...
HOLD = 140.0  # s ... in this time
WANDER = 300.0  # Pa: how the reading of the tight chamber wanders about its own trend, over seconds

# Seventy seconds of one slow channel are worth about ten independent readings, against some hundred of a half car's
# log; the cost by which an effect must win shrinks with them.
EVIDENCE = Thresholds(first_cost=6.0)
# The fit keeps a parameter within REACH standard deviations: the bound is what still counts as tight.
PARAMETERS = (Parameter("seepage", "1/s", 0.0, TIGHT / HOLD / REACH),)


EFFECTS: Mapping[str, PlainEffect] = {
    law.id: law
    for law in (
        # Choked outflow from a fixed volume: the pressure falls in proportion to itself.
        PlainEffect("leak", ("chamber",), (
            EffectParameter("rate", "1/s", 0.0, 0.05, 1e-4, size=True, starts=(1e-5, 1e-3)),
        )),
        # Air heated by filling cools down to the wall: a fall that ends. Conduction alone, across 1 cm of air at 8 bar,
        # takes 4 s (L^2 / (pi^2 a), a = 2.7e-6 m2/s); convection is quicker.
        PlainEffect("cooling", ("chamber",), (
            EffectParameter("warmth", "1", 0.0, 0.1, 3e-3, size=True),
            EffectParameter("time_constant", "s", 0.5, 10.0, 4.0, starts=(1.0, 8.0)),
        )),
    )
}  # fmt: skip


@dataclass(frozen=True)
class ChamberRecord:
    """Pressure of one chamber: measured (N, 1) Pa absolute, s between rows, and since when it has been shut, s."""

    name: str
    period: float
    measured: Array
    since: float = 0.0

    @property
    def weight(self) -> Array:
        """Every sample counts."""
        return np.ones_like(self.measured)

    @property
    def noise(self) -> Array:
        """Standard deviation of the reading, Pa; slow, so that the fit's averaging must not take it for white."""
        return np.array([WANDER * np.sqrt(HALF_CAR.averaged)])

    def slice(self, first: int, last: int) -> ChamberRecord:
        """Rows ``first`` to ``last`` (excluded)."""
        later = self.since + first * self.period
        return ChamberRecord(self.name, self.period, self.measured[first:last], later)

    def averaged(self, count: int) -> ChamberRecord:
        """Means of ``count`` rows."""
        rows = len(self.measured) // count
        means = self.measured[: rows * count].reshape(rows, count).mean(axis=1)[:, None]
        later = self.since + 0.5 * (count - 1) * self.period
        return ChamberRecord(self.name, self.period * count, means, later)


@dataclass(frozen=True)
class Chamber:
    """A tight chamber: p' = -(seepage + leak) p - cooling, p absolute; seepage is 0 within its tolerance."""

    channels: tuple[str, ...] = ("pressure",)
    parameters: tuple[Parameter, ...] = PARAMETERS
    effects: Mapping[str, PlainEffect] = field(default_factory=lambda: EFFECTS)

    def initial(self, record: ChamberRecord, active: Sequence[Active] = ()) -> tuple[Array, Array]:
        """Pressure over the first five seconds and how well their mean is known, Pa."""
        rows = record.measured[:5, 0]
        return np.array([rows.mean()]), record.noise / np.sqrt(len(rows))

    def predict(
        self, record: ChamberRecord, nuisance: Array, initial: Array, active: Sequence[Active], rows: int | None = None
    ) -> Array:
        """Pressure, (rows or N, 1), Pa absolute: the equation's exact solution."""
        time = np.arange(len(record.measured) if rows is None else rows) * record.period
        rate = float(nuisance[0]) + sum(one.values[0] for one in active if one.effect == "leak")
        pressure = initial[0] * np.exp(-rate * time)
        for one in active:
            if one.effect == "cooling":
                warmth, constant = one.values
                left = np.exp(-(record.since + time) / constant) - np.exp(-record.since / constant)
                pressure = pressure + initial[0] * warmth * left
        return pressure[:, None]

    def places(self, active: Active) -> tuple[str, ...]:
        """One chamber, one place."""
        return ("chamber",)

    def side(self, active: Active) -> str | None:
        """No sides."""
        return None


def _row(line: str) -> tuple[float, float, float]:
    """Time s, transducer V, pressure bar; the time is written 151.303.000 for 151303.000 ms."""
    time, volts, pressure = line.split(";")
    return int(time.replace(".", "")) * 1e-6, float(volts), float(pressure)


def read_record(path: Path) -> ChamberRecord:
    """One chamber's log.

    Raises
    ------
    InputError
        if the file is not there or holds no readings.
    """
    if not path.is_file():
        raise InputError(
            "measurement not found", where=path, remedy="fetch it from EvaZillen/3D-printed-pneumatic-actuator"
        )
    table = np.array([_row(line) for line in path.read_text().split() if line.count(";") == 2])
    if len(table) < 200:
        raise InputError("too few readings", where=path, value=len(table), allowed="at least 200")
    period = float(np.median(np.diff(table[:, 0])))
    return ChamberRecord(path.stem, period, table[:, 2:3] * BAR + ATMOSPHERE)


def diagnose_chamber(path: Path) -> Diagnosis:
    """First half fitted, second half (means of a second) predicted from its own first moments."""
    record = read_record(path)
    cut = len(record.measured) // 2
    late = record.slice(cut, len(record.measured)).averaged(round(1.0 / record.period))
    return diagnose(Chamber(), [record.slice(0, cut)], late, Options(pairs=False, limits=EVIDENCE))


def main() -> None:
    """One line a chamber."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder with chamber_*.csv")
    paths = sorted(parser.parse_args().folder.glob("chamber_*.csv"))
    if not paths:
        raise InputError("no chamber_*.csv found", where=parser.parse_args().folder)
    for path in paths:
        found = diagnose_chamber(path)
        gap, total = found.gap, sum(e.value for n, e in found.nuisance.items() if n == "seepage")
        total += sum(one.values[0] for one in found.active if one.effect == "leak")
        shrink = 100 * (1 - gap.best / gap.nominal)
        print(
            f"{path.stem:24s} {found.verdict:6s} {100 * found.probability:3.0f} %   loses {100 * total * HOLD:.2f} %",
            end="",
        )
        print(f" in {HOLD:.0f} s   gap {gap.nominal:.3f} -> {gap.refit:.3f} -> {gap.best:.3f}   shrink {shrink:.0f} %")


if __name__ == "__main__":
    main()
