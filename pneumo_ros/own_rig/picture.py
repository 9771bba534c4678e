# SPDX-License-Identifier: Apache-2.0
"""A picture of any rig: its inputs, its slots and its channels as boxes, coloured by their share of the gap."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape

from pneumo_ros.diagnosis.report.rig_map import SHOWN, colour
from pneumo_ros.slots.kinds import Slot

COLUMNS = (("input",), ("force", "contact", "flow"), ("sensor",))
TITLES = ("into the rig", "in the rig", "out of the rig")
WIDTH, BOX, ROW, GAP = 640, 190, 58, 26


def picture_of(slots: Sequence[Slot]) -> Callable[[Mapping[str, float]], str]:
    """What draws a rig's shares."""
    columns = [[slot for slot in slots if slot.kind in kinds] for kinds in COLUMNS]
    height = 40 + ROW * max(1, *map(len, columns))

    def draw(shares: Mapping[str, float]) -> str:
        parts = [_column(k, column, shares) for k, column in enumerate(columns) if column]
        return (f'<svg class="map" viewBox="0 0 {WIDTH} {height}" role="img" aria-label="rig with the gap by place">'
                f"{''.join(parts)}</svg>")  # fmt: skip

    return draw


def _column(k: int, slots: Sequence[Slot], shares: Mapping[str, float]) -> str:
    x = 8 + k * (BOX + GAP)
    title = f'<text class="end" x="{x + BOX / 2}" y="22" text-anchor="middle">{TITLES[k]}</text>'
    return title + "".join(_box(x, 34 + ROW * row, slot, shares.get(slot.place, 0.0)) for row, slot in enumerate(slots))


def _box(x: float, y: float, slot: Slot, share: float) -> str:
    edge = "#343a40" if share >= SHOWN else "#868e96"
    words, told = escape(slot.name.replace("_", " ")), f" {100 * share:.0f} %" if share >= SHOWN else ""
    look = f'rx="8" fill="{colour(share)}" stroke="{edge}"'
    middle = f'x="{x + BOX / 2}" y="{y + 27}" text-anchor="middle"'
    return (f'<g data-place="{escape(slot.place)}"><title>{words}: {100 * share:.0f} % of the gap</title>'
            f'<rect x="{x}" y="{y}" width="{BOX}" height="{ROW - 14}" {look}/>'
            f'<text class="part" {middle}>{words}{told}</text></g>')  # fmt: skip
