# SPDX-License-Identifier: Apache-2.0
"""`pneumo demo`: the main job, from nothing: a rig with a hidden effect, two sessions, the diagnosis, the answer."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pneumo_ros.cli.app import App, program
from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.rig import NamedEffect

app = App(add_completion=False)
SESSIONS = {"fit": (0, "D"), "held-out": (1, "C")}  # name -> what is added to the seed, class of the road
LARGEST_SEED = 2**30 - 1  # sessions take 2 seed and 2 seed + 1, a node's parameter up to 2^31 - 1
WHOLE = "the whole rig"
RIG, ANSWER = "rig.yaml", "answer.json"  # in the sealed folder


@app.command()
def demo(
    seed: Annotated[
        int,
        typer.Option(help="What is drawn: effect, place, size, the rig's own numbers, roads.", min=0, max=LARGEST_SEED),
    ] = 1,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder, new; sessions/<time>-demo by default.")
    ] = None,
    duration: Annotated[float, typer.Option(help="Length of each session, s.", min=8.0, max=120.0)] = 15.0,
) -> None:
    """Draw a hidden effect, drive the rig that has it twice, diagnose the logs, open the answer beside the verdict.

    About a minute and a half on two cores, the first time half a minute more. The diagnosis sees the two logs, as any
    user's; what was drawn is sealed (SHA-256) before the first session and opened after the verdict.
    """
    began, console = time.monotonic(), Console(highlight=False)
    folder = output or Path("sessions") / datetime.now().strftime("%Y-%m-%dT%H-%M-%S-demo")
    if folder.exists():
        raise InputError("exists already", where=folder, key="--output", remedy="choose another folder")
    digest = _seal(folder / "sealed", seed)
    _tell(console, 1, f"a rig with one hidden effect: seed {seed} has drawn it")
    console.print(f"sealed in {folder / 'sealed'}, SHA-256 {digest[:16]}...", soft_wrap=True)
    for number, (name, (shift, road)) in enumerate(SESSIONS.items(), start=2):
        what = "nothing is fitted to it" if shift else "five ROS nodes, closed loop"
        _tell(console, number, f"session '{name}': {duration:g} s on a class {road} road; {what}")
        _drive(folder, name, 2 * seed + shift, road, duration)
    _tell(console, 4, "diagnosis of the two logs")
    _diagnose(folder)
    console.rule("[bold]the answer[/]", align="left")
    _open(console, folder, digest)
    console.print(f"report   {folder / 'report' / 'report.html'}", soft_wrap=True)
    console.print(
        f"{time.monotonic() - began:.0f} s in all; another rig: {program()} demo --seed {seed + 1}", soft_wrap=True
    )


def _tell(console: Console, number: int, what: str) -> None:
    console.rule(f"[bold]{number} of 4: {what}[/]", align="left")


def _seal(folder: Path, seed: int) -> str:
    """Draw the rig, write it and its sealed answer; the digest that is published."""
    from pneumo_ros.casemaker.seal import sealed
    from pneumo_ros.effects.hidden import hidden_rig
    from pneumo_ros.effects.loading import laws_of, load_library
    from pneumo_ros.files import new_file
    from pneumo_ros.rig import load_rig

    hidden = hidden_rig(load_rig(), laws_of(load_library()), seed)
    labels, digests = sealed([{"case": "demo", "seed": seed, **hidden.effects[0].to_dict()}])
    folder.mkdir(parents=True)
    for name, text in ((RIG, hidden.to_yaml()), (ANSWER, json.dumps(labels, indent=1))):
        with new_file(folder / name) as part:
            part.write_text(text, encoding="utf-8")
    return digests["demo"]


def _drive(folder: Path, name: str, seed: int, road: str, duration: float) -> None:
    """A session of the hidden rig; nodes, log and diagnosis are told the nominal one."""
    from pneumo_ros.cli.run import run

    rig = json.dumps(str((folder / "sealed" / RIG).resolve()))
    first = name == "fit"
    run(road=road, duration=duration, seed=seed, set_=[f"plant.simulated_rig={rig}"], output=folder / f"{name}.mcap",
        isolate=True, single_process=not first, picture=first, report=first, summary=first)  # fmt: skip


def _diagnose(folder: Path) -> None:
    from pneumo_ros.cli.diagnose import diagnose

    diagnose([folder / "fit.mcap"], holdout=folder / "held-out.mcap", output=folder / "report",
             save_rig=folder / "report" / "rig.yaml")  # fmt: skip


def _open(console: Console, folder: Path, digest: str) -> None:
    """The answer beside the verdict."""
    from pneumo_ros.casemaker.seal import opened
    from pneumo_ros.cli.tables import plain_table
    from pneumo_ros.rig import load_rig

    opened(folder / "sealed" / ANSWER, {"demo": digest})
    hidden = load_rig(folder / "sealed" / RIG).effects[0]
    found = json.loads((folder / "report" / "diagnosis.json").read_text(encoding="utf-8"))
    right = set(found["verdict"].split("+")) == {hidden.effect}
    console.print(plain_table(("", "hidden", "found"), answer_rows(hidden, found)))
    words = "the verdict names it" if right else f"the verdict is {found['verdict']}: {_excuse(hidden, found)}"
    console.print(f"[bold]{words}[/]")


def answer_rows(hidden: NamedEffect, found: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """(what, hidden, found) of effect, place and each parameter."""
    from pneumo_ros.diagnosis.report.quantities import quantity_words
    from pneumo_ros.diagnosis.report.words import site_words, winner

    one = winner(found)
    named = one["effects"] == [hidden.effect]
    sites = ", ".join(site_words(site) or WHOLE for site in one["sites"])
    rows = [("effect", hidden.effect, found["verdict"]), ("place", site_words(hidden.site) or WHOLE, sites)]
    for name, value in hidden.parameters:
        estimate = one["parameters"].get(name) if named else None
        unit = _unit(hidden.effect, name)
        said = "" if estimate is None else quantity_words(name, estimate)
        rows.append((name.replace("_", " "), quantity_words(name, {"value": value, "unit": unit}), said))
    return rows


def _unit(effect: str, parameter: str) -> str:
    from pneumo_ros.effects.loading import load_library

    return next(p.unit for p in load_library()[effect].parameters if p.name == parameter)


def _excuse(hidden: NamedEffect, found: Mapping[str, Any]) -> str:
    if hidden.effect in found["ambiguity_group"]:
        return f"{hidden.effect} is among what these logs do not tell apart from it"
    return "it is wrong on these logs"


if __name__ == "__main__":
    app()
