# SPDX-License-Identifier: Apache-2.0
"""What is drawn for a case: a rig inside its tolerances, small imperfections of every real rig, three scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pneumo_ros.casemaker.excitation import ROADS
from pneumo_ros.casemaker.parameters import RicherRig, richer_rig
from pneumo_ros.casemaker.registry import at_ends
from pneumo_ros.casemaker.scene import Scene
from pneumo_ros.rig import LIMITS, Rig
from pneumo_ros.units import PSI

WIDEST = 2.5  # sigma: tolerances are drawn normal, cut here
ISO = ("iso_c", "iso_d", "iso_e")


def drawn_rig(nominal: Rig, rng: np.random.Generator) -> tuple[Rig, dict[str, float]]:
    """A rig inside its tolerances, and by how many sigma each number is off."""
    sigmas = {}
    for name in LIMITS:
        if getattr(nominal, name).std > 0.0:
            sigmas[name] = float(_normal(rng))
    values = {name: getattr(nominal, name).value + s * getattr(nominal, name).std for name, s in sigmas.items()}
    return nominal.with_values(**values), sigmas


def imperfect_rig(drawn: Rig, nominal: Rig, references: tuple[float, float], rng: np.random.Generator) -> RicherRig:
    """The richer rig of a drawn rig.

    The log carries the commanded outlet area, so its tolerance becomes a coefficient of the outlet. Every rig has
    traces of friction, tyre damping and wall heat, each well below the sensor noise: no rig is exactly its model, and
    a verdict must not hang on it.
    """
    real = richer_rig(drawn, references)
    for side in ("front", "rear"):
        end = getattr(real, side)
        share = getattr(drawn, f"outlet_area_{side}").value / getattr(nominal, f"outlet_area_{side}").value
        friction = rng.uniform(0.0, 0.03)
        real = at_ends(
            real,
            side,
            outlet_scale=end.outlet_scale * share,
            coulomb=friction,
            static=1.2 * friction,
            bristle_stiffness=max(1.2 * friction, 1e-3) / 3e-4,
            tyre_damping=rng.uniform(0.0, 0.15),
            heat=rng.uniform(0.0, 0.004),
        )
    return real


def scenes(rng: np.random.Generator, imperfect: bool) -> tuple[Scene, Scene, Scene]:
    """Fit, held-out and edit session: the held-out one of another excitation class and amplitude.

    ``imperfect`` adds what loggers do: jitter, lost samples, slower pressure channels.
    """
    fit_road = str(rng.choice(ROADS, p=(0.35, 0.25, 0.15, 0.1, 0.15)))
    others = [kind for kind in ROADS if kind != fit_road and not (kind in ISO and fit_road in ISO)]
    held_road, edit_road = str(rng.choice(others)), str(rng.choice(ISO))
    controller = str(rng.choice(["levelling", "active"], p=(0.65, 0.35)))
    seeds = [int(s) for s in rng.integers(1, 2**31, 3)]
    first, second = ("steps", "waves") if rng.uniform() < 0.75 else ("waves", "steps")
    size = rng.uniform(0.22, 0.35)
    fit = Scene(fit_road, rng.uniform(0.85, 1.15), controller, first, size, seeds[0])
    held = Scene(held_road, rng.uniform(0.6, 0.8) if rng.uniform() < 0.7 else rng.uniform(1.2, 1.35),
                 _other(controller, rng), second, 0.7 * size, seeds[1])  # fmt: skip
    edit = _edited(Scene(edit_road, rng.uniform(0.8, 1.0), controller, first, 0.8 * size, seeds[2]), rng)
    if not imperfect:
        return fit, held, edit
    jitter, missing = float(rng.uniform(20e-6, 150e-6)), float(rng.uniform(0.0, 0.02))
    every = int(rng.choice([1, 2]))
    flawed = [replace(scene, jitter=jitter, missing=missing, pressure_every=every) for scene in (fit, held, edit)]
    return flawed[0], flawed[1], flawed[2]


def _other(controller: str, rng: np.random.Generator) -> str:
    if rng.uniform() < 0.7:
        return controller
    return "active" if controller == "levelling" else "levelling"


def _edited(scene: Scene, rng: np.random.Generator) -> Scene:
    if rng.uniform() < 0.6:
        return replace(scene, added_mass=round(float(rng.uniform(2.0, 5.0)), 2))
    return replace(scene, supply_change=-round(float(rng.uniform(6.0, 14.0)), 1) * PSI)


def _normal(rng: np.random.Generator) -> float:
    while True:
        value = rng.normal()
        if abs(value) <= WIDEST:
            return float(value)
