# SPDX-License-Identifier: Apache-2.0
"""Which law closes the gap of a table, judged on payloads that nothing was fitted to.

Each of the four payload columns is held out in turn; a law is fitted to the other three. The gap is the rms of
log(predicted/printed) over the standard deviation of the table's logarithm, so 1 means: as wrong as saying the mean.
Which law is *chosen* for a column is decided inside the three others (each of them held out once more), so that the
chosen gap is honest as well.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from pneumo_ros.arrays import Array
from pneumo_ros.thesis.bench_tables.data import Bench, load_bench
from pneumo_ros.thesis.bench_tables.laws import LAWS, NUISANCE, Law

REACH = 3.0  # sigmas of its tolerance that a number of the bench may move
MARGIN = 0.9  # a law with more parameters must leave less than this share of the gap that one with fewer leaves
TRUST = {
    "frequency": 0.02,
    "damping": 0.05,
}  # relative: how well a printed value is known; weighs data against tolerances


@dataclass(frozen=True)
class Judged:
    """A law on a table.

    Attributes
    ----------
    law : what competes
    gap : held-out gap over all payloads
    by_payload : (4,) held-out gap of each
    parameters : name -> (value fitted to the whole table, lowest and highest over the four folds)
    """

    law: Law
    gap: float
    by_payload: Array
    parameters: Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True)
class TableDiagnosis:
    """One table's competition.

    Attributes
    ----------
    table : "frequency" (Table 5.4) or "damping" (Table 5.5)
    nominal : gap of the nominal model, nothing fitted
    refit : gap with parameters re-estimated inside their tolerances
    laws : every law, the smallest held-out gap first
    chosen : law chosen inside the other columns, by held-out payload
    chosen_gap : gap of these choices
    """

    table: str
    nominal: float
    refit: float
    laws: tuple[Judged, ...]
    chosen: tuple[str, ...]
    chosen_gap: float

    @property
    def verdict(self) -> str:
        """The law chosen for most payloads; "unknown" if no law is chosen for three of four."""
        name, count = Counter(self.chosen).most_common(1)[0]
        return ("none" if name == "nominal" else name) if count >= 3 else "unknown"

    def shrink(self, judged: Judged) -> float:
        """1 - gap/gap of the refit."""
        return 1.0 - judged.gap / self.refit

    def to_json(self) -> dict[str, Any]:
        """Plain mapping."""
        return {
            "table": self.table,
            "verdict": self.verdict,
            "chosen_by_payload": list(self.chosen),
            "gap": {"nominal": self.nominal, "refit": self.refit, "best": self.laws[0].gap, "chosen": self.chosen_gap},
            "ranking": [
                {
                    "effect": j.law.id,
                    "meaning": j.law.summary,
                    "gap_after": j.gap,
                    "shrink": self.shrink(j),
                    "gap_by_payload": j.by_payload.tolist(),
                    "parameters": {
                        p.name: {
                            "value": j.parameters[p.name][0],
                            "folds": list(j.parameters[p.name][1:]),
                            "unit": p.unit,
                        }
                        for p in j.law.parameters
                    },
                }
                for j in self.laws
            ],
        }


def _spread(values: tuple[float, float, float], unit: str) -> dict[str, Any]:
    return {"value": values[0], "folds": list(values[1:]), "unit": unit}


def diagnose_tables() -> dict[str, TableDiagnosis]:
    """Both tables: what the Chapter 5 model misses, and how far each law shrinks it."""
    bench = load_bench()
    return {table: diagnose_table(bench, table) for table in LAWS}


def diagnose_table(bench: Bench, table: str) -> TableDiagnosis:
    """One table's competition; ``table`` "frequency" or "damping"."""
    comparison = _Comparison(bench, table)
    columns = range(bench.mass.shape[1])
    judged = sorted((comparison.judged(law) for law in LAWS[table]), key=lambda j: j.gap)
    nominal = next(law for law in LAWS[table] if law.id == "nominal")
    chosen = [comparison.chosen([c for c in columns if c != held]) for held in columns]
    squares = [comparison.error(law, [c for c in columns if c != held], held) ** 2 for held, law in enumerate(chosen)]
    bare = comparison.predicted(nominal, np.array([p.nominal for p in NUISANCE[table]]))
    return TableDiagnosis(
        table,
        float(np.sqrt(np.mean(np.log(bare / comparison.printed) ** 2)) / comparison.scale),
        next(j.gap for j in judged if j.law.id == "nominal"),
        tuple(judged),
        tuple(law.id for law in chosen),
        float(np.sqrt(np.mean(squares))),
    )


