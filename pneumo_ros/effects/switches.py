# SPDX-License-Identifier: Apache-2.0
"""How a library's terms lie in the compiled kernel: slots, switches, parameters, room for their states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.effects.composition import Compiled, Slot, compose
from pneumo_ros.effects.contract import Effect, ends_of
from pneumo_ros.effects.parameters import Active


@lru_cache(maxsize=8)
def kernel_of(slots: tuple[Slot, ...]) -> Compiled:
    """The compiled kernel of some slots."""
    return compose(slots)


def slots_of(library: Mapping[str, Effect]) -> tuple[Slot, ...]:
    """Terms of a library in the kernel's order."""
    found: dict[str, Slot] = {}
    for _, e in sorted(library.items()):
        if e.term is not None:
            name, count = e.place_in_kernel, max([len(e.parameters), *(column + 1 for column in e.columns)])
            known = found.get(name)
            found[name] = Slot(name, e.term, max(count, known.parameters if known else 0))
    return tuple(found[name] for name in sorted(found))


def room_for_states(slots: Sequence[Slot]) -> Array:
    """Room for the states of the kernel's terms, (K, 2, S)."""
    return np.zeros((max(1, len(slots)), 2, max([1, *(slot.term.states for slot in slots)])))


class Layout(NamedTuple):
    """Where each term's parameters lie: its number by name, and the shape (K, 2, M) of all."""

    number: Mapping[str, int]
    shape: tuple[int, int, int]


def layout_of(slots: Sequence[Slot]) -> Layout:
    """The layout of a kernel's parameters."""
    most = max([1, *(slot.parameters for slot in slots)])
    return Layout({slot.name: k for k, slot in enumerate(slots)}, (max(1, len(slots)), 2, most))


def switches_of(layout: Layout, library: Mapping[str, Effect], terms: Sequence[Active]) -> tuple[Mask, Array]:
    """Which terms act at which end, (K, 2), and their parameters (K, 2, M), as the kernel takes them."""
    on, values = np.zeros(layout.shape[:2], dtype=np.bool_), np.ones(layout.shape)
    for one in terms:
        effect = library[one.effect]
        k = layout.number[effect.place_in_kernel]
        for end in ends_of(one.site).columns:
            if not effect.columns:
                values[k, end, : len(one.values)] = one.values
            else:
                values[k, end] = values[k, end] if on[k, end] else 0.0
                values[k, end, list(effect.columns)] += one.values
            on[k, end] = True
    return on, values
