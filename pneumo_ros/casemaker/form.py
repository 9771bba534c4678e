# SPDX-License-Identifier: Apache-2.0
"""A small smooth error of the model's form: what every real rig has and no effect names.

Mild curvature of the effective area over stroke and pressure, of the flows over pressure and of the tyre over its
deflection, at both ends. Its size is set so that the refit leaves about a given share of a channel's std.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.casemaker.gap_size import Null, Observation, free_run, perturbed, refit
from pneumo_ros.casemaker.laws import slots
from pneumo_ros.casemaker.parameters import RicherRig
from pneumo_ros.casemaker.registry import with_law
from pneumo_ros.plant.half_car import HalfCar

STATED = 0.05  # what /rig/config says the model form is worth
WANTED = 0.04  # what the worst channel is given, fit or held-out
WIDTHS = (0.01, 0.01, 0.01, 0.02, 0.02, 0.05)  # area over stroke, mixed, over pressure; inlet, outlet; tyre


def drawn_form(rng: np.random.Generator) -> NDArray[np.float64]:
    """Direction of the error, (2, 6)."""
    return rng.normal(size=(2, len(WIDTHS))) * np.array(WIDTHS)


def with_form(rig: RicherRig, direction: NDArray[np.float64], size: float) -> RicherRig:
    """The rig with the error at a size."""
    for end, values in zip(slots.ENDS, direction, strict=True):
        rig = with_law(rig, end, slots.FORM, 1, *(size * float(v) for v in values))
    return rig


def sized_form(
    rig: RicherRig, direction: NDArray[np.float64], seen: Callable[[RicherRig], tuple[Observation, Observation]],
    null: Null, car: HalfCar,
) -> tuple[RicherRig, float]:  # fmt: skip
    """The rig whose worst channel is :data:`WANTED` off after the refit, and how far it is.

    Parameters
    ----------
    seen : rig -> its fit and held-out log
    null : refit of the rig without the error
    """
    size, formed, worst = 1.0, rig, 0.0
    for _ in range(6):
        formed = with_form(rig, direction, size)
        worst = _worst(car, *seen(formed), null)
        if abs(worst / WANTED - 1.0) < 0.05:
            break
        size *= float(np.clip(WANTED / worst, 0.2, 5.0))
    return formed, worst


def _worst(car: HalfCar, fit: Observation, held: Observation, null: Null) -> float:
    """Largest rms of a channel over its std, noise taken off, after the refit of the fit log."""
    _, logs = refit(car, fit, null.logs)
    out = []
    for one in (fit, held):
        error = one.measured - free_run(perturbed(car, logs), one)
        power = np.mean(error**2, axis=0) - one.noise**2
        out.append(np.sqrt(np.maximum(power, 0.0)) / np.std(one.measured, axis=0))
    return float(np.max(out))