class _Comparison:
    """Fits of laws to some columns of a table, remembered."""

    def __init__(self, bench: Bench, table: str) -> None:
        self.bench, self.table = bench, table
        self.printed = bench.frequency if table == "frequency" else bench.damping
        self.scale = float(np.std(np.log(self.printed)))
        self._fits: dict[tuple[str, tuple[int, ...]], Array] = {}

    def names(self, law: Law) -> list[str]:
        """Nuisance and effect parameters, in the fit's order."""
        return [p.name for p in NUISANCE[self.table]] + [p.name for p in law.parameters]

    def predicted(self, law: Law, values: Array) -> Array:
        """(5, 4) for parameter values in the order of :meth:`names`."""
        return law.predict(self.bench, dict(zip(self.names(law), values.tolist(), strict=True)))

    def fit(self, law: Law, columns: Sequence[int]) -> Array:
        """Values that fit some columns: nuisance held by its tolerance, effects free between their bounds."""
        key = (law.id, tuple(columns))
        if key not in self._fits:
            self._fits[key] = self._fitted(law, list(columns))
        return self._fits[key]

    def _fitted(self, law: Law, columns: list[int]) -> Array:
        own = NUISANCE[self.table]
        low = np.array([p.nominal - REACH * p.std for p in own] + [p.low for p in law.parameters])
        high = np.array([p.nominal + REACH * p.std for p in own] + [p.high for p in law.parameters])
        start = np.array([p.nominal for p in own] + [p.typical for p in law.parameters])
        unit = np.array([p.std for p in own] + [0.05 * (p.high - p.low) for p in law.parameters])

        def residual(scaled: Array) -> Array:
            values = scaled * unit
            error = np.log(self.predicted(law, values) / self.printed)[:, columns].ravel() / TRUST[self.table]
            prior = (values[: len(own)] - start[: len(own)]) / unit[: len(own)]
            return np.concatenate([error, prior])

        found = least_squares(residual, start / unit, bounds=(low / unit, high / unit), diff_step=1e-3)
        return np.asarray(found.x * unit)

    def error(self, law: Law, fitted: Sequence[int], held: int) -> float:
        """Gap of a held-out column after a fit to others."""
        error = np.log(self.predicted(law, self.fit(law, fitted)) / self.printed)[:, held]
        return float(np.sqrt(np.mean(error**2)) / self.scale)

    def gap(self, law: Law, columns: Sequence[int]) -> float:
        """Gap over columns, each held out once."""
        errors = [self.error(law, [c for c in columns if c != held], held) for held in columns]
        return float(np.sqrt(np.mean(np.square(errors))))

    def chosen(self, columns: Sequence[int]) -> Law:
        """The law with the fewest parameters that no larger one beats by :data:`MARGIN`, judged inside ``columns``."""
        best, level = None, np.inf
        for law in sorted(LAWS[self.table], key=lambda law: (len(law.parameters), self.gap(law, columns))):
            gap = self.gap(law, columns)
            if best is None or gap < level * (MARGIN if len(law.parameters) > len(best.parameters) else 1.0):
                best, level = law, gap
        assert best is not None
        return best

    def judged(self, law: Law) -> Judged:
        """A law with its gaps and how its parameters vary over the folds."""
        columns = list(range(self.bench.mass.shape[1]))
        errors = np.array([self.error(law, [c for c in columns if c != held], held) for held in columns])
        folds = np.array([self.fit(law, [c for c in columns if c != held]) for held in columns])
        whole = self.fit(law, columns)
        names = self.names(law)
        spread = {
            name: (float(whole[k]), float(folds[:, k].min()), float(folds[:, k].max())) for k, name in enumerate(names)
        }
        return Judged(law, float(np.sqrt(np.mean(errors**2))), errors, spread)
