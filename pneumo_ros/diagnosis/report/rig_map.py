# SPDX-License-Identifier: Apache-2.0
"""A drawing of the half car whose parts are coloured by their share of the gap."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

WIDTH: Final = 640  # px [display]
HEIGHT: Final = 400  # px [display]
MARGIN: Final = 10  # px, for labels beside the rig [display]
FRONT: Final = 200.0  # px, x of the front axle; the front is on the left [display]
REAR: Final = 440.0  # px, x of the rear axle [display]
BODY_TOP: Final = 118.0  # px [display]
BODY_BOTTOM: Final = 150.0  # px [display]
SPRING_BOTTOM: Final = 232.0  # px [display]
AXLE_BOTTOM: Final = 254.0  # px [display]
TYRE_CENTRE: Final = 290.0  # px [display]
TYRE_RADIUS: Final = 34.0  # px [display]
ROAD: Final = 326.0  # px [display]

COLD: Final = (233, 236, 239)  # RGB of no share: grey paper; keeps black text readable [display]
HOT: Final = (240, 101, 20)  # RGB of the whole gap: a strong orange; keeps black text readable [display]
SHOWN: Final = 0.05  # share from which a part is labelled [display]


PAINT: Final = 'fill="{fill}" stroke="{edge}" stroke-width="1.5"'  # SVG attributes of a part [display]


@dataclass(frozen=True)
class Part:
    """One place on the drawing: its shapes (``{fill}`` and ``{edge}`` to be filled in) and where its label goes."""

    title: str
    shapes: str
    anchor: tuple[float, float]
    label: tuple[float, float]


def draw_map(shares: Mapping[str, float]) -> str:
    """Inline SVG of the rig; ``shares`` of the gap by place, 0..1."""
    parts = _parts()
    body = "\n".join(_drawn(place, part, float(shares.get(place, 0.0))) for place, part in parts.items())
    labels = "\n".join(_label(part, shares[place]) for place, part in parts.items() if shares.get(place, 0.0) >= SHOWN)
    box = f"{-MARGIN} 0 {WIDTH + 2 * MARGIN} {HEIGHT}"
    return (
        f'<svg class="map" viewBox="{box}" role="img" aria-label="half car with the gap by place">'
        f"{_ground()}{body}{_words()}{labels}</svg>"
    )


def colour(share: float) -> str:
    """Fill of a part with a share of 0..1; the square root makes small shares visible."""
    weight = min(max(share, 0.0), 1.0) ** 0.5
    return "#" + "".join(f"{round(c + weight * (h - c)):02x}" for c, h in zip(COLD, HOT, strict=True))


def _drawn(place: str, part: Part, share: float) -> str:
    edge = "#343a40" if share >= SHOWN else "#868e96"
    shapes = part.shapes.replace("{fill}", colour(share)).replace("{edge}", edge)
    return f'<g data-place="{place}"><title>{part.title}: {100 * share:.0f} % of the gap</title>{shapes}</g>'


def _label(part: Part, share: float) -> str:
    (x, y), (tx, ty) = part.anchor, part.label
    anchor = "end" if tx < x - 30 else "start" if tx > x + 30 else "middle"
    shift = {"end": -4, "start": 4, "middle": 0}[anchor]
    return (
        f'<line x1="{x}" y1="{y}" x2="{tx}" y2="{ty}" stroke="#212529"/>'
        f'<circle cx="{x}" cy="{y}" r="2.5" fill="#212529"/>'
        f'<text class="share" x="{tx + shift}" y="{ty + 10}" text-anchor="{anchor}">{100 * share:.0f} %</text>'
    )


def _ground() -> str:
    return f'<rect x="20" y="{ROAD + 40}" width="{WIDTH - 40}" height="6" fill="#dee2e6"/>'


def _words() -> str:
    return (
        f'<text class="end" x="{FRONT}" y="{HEIGHT - 8}" text-anchor="middle">front</text>'
        f'<text class="end" x="{REAR}" y="{HEIGHT - 8}" text-anchor="middle">rear</text>'
    )


def _parts() -> dict[str, Part]:
    parts = {"supply": _supply(), **_body()}
    for end, x, out in (("front", FRONT, -1.0), ("rear", REAR, 1.0)):
        parts |= _end(end, x, out)
    parts["road_input"] = _road()
    return parts


def _supply() -> Part:
    pipes = "".join(
        f'<path d="M {x0} 38 H {x1} V 176" fill="none" stroke="{{edge}}" stroke-width="3"/>'
        for x0, x1 in ((270, FRONT + 52), (370, REAR - 52))
    )
    tank = '<rect x="270" y="20" width="100" height="36" rx="18" fill="{fill}" stroke="{edge}" stroke-width="1.5"/>'
    return Part("air supply", pipes + tank + _text(320, 43, "supply"), (320, 20), (400, 12))


def _body() -> dict[str, Part]:
    beam = (
        f'<rect x="{FRONT - 50}" y="{BODY_TOP}" width="{REAR - FRONT + 100}" height="{BODY_BOTTOM - BODY_TOP}" rx="8" '
        'fill="{fill}" stroke="{edge}" stroke-width="1.5"/>'
    )
    middle = 0.5 * (FRONT + REAR)
    arc = f"M {middle + 26} 112 A 34 20 0 0 0 {middle - 26} 112"
    pitch = (
        f'<path d="{arc}" fill="none" stroke="{{fill}}" stroke-width="7"/>'
        f'<path d="{arc}" fill="none" stroke="{{edge}}"/>'
        f'<path d="M {middle - 32} 104 L {middle - 27} 116 L {middle - 18} 107 Z" fill="{{edge}}"/>'
    )
    return {
        "body_heave": Part(
            "body, up and down", beam + _text(middle, 139, "body"), (middle + 60, 134), (middle + 60, 196)
        ),
        "body_pitch": Part("body, pitch", pitch, (middle, 96), (middle, 78)),
    }


def _end(end: str, x: float, out: float) -> dict[str, Part]:
    side = 118.0 * out
    lobes = (BODY_BOTTOM + 4, BODY_BOTTOM + 29, BODY_BOTTOM + 54)
    bellows = "".join(f'<rect x="{x - 34}" y="{y}" width="68" height="25" rx="12" {PAINT}/>' for y in lobes)
    valve = x - 52 * out
    air = (
        f'<rect x="{x - 20}" y="{BODY_BOTTOM + 8}" width="40" height="67" rx="6" fill="{{fill}}" stroke="{{edge}}"/>'
        f'<path d="M {valve} 192 H {x - 20 * out}" stroke="{{edge}}" stroke-width="3"/>'
        f'<path d="M {valve - 13} 180 L {valve + 13} 204 V 180 L {valve - 13} 204 Z" {PAINT}/>' + _text(x, 196, "air")
    )
    axle = (
        f'<rect x="{x - 40}" y="{SPRING_BOTTOM}" width="80" height="{AXLE_BOTTOM - SPRING_BOTTOM}" rx="4" '
        'fill="#ced4da" stroke="#868e96"/>'
    )
    tyre = (
        f'<circle cx="{x}" cy="{TYRE_CENTRE}" r="{TYRE_RADIUS}" fill="{{fill}}" stroke="{{edge}}" stroke-width="1.5"/>'
        f'<circle cx="{x}" cy="{TYRE_CENTRE}" r="14" fill="#f8f9fa" stroke="{{edge}}"/>'
    )
    far = x + side
    return {
        f"{end}_tyre": Part(f"{end} tyre", tyre + axle, (x + 24 * out, 300), (far, 300)),
        f"{end}_force": Part(f"{end} spring force", bellows, (x + 30 * out, 216), (far, 216)),
        f"{end}_air": Part(f"{end} air and valve", air, (x + 12 * out, 176), (far, 176)),
        **_sensors(end, x, out),
    }


def _sensors(end: str, x: float, out: float) -> dict[str, Part]:
    far = x + 118.0 * out
    found = {}
    for name, at, y in (("sprung", 68.0, 134.0), ("unsprung", 58.0, 244.0)):
        sx = x + at * out
        shape = (
            f'<path d="M {sx} {y} V {ROAD + 40}" stroke="{{edge}}" stroke-dasharray="2 3"/>'
            f'<circle cx="{sx}" cy="{y}" r="7" fill="{{fill}}" stroke="{{edge}}" stroke-width="1.5"/>'
        )
        found[f"sensor:{name}_{end}"] = Part(f"sensor {name} {end}", shape, (sx, y), (far, y))
    gauge = (
        f'<path d="M {x + 26 * out} 166 H {x + 50 * out}" stroke="{{edge}}"/>'
        f'<circle cx="{x + 50 * out}" cy="166" r="8" fill="{{fill}}" stroke="{{edge}}" stroke-width="1.5"/>'
        f'<path d="M {x + 50 * out} 166 l 4 -4" stroke="{{edge}}"/>'
    )
    found[f"sensor:{end}_pressure"] = Part(f"sensor {end} pressure", gauge, (x + 50 * out, 166), (far, 158))
    return found


def _road() -> Part:
    wave = " ".join(f"Q {x + 20} {ROAD - 6} {x + 40} {ROAD} T {x + 80} {ROAD}" for x in range(120, 520, 80))
    plates = "".join(
        f'<rect x="{x - 30}" y="{ROAD + 4}" width="60" height="36" rx="3" fill="{{fill}}" stroke="{{edge}}"/>'
        for x in (FRONT, REAR)
    )
    line = f'<path d="M 120 {ROAD} {wave}" fill="none" stroke="{{edge}}" stroke-width="2"/>'
    return Part(
        "road input", plates + line + _text(320, ROAD + 24, "road"), (REAR + 20, ROAD + 22), (REAR + 118, ROAD + 22)
    )


def _text(x: float, y: float, word: str) -> str:
    return f'<text x="{x}" y="{y}" text-anchor="middle" class="part">{word}</text>'
