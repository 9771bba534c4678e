# SPDX-License-Identifier: Apache-2.0
"""The shapes of all families, by the family's id, and what may act at each kind of place."""

from __future__ import annotations

from pneumo_ros.effects.contract import Effect
from pneumo_ros.effects.shapes import air, body, force, mode, signals, supply, tyre

SHAPES: dict[str, Effect] = {
    effect.id: effect for room in (body, force, mode, air, tyre, supply, signals) for effect in room.EFFECTS
}
# Place (its end, or its channel, as the site) -> what may act there.
ANYTHING: dict[str, tuple[str, ...]] = {
    "force": ("anything.force",),
    "air": ("anything.air", "anything.valve"),
    "tyre": ("anything.tyre",),
    "supply": ("anything.supply",),
}


def anything_at(place: str) -> tuple[tuple[str, str], ...]:
    """(effect, site) of what may act at a place of the contract; none where no term reaches (body, road)."""
    if place.startswith("sensor:"):
        channel = place.removeprefix("sensor:")
        return (("anything.pressure" if channel.endswith("pressure") else "anything.lvdt", channel),)
    end, _, kind = place.rpartition("_")
    return tuple((effect, end) for effect in ANYTHING.get(kind, ()))
