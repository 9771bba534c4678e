# SPDX-License-Identifier: Apache-2.0
"""Make one case: draw the rig, size the effect to its grade, simulate three logs, write them and the label."""

from __future__ import annotations

import json
import math
import shutil
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from pneumo_ros.casemaker.bench import SEARCH_STEP, Bench, bench, refitted
from pneumo_ros.casemaker.budget import true_logs
from pneumo_ros.casemaker.catalogue import get
from pneumo_ros.casemaker.curves import curve_of
from pneumo_ros.casemaker.draw import drawn_rig, imperfect_rig, scenes
from pneumo_ros.casemaker.form import STATED, drawn_form, sized_form
from pneumo_ros.casemaker.gap_size import Null, Observation, null_of
from pneumo_ros.casemaker.log_file import write_log
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.planned import Planned
from pneumo_ros.casemaker.scene import Scene, Session, inside_bounds, observation, play
from pneumo_ros.casemaker.simulate import STEP
from pneumo_ros.casemaker.sizing import (
    PART,
    Graded,
    combined,
    graded_effects,
    grown_sizes,
    of_sizes,
    rig_with_some,
    true_budget,
)
from pneumo_ros.casemaker.trim import NoRestError
from pneumo_ros.rig import Quantity, Rig

LOGS = ("fit", "holdout", "edit")
EPOCH_NS = 1_760_900_000_000_000_000
DRAWS, ACTS = 4, 0.5  # draws at most; share of the grade that each effect must reach alone


def made(case: Planned, folder: Path, labels: Path) -> Path:
    """Make a case: ``folder/<name>/{fit,holdout,edit}.mcap`` and ``labels/<name>.json``; nothing half-made is left.

    A case whose folder exists is finished and kept.
    """
    final = folder / case.name
    if final.exists() and (labels / f"{case.name}.json").exists():
        return final
    part = folder / f"{case.name}.part"
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    label, sessions, configs = simulated(case, bench())
    for i, name in enumerate(LOGS):
        write_log(
            part / f"{name}.mcap", sessions[i], configs[i], EPOCH_NS + (100 * (case.seed % 10**6) + 20 * i) * 10**9
        )
    labels.mkdir(parents=True, exist_ok=True)
    (labels / f"{case.name}.json").write_text(json.dumps(label, indent=1), encoding="utf-8")
    shutil.rmtree(final, ignore_errors=True)
    part.rename(final)
    return final


def simulated(case: Planned, on: Bench) -> tuple[dict[str, Any], list[Session], list[Rig]]:
    """Label, the three sessions and what the config of each says.

    A draw in which an effect hardly acts (a wheel that cannot lift before the rig leaves its range), or the rig
    runs away, is drawn anew: a label must not name what is not there.
    """
    for draw in range(DRAWS):
        try:
            label, sessions, configs = _drawn(case, draw, on)
        except NoRestError:
            if draw == DRAWS - 1:
                raise
            continue
        if (
            label["weakest"] >= ACTS * case.grade
            and _each_holds_a_part(label, case)
            and all(np.isfinite(one.sensors).all() for one in sessions)
        ):
            break
    return label, sessions, configs


def _each_holds_a_part(label: dict[str, Any], case: Planned) -> bool:
    """Whether each of several effects makes a few percent of what the refit leaves of the held-out log."""
    return not case.grades or len(case.effects) < 2 or min(i["share_of_refit"] for i in label["truth"]) >= PART


def _drawn(case: Planned, draw: int, on: Bench) -> tuple[dict[str, Any], list[Session], list[Rig]]:
    rng = np.random.default_rng(case.seed if draw == 0 else [case.seed, draw])
    drawn, sigmas = drawn_rig(on.nominal, rng)
    real = imperfect_rig(drawn, on.nominal, on.references, rng)
    step = SEARCH_STEP if case.budgeted else STEP
    fit, held, edit = (_rideable(scene, real, on, step) for scene in scenes(rng, case.imperfect))
    effect_seed = int(rng.integers(1, 2**31))
    null = null_of(on.car, observation(play(real, on.nominal, fit, on.car.surface), on.nominal))
    stated, form_error = 0.0, 0.0
    if case.form:
        stated = STATED
        real, form_error = _formed(real, fit, held, null, np.random.default_rng([effect_seed, 1]), on)
    graded = graded_effects(case, real, fit, null, effect_seed, on)
    for _ in range(3 if case.budgeted and len(case.effects) > 1 else 0):
        grown = grown_sizes(case, real, graded, effect_seed, (fit, held), true_logs(sigmas), on)
        if grown == graded.sizes:
            break
        graded = of_sizes(case, real, grown, graded.weakest, fit, null, effect_seed, on)
    rig, road_gain = combined(real, graded.applied)
    held, shown, held_floor = _telling(held, real, rig, road_gain, 0.5 * case.grade, on, step)
    three = (fit, held, edit)
    sessions = [play(rig, on.nominal, scene, on.car.surface, road_gain) for scene in three]
    label = {
        "case": case.name,
        "kind": case.kind,
        "truth": _truth(case, graded),
        "grade": case.grade,
        "ratio": {"fit": graded.ratio, "holdout": shown / held_floor},
        "gap": {"fit": graded.gap, "holdout": shown, "floor_fit": null.gap, "floor_holdout": held_floor},
        "weakest": graded.weakest * case.grade if case.effects else 0.0,
        "withheld": list(case.withhold),
        "seed": case.seed,
        "draw": draw,
        "tolerances_sigma": sigmas,
        "scenes": [asdict(scene) for scene in three],
    }
    if case.budgeted:
        label["model_form"] = {"stated": stated, "true": form_error}
        _add_budget(label, case, real, graded, effect_seed, (sessions[0], sessions[1]), on)
    return label, sessions, [_config(on.nominal, scene, stated) for scene in three]


