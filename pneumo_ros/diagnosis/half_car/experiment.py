# SPDX-License-Identifier: Apache-2.0
"""The experiment that would split an ambiguity group: profiles ranked by how far they drive the rivals apart."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.experiment import NextExperiment
from pneumo_ros.diagnosis.experiment import separation as separation_of
from pneumo_ros.diagnosis.fit.problem import Problem
from pneumo_ros.diagnosis.fit.solver import Fit
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.files import new_file
from pneumo_ros.plant.trim import Trim, trim

DURATION: Final = 12.0  # s, of a proposed experiment [taste]
PERIOD: Final = 2e-3  # s between rows of a proposed experiment [definition]
ROAD_FILE: Final = "next_experiment_road.csv"  # name of a file beside the report [definition]
VALVE_FILE: Final = "next_experiment_valves.csv"  # name of a file beside the report [definition]


@dataclass(frozen=True)
class Experiment(NextExperiment):
    """What to run to split an ambiguity group: a profile of road and valves, with how far it drives the rivals
    apart.
    """

    time: Array  # (N,) s
    road: Array  # (N, 2) m
    valves: Array  # (N, 4) m2
    kind: ClassVar[str] = "road and valve profiles"

    def write(self, folder: Path) -> list[Path]:
        """The profile as two tables: what ``pneumo run`` plays as ``--road`` and as ``--valves``."""
        columns_of = "time_s,front_inlet_m2,rear_inlet_m2,front_outlet_m2,rear_outlet_m2"
        tables = {
            ROAD_FILE: ("time_s,front_m,rear_m", self.road),
            VALVE_FILE: (f"# interpolation: held\n{columns_of}", self.valves),
        }
        for name, (header, columns) in tables.items():
            with new_file(folder / name) as part:
                np.savetxt(part, np.column_stack([self.time, columns]), "%.9g", ",", header=header, comments="")
        return [folder / name for name in tables]

    def command(self, folder: Path = Path()) -> str:
        """What plays both tables of a folder."""
        files = f"--road {folder / ROAD_FILE} --valves {folder / VALVE_FILE}"
        step = float(self.time[1] - self.time[0]) if len(self.time) > 1 else 0.0
        return f"pneumo run {files} --duration {float(self.time[-1]) + step:g}"

    def to_json(self) -> dict[str, Any]:
        """Without the profile, which has files of its own."""
        return {
            "text": f"{self.aim}; {self.command()} plays it",
            "command": self.command(),
            "file": ROAD_FILE,
            "valve_file": VALVE_FILE,
            "name": self.name,
            "description": self.description,
            "separation": self.separation,
            "separation_now": self.separation_now,
            "splits": list(self.splits),
        }


@dataclass(frozen=True)
class Profile:
    """A road and valve profile with a sentence for the person who runs it."""

    name: str
    description: str
    road: Callable[[Array], Array]  # t (N,) -> (N, 2) m
    valves: Callable[[Array], Array]  # t (N,) -> (N, 4) factor on the trimmed openings, inlets then outlets


def _flat(t: Array) -> Array:
    return np.zeros((len(t), 2))


def _trimmed(t: Array) -> Array:
    return np.ones((len(t), 4))


def _closed(t: Array) -> Array:
    """Trimmed for a second, then nothing flows."""
    return np.repeat(np.where(t < 1.0, 1.0, 0.0)[:, None], 4, axis=1)


def _half(t: Array) -> Array:
    """Inlets and outlets together at whole and half openings, so that the rig keeps its height."""
    return np.repeat(np.where(np.mod(t, 3.0) < 1.5, 1.0, 0.5)[:, None], 4, axis=1)


def _pulses(t: Array) -> Array:
    """Each outlet closed for 0.25 s in turn."""
    closed = [np.mod(t - shift, 2.0) < 0.25 for shift in (0.5, 1.5)]
    return np.column_stack([np.ones((len(t), 2)), np.where(np.column_stack(closed), 0.0, 1.0)])


def _sweep(amplitude: float, low: float, high: float) -> Callable[[Array], Array]:
    def road(t: Array) -> Array:
        rate = float(np.log(high / low)) / DURATION
        phase: Array = 2.0 * np.pi * low * (np.exp(rate * t) - 1.0) / rate
        return amplitude * np.column_stack([np.sin(phase), np.sin(phase - 0.7)])

    return road


def _bumps(height: float) -> Callable[[Array], Array]:
    def road(t: Array) -> Array:
        late = [np.mod(t - shift, 2.0) for shift in (0.5, 1.5)]
        return np.column_stack([np.where(x < 0.15, height * np.sin(np.pi * x / 0.15) ** 2, 0.0) for x in late])

    return road


def _slow(amplitude: float) -> Callable[[Array], Array]:
    def road(t: Array) -> Array:
        return amplitude * np.column_stack([np.sin(2 * np.pi * 0.4 * t), np.sin(2 * np.pi * 0.3 * t)])

    return road


def _steps(size: float, hold: float) -> Callable[[Array], Array]:
    def valves(t: Array) -> Array:
        pattern = np.array([0.0, 1.0, -0.6, 0.5, -1.0, 0.8, -0.3, 0.0])
        rows = (t / hold).astype(int)
        inlets = 1.0 + size * np.column_stack([pattern[rows % 8], pattern[(rows + 3) % 8]])
        return np.hstack([inlets, np.ones_like(inlets)])

    return valves


def _switched(hold: float, seed: int = 1) -> Callable[[Array], Array]:
    """Inlets shut and at twice their openings at random, each for ``hold`` s or more, as often shut as open."""

    def valves(t: Array) -> Array:
        rows = (t / hold + 1e-9).astype(int)
        first = np.random.default_rng(seed).random((rows.max() // 2 + 1, 2)) < 0.5
        inlets = 2.0 * np.stack([first, ~first], axis=1).reshape(-1, 2)[rows]
        return np.hstack([inlets, np.ones_like(inlets)])

    return valves


# experiments that are compared; each is feasible on the rig [taste]
PROFILES: Final = (
    Profile(
        "sweep-small",
        "sine sweep 0.5 to 20 Hz, 1 mm: friction sticks, viscous damping does not",
        _sweep(1e-3, 0.5, 20.0),
        _trimmed,
    ),
    Profile(
        "sweep-large",
        "sine sweep 0.5 to 12 Hz, 5 mm: forces that grow with speed or travel",
        _sweep(5e-3, 0.5, 12.0),
        _trimmed,
    ),
    Profile("bumps", "single bumps of 12 mm: stops, lift-off, and the free decay after them", _bumps(0.012), _trimmed),
    Profile(
        "slow-heave",
        "slow heave of 6 mm: hysteresis, heat exchange and offsets without inertia",
        _slow(6e-3),
        _trimmed,
    ),
    Profile(
        "valve-steps-large",
        "inlet steps of 30 % held 1 s on a flat road: leaks, supply, coefficients",
        _flat,
        _steps(0.3, 1.0),
    ),
    Profile(
        "valve-steps-fast",
        "inlet steps of 25 % every 0.12 s on a flat road: what is slow beside what is late",
        _flat,
        _steps(0.25, 0.12),
    ),
    Profile(
        "valve-switching",
        "inlets shut and at twice their openings, at random every 20 ms or more, on a flat road: lag against delay",
        _flat,
        _switched(0.02),
    ),
    Profile(
        "valve-steps-small",
        "inlet steps of 4 % held 0.5 s on a flat road: deadband and sticking",
        _flat,
        _steps(0.04, 0.5),
    ),
    Profile(
        "valves-closed",
        "all valves closed after 1 s on a slow heave of 6 mm: what leaks, and what the walls take",
        _slow(6e-3),
        _closed,
    ),
    Profile(
        "valves-half",
        "inlets and outlets together at half their openings every 1.5 s: flows that do not follow the opening",
        _slow(2e-3),
        _half,
    ),
    Profile("outlet-pulses", "each outlet closed for 0.25 s in turn: outlet against inlet", _flat, _pulses),
)


def design_experiment(problem: Problem, best: Fit, rival: Fit) -> Experiment | None:
    """The profile of :data:`PROFILES` that separates two fitted structures most; None for another kind of model."""
    model = problem.model
    if not isinstance(model, RigModel):
        return None
    at_rest = trim(model.rig)
    now = separation_of(problem, best, rival, problem.records[-1])
    found = []
    for profile in PROFILES:
        record = _record(model, profile, at_rest, problem.records[-1])
        found.append((separation_of(problem, best, rival, record), profile, record))
    separation, profile, record = max(found, key=lambda item: item[0])
    time = np.arange(len(record.measured)) * record.period
    return Experiment(
        profile.name, profile.description, separation, now, time, np.asarray(record.road), np.asarray(record.commands),
        chosen_from=len(PROFILES),
    )  # fmt: skip


def _record(model: RigModel, profile: Profile, at_rest: Trim, like: Any) -> Any:
    """A log-shaped record of the profile from rest."""
    t = np.arange(round(DURATION / PERIOD), dtype=np.float64) * PERIOD
    commands = np.tile(at_rest.command, (len(t), 1))
    commands *= profile.valves(t)
    commands[:, :2] = np.clip(commands[:, :2], 0.0, model.rig.inlet_area_max.value)
    road = profile.road(t) * np.minimum(1.0, t / 0.2)[:, None]
    rows = np.tile(model.simulate(like, rows=2)[:1], (len(t), 1))
    return replace(like, period=PERIOD, measured=rows, weight=np.ones_like(rows), commands=commands, road=road,
                   start_state=replace_state(like, at_rest.state))  # fmt: skip


def replace_state(like: Any, state: Array) -> Any:
    """The record's initial estimate, put at rest."""
    return like.start_state._replace(state=np.asarray(state))
