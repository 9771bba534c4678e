# SPDX-License-Identifier: Apache-2.0
"""Write what is made from tables: topics, parameters, effects, families and constants in docs/, config/layouts/, urdf/.

`make docs` runs it; tests hold the files up to date.
"""

from __future__ import annotations

from pathlib import Path

from pneumo_ros.cli.constants_page import constants_page
from pneumo_ros.cli.session_plan import node_tables
from pneumo_ros.cli.topics_page import topics_page
from pneumo_ros.dashboard.viewer_layouts import LAYOUTS
from pneumo_ros.effects.loading import laws_of, load_library
from pneumo_ros.effects.sheet import effects_page
from pneumo_ros.parameters import Parameter
from pneumo_ros.rig import load_rig
from pneumo_ros.rig.urdf import urdf
from pneumo_ros.slots.sheet import families_page

EFFECTS_HEAD = """# Effects

Made from the files of `pneumo_ros/effects/library` by `make docs`: what a diagnosis can name, and how an engineer at
the rig checks it by hand. `pneumo effects ID` shows the same on the terminal.

"""
FAMILIES_HEAD = """# What may be missing, by kind of slot

Made from the registry (`pneumo_ros/slots/laws.py` and `shapes.py`) by `make docs`: the families that a rig of
your own ([your-rig.md](your-rig.md)) may be diagnosed with. A family is a mechanism; its laws compete, its shape is a
sum of simple atoms of one sign that any law of the kind lies in, and "whatever may act there" uses every atom of the
slot with either sign: the ceiling that a name is measured against ([diagnosis.md](diagnosis.md)). Sizes are looked for
in multiples of what the log shows of the slot; units are the slot's own.

"""
PARAMETERS_HEAD = """# Parameters

Made from the declarations in the code by `make docs`. Set them with `pneumo run --set node.parameter=value`, in a
ROS 2 parameter file (`--config`), or, where the last column says live, with `ros2 param set` while a session runs; each
change is logged on `/rig/setup` and `/rig/events`.

"""


def parameters_table(table: tuple[Parameter, ...]) -> str:
    """One node's parameters, Markdown."""
    lines = ["| parameter | default | unit | allowed | meaning | change |", "|---|---|---|---|---|---|"]
    for p in table:
        default = f'"{p.default}"' if isinstance(p.default, str) else str(p.default).lower()
        when = "at start" if p.read_only else "live"
        lines.append(f"| `{p.name}` | {default} | {p.unit or '-'} | {p.allowed} | {p.description} | {when} |")
    return "\n".join(lines) + "\n"


def documents() -> dict[str, str]:
    """File name below docs/ -> text."""
    parts = [f"## {node}\n\n{parameters_table(table)}" for node, table in node_tables().items()]
    page = EFFECTS_HEAD + effects_page(laws_of(load_library()))
    return {
        "effects.md": page,
        "constants.md": constants_page(),
        "families.md": FAMILIES_HEAD + families_page(),
        "topics.md": topics_page(),
        "parameters.md": PARAMETERS_HEAD + "\n".join(parts),
    }


def main() -> None:
    """Write docs/, config/layouts/ and urdf/ of this checkout."""
    root = Path(__file__).resolve().parents[2]
    for name, text in documents().items():
        (root / "docs" / name).write_text(text, encoding="utf-8")
    for name, make in LAYOUTS.items():
        (root / "config" / "layouts").mkdir(exist_ok=True)
        (root / "config" / "layouts" / name).write_text(make(), encoding="utf-8")
    (root / "urdf" / "half_car.urdf").write_text(urdf(load_rig()), encoding="utf-8")


if __name__ == "__main__":
    main()
