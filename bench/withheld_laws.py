# SPDX-License-Identifier: Apache-2.0
"""What the library's law leaves of each law that the blind check withholds, fitted to it without noise.

    python bench/withheld_laws.py [--only TEXT] [--grade 20]

Each law acts alone on the nominal rig at a size that leaves ``grade`` times the sensor noise; the library's law of the
same family is fitted to six noiseless seconds at the same site, all its parameters free, from every start it names;
then the law and the shape of its family together, from where the law ended. Printed: gap without and with the fitted
law (rms over channels in their stds), the share left by the law and by both, and the law's parameters.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares

from pneumo_ros.casemaker import catalogue
from pneumo_ros.casemaker.open_loop import read
from pneumo_ros.casemaker.parameters import RicherRig, richer_rig
from pneumo_ros.casemaker.registry import Applied
from pneumo_ros.casemaker.scene import PERIOD, Scene, Session, play
from pneumo_ros.effects.parameters import SHAPE, Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.plant.air_spring import AreaSurface
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import Rig, load_rig

AWAY = 0.02  # of a typical value: where a bound is left, differences relative to the value would be nothing
ROWS, EVERY = 3001, 4  # 6 s, of which each fourth row is compared
SCENE = Scene("iso_c", 1.0, "levelling", "steps", 0.3, 5)
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Record:
    """A noiseless log as the library's rig model takes it."""

    rig: Rig
    period: float
    measured: Array
    weight: Array
    commands: Array
    road: Array
    initial: Array
    initial_std: Array


def record_of(rig: RicherRig, nominal: Rig, surface: AreaSurface, road_gain: float) -> Record:
    """What ideal sensors with the rig's own faults say, row by row."""
    session = play(rig, nominal, SCENE, surface, road_gain)
    clean = _clean(rig, session)
    outlets = np.tile(session.outlets, (ROWS, 1))
    arms = rig.front.arm - rig.rear.arm
    pitch = (clean[0, 0] - clean[0, 1]) / arms
    start = np.array([clean[0, 0] - rig.front.arm * pitch, pitch, *clean[0, 2:4], 0.0, 0.0, 0.0, 0.0, *clean[0, 4:]])
    commands = np.hstack([session.run.inlets[:ROWS], outlets])
    return Record(nominal, PERIOD, clean, np.ones_like(clean), commands, session.road[:ROWS], start, np.zeros(10))


def _clean(rig: RicherRig, session: Session) -> Array:
    """The session's readings without their noise: the same noise is drawn again and taken off."""
    sigma = np.array([NOMINAL.displacement_noise.value] * 4 + [NOMINAL.pressure_noise.value] * 2)
    noise = sigma * np.random.default_rng([SCENE.seed, 1]).normal(size=session.run.measured.shape)
    clean = np.asarray(session.run.measured - noise)[:ROWS]
    assert np.allclose(clean[0], read(rig, session.run.states[0]), atol=1e-9 * np.abs(clean[0]).max() + 1e-12)
    return clean


NOMINAL = load_rig()
CAR, TRIM = nominal_half_car(NOMINAL)
MODEL = RigModel(NOMINAL)
RICHER = richer_rig(NOMINAL, TRIM.pressures)


def left(record: Record, active: tuple[Active, ...] = ()) -> Array:
    """Misfit in channel stds, one entry a compared reading."""
    model = MODEL.simulate(record, active=active)
    return np.asarray(((record.measured - model) / record.measured.std(axis=0))[::EVERY].ravel())


def rms(values: Array) -> float:
    """Root mean square; infinite when the model ran away."""
    return float(np.sqrt(np.mean(values**2))) if np.isfinite(values).all() else np.inf


def site_of(effect: str, applied: Applied, side: str | None) -> str:
    """The library's site of an effect that acts at a side."""
    if MODEL.library[effect].outputs is None:
        return side or ""
    return "both" if side == "both" else applied.places[0].removeprefix("sensor:")


def starts_of(effect: str) -> Iterator[Array]:
    """Every combination of typical values and further starts."""
    yield from (np.array(one) for one in product(*((p.typical, *p.starts) for p in MODEL.library[effect].parameters)))


