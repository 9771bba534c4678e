# SPDX-License-Identifier: Apache-2.0
"""`pneumo run`: a session from one command: start, watch, summarise, picture."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pneumo_ros.cli.app import App
from pneumo_ros.cli.choices import DEFAULT_CONTROLLER, check_controller, check_road
from pneumo_ros.cli.rig_notes import tell_assumed
from pneumo_ros.cli.session_checks import check_hardware, check_session, compile_rig, tell_doubts, tell_effects
from pneumo_ros.cli.session_plan import (
    RIG_NODES,
    controller_of_profile,
    finish_plan,
    node_tables,
    session_nodes,
    settings_of_options,
)
from pneumo_ros.cli.session_processes import run_session
from pneumo_ros.cli.session_result import Wanted, heard_no_more_after, report_unless_asked_to_end
from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError, not_one_of

if TYPE_CHECKING:
    from pneumo_ros.session.claim import Claim

app = App(add_completion=False)


@app.command()
def run(
    road: Annotated[str, typer.Option(help="ISO class A-H, or sine, sweep, step, bump, flat, or a CSV file.")] = "D",
    duration: Annotated[float, typer.Option(help="Length of the session, s.")] = 20.0,
    speed: Annotated[float, typer.Option(help="Full-scale speed, km/h.")] = 80.0,
    controller: Annotated[
        str,
        typer.Option(
            help="smflc, passive, thesis, two_valve, area_rate_feedforward, or another of docs/parameters.md."
        ),
    ] = DEFAULT_CONTROLLER,
    valves: Annotated[
        Path | None,
        typer.Option(
            help="CSV of valve openings over time, played in open loop instead of a controller; docs/control.md."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of road and sensor noise.")] = 1,
    rate: Annotated[float, typer.Option(help="Control rate, Hz.")] = 500.0,
    source: Annotated[str, typer.Option(help="sim: the simulated rig; serial: the hardware.")] = "sim",
    port: Annotated[str, typer.Option(help="Serial port of the hardware, or of pneumo emulate.")] = "/dev/ttyACM0",
    calibration: Annotated[
        str | None,
        typer.Option(help="Of the hardware, which has no default: name in config/calibration, or a YAML file."),
    ] = None,
    realtime: Annotated[bool, typer.Option("--realtime", help="Absolute deadlines instead of lockstep.")] = False,
    single_process: Annotated[bool, typer.Option("--single-process", help="All nodes in one process.")] = False,
    rig: Annotated[
        Path | None,
        typer.Option(
            help="Rig file (YAML), with its effects if pneumo diagnose --save-rig wrote it; the nominal rig by default."
        ),
    ] = None,
    config: Annotated[Path | None, typer.Option(help="ROS 2 parameter file, see config/session.yaml.")] = None,
    set_: Annotated[list[str] | None, typer.Option("--set", help="node.parameter=value, repeatable.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Log to write; sessions/<time>/session.mcap by default.")
    ] = None,
    domain: Annotated[
        int | None,
        typer.Option(
            "--domain",
            "--domain-id",
            help="DDS domain, where no other session may be; the environment's by default.",
            min=0,
            max=232,
        ),
    ] = None,
    isolate: Annotated[bool, typer.Option("--isolate", help="Take a free DDS domain.")] = False,
    namespace: Annotated[str, typer.Option(help="ROS namespace of nodes and topics, one for each rig: rig1.")] = "",
    use_sim_time: Annotated[
        bool, typer.Option("--use-sim-time", help="Nodes that do not give the samples their time follow /clock.")
    ] = False,
    verbose: Annotated[bool, typer.Option("--verbose", help="Print what the nodes say.")] = False,
    view: Annotated[
        bool, typer.Option("--view", help="Show it in the browser while it runs, in real time; see pneumo view.")
    ] = False,
    report: Annotated[bool, typer.Option(help="Write an HTML page beside the log.")] = True,
    picture: Annotated[bool, typer.Option(help="Write a PNG beside the log.")] = True,
    summary: Annotated[bool, typer.Option(help="Print how the ride was, beside passive valves.")] = True,
) -> None:
    """Run a session: simulate the rig in closed loop and log it."""
    check_road(road)
    check_controller(controller)
    if source not in RIG_NODES:
        raise not_one_of("unknown source", source, RIG_NODES, where="--source")
    from pneumo_ros.cli.view import beside
    from pneumo_ros.session.plan import assign, parse_setting, read_config
    from pneumo_ros.session.supervisor import Place

    if isolate and domain is not None:
        raise InputError("either a domain or any free one", where="--isolate", key="--domain", value=domain,
                         remedy="leave one of them out")  # fmt: skip
    place = _namespace(namespace)
    tables = node_tables()
    values = read_config(config, tables) if config else {node: {} for node in tables}
    if valves is not None:
        controller = controller_of_profile(controller)
    options = settings_of_options(road, duration, speed, controller, seed, rate, realtime or view, source)
    if valves is not None:
        options.append(("controller", "valve_profile", str(valves.resolve())))
    if source == "serial":
        options.append(("daq", "port", port))
        options += [("daq", "calibration", calibration)] if calibration is not None else []
    for node, key, raw in [*options, *(parse_setting(text) for text in set_ or [])]:
        assign(values, tables, node, key, raw, "command line")
    values = {node: own for node, own in values.items() if node in session_nodes(source)}
    target = output or Path("sessions") / datetime.now().strftime("%Y-%m-%dT%H-%M-%S") / "session.mcap"
    session = {"seed": str(seed), "road": road, "controller": controller, "source": source}
    finish_plan(values, rig, target, session | ({} if valves is None else {"valves": str(valves)}))
    if source == "serial":
        check_hardware(values["daq"], single_process)
        tell_doubts(Console(), str(values["daq"]["calibration"]))
    checked = check_session(values, target)
    console = Console()
    tell_assumed(console, checked, rig)
    if checked.effects:
        tell_effects(console, checked, source)
    if source == "sim":
        compile_rig(console, str(values["plant"].get("simulated_rig", "")) or rig, values["plant"])
    if use_sim_time:
        for own in values.values():
            own["use_sim_time"] = True
    with heard_no_more_after(), _alone(domain, place, isolate, source, target) as claim:
        if isolate:
            console.print(f"isolated in domain {claim.domain}")
        with beside(claim.domain, place) if view else nullcontext() as dashboard:
            there = Place(claim.domain, place, (claim.descriptor,))
            code = run_session(console, values, target, single_process, there, verbose)
            report_unless_asked_to_end(console, target, values, Wanted(summary, picture, report), code)
            if dashboard is not None:
                console.print("the dashboard stays until Ctrl-C")
                dashboard.wait()
    if code:
        raise typer.Exit(code)


def _namespace(text: str) -> str:
    """'' or /name[/name...], from what the user wrote."""
    bare = text.strip("/")
    if bare and not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*", bare):
        raise InputError("not a ROS namespace", where="--namespace", value=text, allowed="letters, digits, _ and /")
    return f"/{bare}" if bare else ""


@contextmanager
def _alone(domain: int | None, namespace: str, isolate: bool, source: str, target: Path) -> Iterator[Claim]:
    """A place in the ROS graph where no other session is; nothing is started before that is known."""
    from pneumo_ros.nodes.neighbours import claim_place
    from pneumo_ros.session.middleware import middleware_settings

    os.environ |= middleware_settings(os.environ)
    claim = claim_place(domain, namespace, isolate, f"{source}, {target}", valves=source == "serial")
    try:
        yield claim
    finally:
        claim.release()


if __name__ == "__main__":
    app()
