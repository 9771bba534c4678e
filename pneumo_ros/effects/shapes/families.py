# SPDX-License-Identifier: Apache-2.0
"""The shapes of all families, by the family's id, and what may act at each kind of place."""

from __future__ import annotations

from pneumo_ros.effects.contract import Effect
from pneumo_ros.effects.shapes import air, body, force, mode, outside, signals, supply, tyre

SHAPES: dict[str, Effect] = {
    effect.id: effect for room in (body, force, mode, air, tyre, supply, signals, outside) for effect in room.EFFECTS
}
# Kind of place (its end as the site), place of the whole rig, two that are tied together, or what may be another thing
# at one place than the names it is held against -> what may act there.
ANYTHING: dict[str, tuple[str, ...]] = {
    "force": ("anything.force",),
    "air": ("anything.air", "anything.valve"),
    "tyre": ("anything.tyre",),
    "supply": ("anything.supply",),
    "body_heave": ("anything.body", "anything.held"),
    "body_pitch": ("anything.body", "anything.bar"),
    "road_input": ("anything.ground",),
    "front_air-rear_air": ("anything.pipe",),
    "air-later": ("anything.later",),
}


def anything_at(place: str) -> tuple[tuple[str, str], ...]:
    """(effect, site) of what may act at a place of the contract; none at a place that is not known."""
    if place.startswith("sensor:"):
        channel = place.removeprefix("sensor:")
        return (("anything.pressure" if channel.endswith("pressure") else "anything.lvdt", channel),)
    if place in ANYTHING:
        return tuple((effect, "") for effect in ANYTHING[place])
    end, _, kind = place.rpartition("_")
    return tuple((effect, end) for effect in ANYTHING.get(kind, ()))
