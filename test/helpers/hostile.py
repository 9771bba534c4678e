# SPDX-License-Identifier: Apache-2.0
"""What a log from elsewhere may carry: effects that would run, texts that would be taken for something else."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import yaml

from helpers.small_logs import STORE, Message, header, joint, pressure, text, write
from pneumo_ros.log.decoded import FLUID_PRESSURE, JOINT_STATE, STRING
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

RIG = load_rig()
VALVES = ("front_inlet", "rear_inlet", "front_outlet", "rear_outlet")


def rest_log(path: Path, config: str, count: int = 1100, extra: Sequence[Message] = ()) -> Path:
    """A log of the rig nearly at rest, with this text on /rig/config."""
    rng = np.random.default_rng(1)
    state, command = trim(RIG).state, trim(RIG).command
    heights = np.array(
        [state[0] + RIG.front_arm.value * state[1], state[0] - RIG.rear_arm.value * state[1], *state[2:4]]
    )
    messages: list[Message] = [("/rig/config", STRING, 0, text(config)), *extra]
    for i in range(count):
        time = 10**9 + i * 2_000_000
        shown = heights + rng.normal(size=4) * 1e-4
        messages += [
            ("/road/profile", JOINT_STATE, time, joint(time, (0.0, 0.0), ("front", "rear"))),
            ("/rig/displacement", JOINT_STATE, time, joint(time, shown.tolist())),
            ("/rig/front/pressure", FLUID_PRESSURE, time, pressure(time, float(state[8]) + rng.normal() * 100.0)),
            ("/rig/rear/pressure", FLUID_PRESSURE, time, pressure(time, float(state[9]) + rng.normal() * 100.0)),
            ("/valve/command", JOINT_STATE, time, joint(time, command.tolist(), VALVES)),
        ]
    return write(path, messages)


MARK = "window.pwned=1"
SEEDS = (
    f"<script>{MARK}</script>", f"<img src=x onerror={MARK}>", f"<svg/onload={MARK}>", f"\"><script>{MARK}</script>",
    f"'><img src=x onerror='{MARK}'>", f"</textarea></title><script>{MARK}</script>", f"javascript:{MARK}",
    "<iframe srcdoc='<script>parent.pwned=1</script>'>", "{{7*7}}{% raw %}", "${7*7}#{7*7}",
    f"<a href=javascript:{MARK}>x</a>",
    "\x1b[31mred\x1b]0;title\x07\x1b[2J", "\x9b31m\x90q\x9c", "\u202egpj.exe\u2066x\u200f", "a\nb\rc\td",
   "\x00\x08\x7f",
    "=1+cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "\t=1", "[/][bold]x[/bold][link=http://x]y[/]",
    "$\\frac{$ %s %n {0}",
    "../../../etc/passwd", "&lt;script&gt;&#x3c;", "\ufeff\U000e0041\u2028line\u2029", "]]>--><!--", "`id`;$(id)|id",
)  # fmt: skip
WRAPS = ("{}", "x{}", "{}{}", "<{}>", "'{}'", '"{}"', "/{}/", " {} ")


def hostile_texts(count: int = 200) -> list[str]:
    """Texts that mean something to a page, a template, a terminal, a spreadsheet, a path or a shell."""
    return [wrap.replace("{}", seed) for wrap in WRAPS for seed in SEEDS][:count]


def hostile_log(path: Path, count: int = 200) -> Path:
    """A log whose every text is hostile: topics, frames, channels, events, parameters, the rig's name."""
    texts = hostile_texts(count)
    types = STORE.types
    extra: list[Message] = []
    for i, hostile in enumerate(texts):
        pair = types["diagnostic_msgs/msg/KeyValue"](key=hostile, value=hostile)
        code = types["diagnostic_msgs/msg/KeyValue"](key="code", value=hostile)
        status = types["diagnostic_msgs/msg/DiagnosticStatus"](
            level=1, name=hostile, message=hostile, hardware_id=hostile, values=[code, pair]
        )
        time = 10**9 + i * 10**5
        events = types["diagnostic_msgs/msg/DiagnosticArray"](header=header(time, hostile), status=[status])
        setup = yaml.safe_dump({"node": hostile, "parameters": {hostile: hostile}})
        extra += [
            ("/rig/events", "diagnostic_msgs/msg/DiagnosticArray", time, events),
            ("/rig/setup", STRING, time, text(setup)), (f"/{i}{hostile}", STRING, time, text(hostile)),
            (f"/j{i}", JOINT_STATE, time, joint(time, (1.0,), (hostile,))),
        ]  # fmt: skip
    rig = yaml.safe_load(RIG.to_yaml())
    rig["rig"]["name"] = "".join(texts[:12])
    return rest_log(path, yaml.safe_dump(rig), 60, extra)