def _formed(
    real: RicherRig, fit: Scene, held: Scene, null: Null, rng: np.random.Generator, on: Bench
) -> tuple[RicherRig, float]:
    """The rig with an error of its model's form, and how far the worst channel is off after the refit."""

    def seen(rig: RicherRig) -> tuple[Observation, Observation]:
        one, two = (observation(play(rig, on.nominal, scene, on.car.surface), on.nominal) for scene in (fit, held))
        return one, two

    return sized_form(real, drawn_form(rng), seen, null, on.car)


def _add_budget(
    label: dict[str, Any], case: Planned, real: RicherRig, graded: Graded, seed: int, logs: tuple[Session, Session],
    on: Bench,
) -> None:  # fmt: skip
    """Write each effect's family, law, true shares and curve into the label."""
    sizes = graded.sizes
    budget = true_budget(case, real, sizes, seed, logs, true_logs(label["tolerances_sigma"]), on)

    def rig_with(members: frozenset[int]) -> RicherRig:
        return rig_with_some(case, real, sizes, seed, members)

    everyone = frozenset(range(len(case.effects)))
    for i, (item, law) in enumerate(zip(label["truth"], case.laws, strict=True)):
        kind = get(item["effect"], law)
        item |= {"family": item["effect"] if kind.known else None, "law": kind.law if kind.known else item["effect"],
                 "foreign": kind.foreign, "share": budget.shares[i], "share_left_out": budget.left_out[i],
                 "size": sizes[i]}  # fmt: skip
        item["curve"] = curve_of(item["effect"], item["side"], tuple(item["places"]), rig_with(everyone),
                                 rig_with(everyone - {i}), logs[1], on.car.surface)  # fmt: skip
    total = sum(budget.shares)
    for item in label["truth"]:
        # Nothing of a held-out log in which no wheel lifts and no stop is met.
        item["share_of_refit"] = item["share"] / total if total > 0.0 else 0.0
    label["refit_share"] = budget.refit
    label["held_out"] = {"nominal": budget.nominal, "refit": budget.refitted, "complete": budget.complete}


def _config(nominal: Rig, scene: Scene, form: float) -> Rig:
    """The rig file of a log: nominal, with the change that is known to have been made."""
    changed = replace(nominal, model_form=Quantity(form, 0.0, "1")) if form else nominal
    return changed.with_values(
        sprung_mass=nominal.sprung_mass.value + scene.added_mass,
        supply_pressure=nominal.supply_pressure.value + scene.supply_change,
    )


def _rideable(scene: Scene, real: RicherRig, on: Bench, step: float) -> Scene:
    """The scene with its road lowered until tyres stay loaded and springs inside their table."""
    for _ in range(12):
        if inside_bounds(on.car, play(real, on.nominal, scene, on.car.surface, step=step)):
            return scene
        scene = replace(scene, gain=0.87 * scene.gain, valve_size=0.95 * scene.valve_size)
    return scene


def _telling(
    held: Scene, real: RicherRig, rig: RicherRig, road_gain: float, wanted: float, on: Bench, step: float
) -> tuple[Scene, float, float]:
    """The held-out scene, changed if it would hardly show the effect; with the gap in it and its null floor.

    An effect that acts only beyond a height, a speed or a step must happen in the held-out log too, or nobody could
    check a diagnosis on it. Tried in turn: as drawn, then with valve steps and a rougher road; else the most telling.
    """
    best: tuple[Scene, float, float] | None = None
    for gain in (1.0, 1.35, 1.8):
        scene = held if gain == 1.0 else replace(held, valves="steps", gain=gain * held.gain)
        floor, start = refitted(play(real, on.nominal, scene, on.car.surface, step=step), on)
        value = refitted(play(rig, on.nominal, scene, on.car.surface, road_gain, step), on, start)[0]
        if best is None or (math.isfinite(value) and value / floor > best[1] / best[2]):
            best = (scene, value, floor)
        if value / floor >= wanted:
            break
    assert best is not None  # the loop has run
    return best


def _truth(case: Planned, graded: Graded) -> list[dict[str, Any]]:
    return [
        {
            "effect": name,
            "side": side,
            "places": list(done.places),
            "parameters": {key: {"value": value, "unit": unit} for key, (value, unit) in done.parameters.items()},
            "comparable": get(name, law).comparable,
        }
        for (name, side), law, done in zip(
            case.effects, case.laws or ("",) * len(case.effects), graded.applied, strict=True
        )
    ]