def fitted(record: Record, effect: str, site: str) -> tuple[float, Array]:
    """Gap that the library's law leaves at best, and its parameters."""
    parameters = MODEL.library[effect].parameters
    low, high = np.array([p.low for p in parameters]), np.array([p.high for p in parameters])
    scale = np.array([abs(p.typical) or 1.0 for p in parameters])

    def residual(x: Array) -> Array:
        out = left(record, (Active(effect, site, tuple(float(v) for v in x * scale)),))
        return np.where(np.isfinite(out), np.clip(out, -1e3, 1e3), 1e3)

    best = (rms(left(record)), np.zeros(len(parameters)))
    for start in starts_of(effect):
        done = least_squares(residual, np.clip(start, low, high) / scale, bounds=(low / scale, high / scale),
                             x_scale=1.0, diff_step=1e-4, max_nfev=25)  # fmt: skip
        best = min(best, (rms(done.fun), done.x * scale), key=lambda pair: pair[0])
    return best


def shaped(record: Record, effect: str, site: str, law: Array) -> float:
    """Gap that the law and its family's shape leave at best; what the law leaves where there is no shape."""
    shape = f"{effect}.{SHAPE}"
    if shape not in MODEL.effects:
        return rms(left(record, (Active(effect, site, tuple(law)),)))
    parameters = (*MODEL.library[effect].parameters, *MODEL.effects[shape].parameters)
    low, high = np.array([p.low for p in parameters]), np.array([p.high for p in parameters])
    scale = np.array([abs(p.typical) or 1.0 for p in parameters])
    count = len(law)

    def residual(x: Array) -> Array:
        values = [float(v) for v in x * scale]
        both = (Active(effect, site, tuple(values[:count])), Active(shape, site, tuple(values[count:])))
        out = left(record, both)
        return np.where(np.isfinite(out), np.clip(out, -1e3, 1e3), 1e3)

    begun = np.concatenate([law, [0.0 if p.size else p.typical for p in parameters[count:]]]) / scale
    begun = np.where(np.abs(begun) < AWAY, AWAY, begun)
    done = least_squares(residual, np.clip(begun, low / scale, high / scale), bounds=(low / scale, high / scale),
                         x_scale=1.0, diff_step=1e-4, max_nfev=25)  # fmt: skip
    return rms(done.fun)


def sized(effect: str, law: str, side: str | None, wanted: float) -> tuple[Applied, Record]:
    """The law at the size whose gap on the nominal rig is ``wanted`` (or its largest)."""

    def at(size: float) -> tuple[Applied, Record]:
        applied = catalogue.get(effect, law).apply(RICHER, size, side, np.random.default_rng(7))
        return applied, record_of(applied.rig, NOMINAL, CAR.surface, applied.road_gain)

    def excess(log_size: float) -> float:
        return float(np.log(max(rms(left(at(float(np.exp(log_size)))[1])), 1e-6) / wanted))

    low, high = np.log(1e-3), 0.0
    if excess(high) <= 0.0 or excess(low) >= 0.0:
        return at(1.0 if excess(high) <= 0.0 else 1e-3)
    return at(float(np.exp(brentq(excess, low, high, xtol=0.05))))


def main() -> None:
    """One line a law."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="laws whose 'effect law' contains this")
    parser.add_argument("--grade", type=float, default=20.0, help="gap over the sensor noise")
    options = parser.parse_args()
    print("| family | law | library has it | gap | left by the library's law | share | with its shape |")
    print("|---|---|---|---|---|---|---|")
    for effect in catalogue.known_effects():
        for foreign in (False, True):
            for law in catalogue.laws_of(effect, foreign=foreign):
                if options.only in f"{effect} {law}":
                    print_line(effect, law, foreign, 0.0035 * options.grade)


def print_line(effect: str, law: str, foreign: bool, wanted: float) -> None:
    """Fit the library's law to one law and print what it leaves."""
    sides = catalogue.get(effect, law).sides
    applied, record = sized(effect, law, sides[0], wanted)
    before = rms(left(record))
    after, values = fitted(record, effect, site_of(effect, applied, sides[0]))
    both = shaped(record, effect, site_of(effect, applied, sides[0]), values)
    names = [f"{p.name} {v:.3g}" for p, v in zip(MODEL.library[effect].parameters, values, strict=True)]
    has = "no" if foreign else "yes"
    print(f"| {effect} | {law} | {has} | {before:.4f} | {after:.5f} ({', '.join(names)}) | {after / before:.2f} "
          f"| {both / before:.2f} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
