"""Make one case: draw the rig, size the effect to its grade, simulate three logs, write them and the label."""

from __future__ import annotations

import json
import math
import shutil
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.casemaker.budget import Budget, budget_of, true_logs
from pneumo_ros.casemaker.catalogue import get
from pneumo_ros.casemaker.curves import curve_of
from pneumo_ros.casemaker.draw import drawn_rig, imperfect_rig, scenes
from pneumo_ros.casemaker.form import STATED, drawn_form, sized_form
from pneumo_ros.casemaker.gap_size import NUISANCE, Null, Observation, null_of, quick_gap, refit
from pneumo_ros.casemaker.log_file import write_log
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.plan import Planned
from pneumo_ros.casemaker.refit import bounded_gap
from pneumo_ros.casemaker.registry import Applied
from pneumo_ros.casemaker.scene import Scene, Session, inside_bounds, observation, play
from pneumo_ros.casemaker.simulate import STEP
from pneumo_ros.casemaker.trim import NoRestError
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import Quantity, Rig, load_rig

Logs = NDArray[np.float64]
LOGS = ("fit", "holdout", "edit")
EPOCH_NS = 1_760_900_000_000_000_000
GRADE_TOLERANCE = 0.04  # relative
QUICK_TRIES, CAREFUL_TRIES = 5, 9
ROUGH_TOLERANCE = 0.2  # of the grade of one of several effects
PART, GROWTH = 0.03, 1.7  # smallest part of what the refit leaves that one of several holds; else it grows by this
DRAWS, ACTS = 4, 0.5  # draws at most; share of the grade that each effect must reach alone
SEARCH_STEP = 0.5e-3  # s, of the richer rig while a size is searched
RULER_STEP = 1e-3  # s: RK4 then errs by less than a third of the sensor noise, on both sides of the ratio


@dataclass(frozen=True)
class Bench:
    """What every case shares: the nominal rig and its plant, the ruler of the grades."""

    nominal: Rig
    car: HalfCar
    references: tuple[float, float]


def bench() -> Bench:
    """The nominal rig that ships with the package."""
    nominal = load_rig()
    car, trim = nominal_half_car(nominal)
    return Bench(nominal, replace(car, step=RULER_STEP), trim.pressures)


@dataclass(frozen=True)
class Graded:
    """An effect at the size that meets its grade, as far as a sane size can."""

    size: float
    gap: float
    ratio: float
    weakest: float  # smallest ratio of one of its effects alone to its grade
    sizes: tuple[float, ...]
    applied: tuple[Applied, ...]


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
    graded = _graded(case, real, fit, null, effect_seed, on)
    for _ in range(3 if case.budgeted and len(case.effects) > 1 else 0):
        grown = _grown(case, real, graded, effect_seed, (fit, held), true_logs(sigmas), on)
        if grown == graded.sizes:
            break
        graded = _of_sizes(case, real, grown, graded.weakest, fit, null, effect_seed, on)
    rig, road_gain = _combined(real, graded.applied)
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
    budget = _budget(case, real, sizes, seed, logs, true_logs(label["tolerances_sigma"]), on)

    def rig_with(members: frozenset[int]) -> RicherRig:
        return _with_some(case, real, sizes, seed, members)

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
        item["share_of_refit"] = item["share"] / total
    label["refit_share"] = budget.refit
    label["held_out"] = {"nominal": budget.nominal, "refit": budget.refitted, "complete": budget.complete}


def _with_some(
    case: Planned, real: RicherRig, sizes: tuple[float, ...], seed: int, members: frozenset[int]
) -> RicherRig:
    """The true rig with some of its effects."""
    kept = sorted(members)
    some = replace(case, effects=tuple(case.effects[i] for i in kept), laws=tuple(case.laws[i] for i in kept))
    return _combined(real, _applied(some, real, tuple(sizes[i] for i in kept), seed))[0]


def _budget(
    case: Planned, real: RicherRig, sizes: tuple[float, ...], seed: int, logs: tuple[Session, Session], drawn: Logs,
    on: Bench, orders: bool = True,
) -> Budget:  # fmt: skip
    seen = (observation(logs[0], on.nominal), observation(logs[1], on.nominal))
    some: Callable[[frozenset[int]], RicherRig] = partial(_with_some, case, real, sizes, seed)
    return budget_of(len(case.effects), some, logs, seen, drawn, on.car, on.car.surface, orders)


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
        floor, start = _refitted(play(real, on.nominal, scene, on.car.surface, step=step), on)
        value = _refitted(play(rig, on.nominal, scene, on.car.surface, road_gain, step), on, start)[0]
        if best is None or (math.isfinite(value) and value / floor > best[1] / best[2]):
            best = (scene, value, floor)
        if value / floor >= wanted:
            break
    assert best is not None  # the loop has run
    return best


def _refitted(session: Session, on: Bench, start: Logs | None = None) -> tuple[float, Logs]:
    """What the nominal structure leaves after the refit, and the refit's parameters; infinite if the rig ran away."""
    seen = observation(session, on.nominal)
    if not np.isfinite(seen.measured).all():
        return math.inf, np.zeros(len(NUISANCE))
    return refit(on.car, seen, start)


def _applied(case: Planned, real: RicherRig, sizes: tuple[float, ...], seed: int) -> tuple[Applied, ...]:
    out, rig = [], real
    laws = case.laws or ("",) * len(case.effects)
    for (name, side), law, size in zip(case.effects, laws, sizes, strict=True):
        # By name: an effect is the same alone, where it is sized, and in a pair.
        done = get(name, law).apply(rig, size, side, np.random.default_rng([seed, zlib.crc32(name.encode())]))
        rig = done.rig
        out.append(done)
    return tuple(out)


