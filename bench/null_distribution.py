# SPDX-License-Identifier: Apache-2.0
"""What effects that are not there win by: the null distribution behind the thresholds of diagnosis/search/selection.py.

Each seed draws a rig inside its tolerances, simulates two logs of it (sensor noise, commands that jump between the
rows as the logs of a 1 kHz controller do) and lets the competition run: once with no effect (what does the best single
win over the refit?), once with one effect of the library (what does the best pair win over the best single?). The
table goes to config/tables/diagnosis_null.csv, which
:func:`pneumo_ros.diagnosis.search.selection.null_thresholds` reads.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.half_car.signals import COMMANDS, MEASURED, ROADS, Signals, TopicData, prepare
from pneumo_ros.diagnosis.search.competition import compete, run_pairs
from pneumo_ros.diagnosis.search.selection import Scored, advantage, score
from pneumo_ros.diagnosis.search.state import Effort, Search
from pneumo_ros.effects.parameters import Active, is_law
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.files import new_file
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig
from pneumo_ros.workers import run_each

SECONDS, RATE = 10.0, 500.0
TABLE = Path(__file__).resolve().parent.parent / "config" / "tables" / "diagnosis_null.csv"
COLUMNS = ("seed", "added", "truth", "advantage", "fall", "cost", "relief")


def excitation(rng: np.random.Generator, model: RigModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Road (N, 2), commands at 1 kHz (2N, 4), and those rows that a 500 Hz log shows (N, 4)."""
    count = round(SECONDS * RATE)
    t = np.arange(count) / RATE
    frequencies = np.geomspace(0.4, 18.0, 24)
    phases = rng.uniform(0.0, 2.0 * np.pi, (2, 24))
    road = np.zeros((count, 2))
    for f, phase in zip(frequencies, phases.T, strict=True):
        road += 2.2e-3 / (1.0 + f) * np.sin(2.0 * np.pi * f * t[:, None] + phase) * np.minimum(t, 1.0)[:, None]
    fast = np.tile(trim(model.rig).command, (2 * count, 1))
    for column in (0, 1):
        level, row = 1.0, 0
        while row < 2 * count:
            hold = int(rng.integers(100, 600))
            fast[row : row + hold, column] *= level
            level, row = rng.uniform(0.75, 1.25), row + hold
    return road, fast, fast[::2]


def make_log(model: RigModel, nuisance: np.ndarray, active: Sequence[Active], seed: int) -> Signals:
    """A log of the model itself with sensor noise."""
    rng = np.random.default_rng(seed)
    road, fast, shown = excitation(rng, model)
    rest = trim(model.rig).state
    blank = _signals(model, np.tile(model.simulate_channels(rest), (len(road), 1)), road, shown, rng)
    true = replace(blank, commands=fast.reshape(-1, 2, 4).mean(axis=1))
    return _signals(model, model.simulate(true, nuisance, rest, active), road, shown, rng)


def _signals(
    model: RigModel, clean: np.ndarray, road: np.ndarray, commands: np.ndarray, rng: np.random.Generator
) -> Signals:
    rig = model.rig
    noise = np.array([rig.displacement_noise.value] * 4 + [rig.pressure_noise.value] * 2)
    y = clean + rng.normal(size=clean.shape) * noise
    t = np.arange(len(y)) / RATE
    return prepare(
        {
            "/road/profile": TopicData(t, dict(zip(ROADS, road.T, strict=True))),
            "/valve/command": TopicData(t, dict(zip(COMMANDS, commands.T, strict=True))),
            "/rig/displacement": TopicData(t, dict(zip(MEASURED[:4], y[:, :4].T, strict=True))),
            "/rig/front/pressure": TopicData(t, {"pressure": y[:, 4]}),
            "/rig/rear/pressure": TopicData(t, {"pressure": y[:, 5]}),
        },
        rig,
        "simulated",
    )


def drawn(model: RigModel, rng: np.random.Generator) -> np.ndarray:
    """Nuisance values inside the tolerances, cut at 2.5 sigma."""
    sigmas = np.clip(rng.normal(size=len(model.parameters)), -2.5, 2.5)
    return np.array([p.nominal + p.std * s for p, s in zip(model.parameters, sigmas, strict=True)])


def drawn_effect(model: RigModel, rng: np.random.Generator) -> Active:
    """A random effect at a random site, between half and four times its typical size."""
    effect = model.library[str(rng.choice(sorted(name for name in model.library if is_law(name))))]
    size = float(np.exp(rng.uniform(np.log(0.5), np.log(4.0))))
    values = [float(np.clip(p.typical * size, p.low, p.high)) if p.size else p.typical for p in effect.parameters]
    return Active(effect.id, str(rng.choice(effect.sites)), tuple(values))


def win(poorer: Scored, richer: Scored) -> tuple[float, float, float, float]:
    """Advantage, fall of level, of training cost, and of stretched tolerances."""
    return (
        advantage(poorer, richer),
        poorer.level - richer.level,
        poorer.fit.cost - richer.fit.cost,
        poorer.stretch - richer.stretch,
    )


def best_of(search: Search, size: int) -> Scored | None:
    """The structure of that many effects with the lowest level on the selection blocks."""
    scored = [score(search.problem, f) for f in search.finalists if len(f.candidate.laws) == size]
    return min(scored, key=lambda s: s.level, default=None)


def row(seed: int, added: int) -> list[object]:
    """One row of the table: the best win of an effect that is not there, as the ``added``-th one."""
    model = RigModel(load_rig())
    rng = np.random.default_rng([2026, seed])
    nuisance, effect = drawn(model, rng), drawn_effect(model, rng)
    truth = (effect,) if added == 2 else ()
    problem = Problem(model, (make_log(model, nuisance, truth, seed),))
    search = compete(problem, Effort(), False, lambda share, what: None)
    if truth:  # also where a diagnosis would look for no second effect, because too little is left
        run_pairs(search)
    poorer = best_of(search, 1) if truth else score(search.problem, search.refit)
    richer = best_of(search, added)
    if poorer is None or richer is None:
        raise RuntimeError(f"seed {seed}: no structure of {added} effects was fitted")
    label = " ".join(f"{a.effect}:{a.site}" for a in truth) or "none"
    return [seed, added, label, *(round(v, 4) for v in win(poorer, richer))]


def leave(place: Path, key: tuple[int, int]) -> None:
    """Leave one row in a file of its own, whole or not at all; a row that is there is not made again."""
    file = place / f"{key[0]}-{key[1]}.json"
    if not file.exists():
        with new_file(file) as part:
            part.write_text(json.dumps(row(*key)), encoding="utf-8")


def main() -> None:
    """Make the rows that are missing and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--rows", type=Path, default=Path("null_rows"), help="folder of the rows made so far")
    parser.add_argument("--output", type=Path, default=TABLE)
    options = parser.parse_args()
    options.rows.mkdir(parents=True, exist_ok=True)
    keys = [(seed, added) for seed in range(options.seeds) for added in (1, 2)]
    for key, error in run_each(partial(leave, options.rows), keys, options.workers):
        print(*key, error or "done", flush=True)
    made = [options.rows / f"{seed}-{added}.json" for seed, added in keys]
    missing = [file.name for file in made if not file.exists()]
    if missing:
        raise SystemExit(f"{len(missing)} rows are missing, no table written: {', '.join(missing)}")
    rows = [json.loads(file.read_text(encoding="utf-8")) for file in made]
    with options.output.open("w", newline="", encoding="utf-8") as handle:
        csv.writer(handle, lineterminator="\n").writerows([COLUMNS, *rows])


if __name__ == "__main__":
    main()
