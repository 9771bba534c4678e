# SPDX-License-Identifier: Apache-2.0
"""A rig with one effect drawn by a seed, for whoever wants to see whether it is found: ``pneumo demo``.

The rig's own numbers are drawn inside their tolerances too, as no rig is its data sheet. What is drawn is one law of
the library; how the diagnosis fares with laws that it does not have is what the blind check asks
(docs/blind-check.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pneumo_ros.effects.contract import Effect
from pneumo_ros.effects.parameters import EffectParameter
from pneumo_ros.rig import LIMITS, NamedEffect, Rig

WIDEST = 2.0  # sigma: the rig's numbers are drawn normal, cut here
SIZES = (1.0, 2.0)  # typical sizes
SHAPES = (0.8, 1.25)  # typical values of the other parameters
# Left out: what happens only where a spring comes down on its stop or a wheel lifts, which driving on a class D road
# does not do. Typical sizes of the others move its signals by 5 to 400 standard deviations of their noise.
SELDOM_SHOWN = ("bump_stop", "tyre_liftoff")


def hidden_rig(nominal: Rig, library: Mapping[str, Effect], seed: int) -> Rig:
    """The rig inside its tolerances, with one effect; the same for the same seed.

    Parameters
    ----------
    library : id -> effect, of which one is drawn
    """
    rng = np.random.default_rng(seed)
    effect = library[str(rng.choice(sorted(set(library) - set(SELDOM_SHOWN))))]
    site = str(rng.choice(effect.sites))
    values = tuple((p.name, drawn(p, rng)) for p in effect.parameters)
    return replace(inside_tolerances(nominal, rng), effects=(NamedEffect(effect.id, site, values),))


def drawn(parameter: EffectParameter, rng: np.random.Generator) -> float:
    """Near the typical value, of either sign where the bounds allow both; to three digits, as people write it."""
    factor = float(rng.uniform(*(SIZES if parameter.size else SHAPES)))
    if parameter.size and parameter.low <= -SIZES[1] * parameter.typical:
        factor *= float(rng.choice((-1.0, 1.0)))
    value = float(np.clip(factor * parameter.typical, parameter.low, parameter.high))
    return float(f"{value:.3g}")


def inside_tolerances(nominal: Rig, rng: np.random.Generator) -> Rig:
    """The rig with its own numbers drawn inside their tolerances, as no rig is its data sheet."""
    values = {}
    for name in LIMITS:
        quantity = getattr(nominal, name)
        if quantity.std > 0.0:
            values[name] = quantity.value + quantity.std * float(np.clip(rng.normal(), -WIDEST, WIDEST))
    return nominal.with_values(**values)