def _combined(real: RicherRig, applied: tuple[Applied, ...]) -> tuple[RicherRig, float]:
    if not applied:
        return real, 1.0
    return applied[-1].rig, max(item.road_gain for item in applied)


def _graded(case: Planned, real: RicherRig, scene: Scene, null: Null, seed: int, on: Bench) -> Graded:
    """Size each effect alone to the case's grade (so that in a pair both can be seen), then measure the whole."""
    sizes, weakest = [], math.inf
    for i, one in enumerate(case.effects):
        grade = case.grades[i] if case.grades else case.grade
        size, alone = case.size, grade
        if size is None:
            only = replace(case, effects=(one,), laws=case.laws[i : i + 1], grade=grade)
            size, alone = _search(only, real, scene, null, seed, on)
        sizes.append(size)
        weakest = min(weakest, alone / grade)
    return _of_sizes(case, real, tuple(sizes), weakest, scene, null, seed, on)


def _of_sizes(
    case: Planned, real: RicherRig, sizes: tuple[float, ...], weakest: float, scene: Scene, null: Null, seed: int,
    on: Bench,
) -> Graded:  # fmt: skip
    """The effects together at their sizes, and how large the whole is."""
    applied = _applied(case, real, sizes, seed)
    rig, road_gain = _combined(real, applied)
    value = null.gap
    if applied:
        value = _refitted(play(rig, on.nominal, scene, on.car.surface, road_gain), on, null.logs)[0]
    return Graded(max(sizes, default=0.0), value, value / null.gap, weakest, sizes, applied)


def _grown(
    case: Planned, real: RicherRig, graded: Graded, seed: int, scenes: tuple[Scene, Scene], drawn: Logs, on: Bench
) -> tuple[float, ...]:
    """Sizes, larger for those of several effects that hold too little of the held-out gap."""
    rig, road_gain = _combined(real, graded.applied)
    logs = tuple(play(rig, on.nominal, scene, on.car.surface, road_gain, SEARCH_STEP) for scene in scenes)
    if not all(np.isfinite(log.run.measured).all() for log in logs):
        return graded.sizes
    budget = _budget(case, real, graded.sizes, seed, (logs[0], logs[1]), drawn, on, orders=False)
    total = sum(budget.shares)
    return tuple(
        min(1.0, GROWTH * size) if share < 1.3 * PART * total else size
        for size, share in zip(graded.sizes, budget.shares, strict=True)
    )


def _search(case: Planned, real: RicherRig, scene: Scene, null: Null, seed: int, on: Bench) -> tuple[float, float]:
    """Size whose refit gap is ``case.grade`` floors, and how many it is: the quick ruler finds the neighbourhood, the
    refit decides.
    """

    step = SEARCH_STEP if case.budgeted else STEP

    def ratio_at(size: float, careful: bool) -> float:
        rig, road_gain = _combined(real, _applied(case, real, (size,), seed))
        try:
            session = play(rig, on.nominal, scene, on.car.surface, road_gain, step)
        except NoRestError:
            return math.inf
        if case.budgeted and not careful:
            seen = observation(session, on.nominal)
            return bounded_gap(on.car, seen, null) / null.gap if np.isfinite(seen.measured).all() else math.inf
        return _left(session, null, on, careful) / null.gap

    first = min(0.02 * case.grade, 0.5)
    if case.budgeted and case.kind not in ("single", "unknown"):  # of several at once the shares are measured anyway
        return _sized(lambda size: ratio_at(size, False), case.grade, first, QUICK_TRIES, ROUGH_TOLERANCE)
    start, _ = _sized(lambda size: ratio_at(size, False), case.grade, first, QUICK_TRIES)
    return _sized(lambda size: ratio_at(size, True), case.grade, start, CAREFUL_TRIES)


def _sized(
    ratio_at: Callable[[float], float], grade: float, start: float, tries: int, tolerance: float = GRADE_TOLERANCE
) -> tuple[float, float]:
    """(size, its ratio): false position on log(excess over the floor) against log(size)."""
    wanted = 0.5 * math.log(grade**2 - 1.0)
    low: tuple[float, float] | None = None
    high: tuple[float, float] | None = None
    size, best, closest = start, (start, 0.0), math.inf
    for _ in range(tries):
        ratio = ratio_at(size)
        # As a ratio: an effect sized below its threshold is no nearer to its grade than one three times over.
        off = abs(math.log(ratio / grade)) if 0.0 < ratio < math.inf else math.inf
        if off < closest:
            best, closest = (size, ratio), off
        if off < tolerance or (size >= 1.0 and ratio < grade):
            break
        excess = 0.5 * math.log(max(ratio**2 - 1.0, 0.02)) if math.isfinite(ratio) else 10.0
        if excess < wanted:
            low = (math.log(size), excess)
        else:
            high = (math.log(size), excess)
        size = _next_size(low, high, wanted)
    return best


def _left(session: Session, null: Null, on: Bench, careful: bool) -> float:
    if careful:
        return _refitted(session, on, null.logs)[0]
    seen = observation(session, on.nominal)
    return quick_gap(on.car, seen, null) if np.isfinite(seen.measured).all() else math.inf


def _next_size(low: tuple[float, float] | None, high: tuple[float, float] | None, wanted: float) -> float:
    if low is not None and high is not None:
        share = (wanted - low[1]) / max(high[1] - low[1], 1e-9)
        share = min(max(share, 0.15), 0.85)
        return math.exp(low[0] + share * (high[0] - low[0]))
    known = low if low is not None else high
    assert known is not None  # the caller has just set one of them
    step = min(max(wanted - known[1], -2.5), 2.5)
    return min(1.0, math.exp(known[0] + 1.1 * step))


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
