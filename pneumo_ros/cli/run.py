# SPDX-License-Identifier: Apache-2.0
"""`pneumo run`: a session from one command: start, watch, summarise, picture."""

from __future__ import annotations

import json
import os
import re
import signal
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer
from rich.markup import escape

from pneumo_ros.cli.app import App
from pneumo_ros.cli.choices import ALIASES, DEFAULT_CONTROLLER, ROAD_CLASSES, check_controller, check_road
from pneumo_ros.cli.rig_notes import tell_assumed
from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError, not_one_of

if TYPE_CHECKING:
    from pneumo_ros.parameters import Value
    from pneumo_ros.rig import Rig
    from pneumo_ros.session.claim import Claim
    from pneumo_ros.session.plan import Tables, Values
    from pneumo_ros.session.summary import Recorded
    from pneumo_ros.session.supervisor import Place

app = App(add_completion=False)
FAILED = 1
INTERRUPTED = 130  # as a shell says of Ctrl-C
MIN_SAMPLES = 10  # fewer make no figures
RIG_NODES = {"sim": "plant", "serial": "daq"}  # source -> the node that is the rig


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
    output: Annotated[Path | None, typer.Option(help="Log to write; sessions/<time>/session.mcap by default.")] = None,
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
        controller = _player(controller)
    options = _options(road, duration, speed, controller, seed, rate, realtime or view, source)
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
    _finish_plan(values, rig, target, session | ({} if valves is None else {"valves": str(valves)}))
    if source == "serial":
        _check_hardware(values["daq"], single_process)
        _tell_doubts(Console(), str(values["daq"]["calibration"]))
    checked = _check(values, target)
    console = Console()
    tell_assumed(console, checked, rig)
    if checked.effects:
        _tell_effects(console, checked, source)
    if source == "sim":
        _compile(console, str(values["plant"].get("simulated_rig", "")) or rig, values["plant"])
    if use_sim_time:
        for own in values.values():
            own["use_sim_time"] = True
    with _alone(domain, place, isolate, source, target) as claim:
        if isolate:
            console.print(f"isolated in domain {claim.domain}")
        with beside(claim.domain, place) if view else nullcontext() as dashboard:
            there = Place(claim.domain, place, (claim.descriptor,))
            _run_session(console, values, target, single_process, there, verbose)
            _report_unless_asked_to_end(console, target, values, Wanted(summary, picture, report))
            if dashboard is not None:
                console.print("the dashboard stays until Ctrl-C")
                dashboard.wait()


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

    # A session stays on this computer unless the user opened it to the network.
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    claim = claim_place(domain, namespace, isolate, f"{source}, {target}", valves=source == "serial")
    try:
        yield claim
    finally:
        claim.release()


def _player(controller: str) -> str:
    from pneumo_ros.control.half_car import PROFILE

    if controller not in (DEFAULT_CONTROLLER, PROFILE):
        raise InputError("either a controller or a valve profile", where="--valves", key="--controller",
                         value=controller, remedy="leave one of them out")  # fmt: skip
    return PROFILE


def session_nodes(source: str) -> tuple[str, ...]:
    """Nodes of a session in the order they are stopped."""
    if source == "serial":  # the valves first: without a controller the driver would rightly trip
        return "daq", "road_profile", "controller", "estimator", "session_recorder"
    return "road_profile", "controller", "estimator", "plant", "session_recorder"


def node_tables() -> Tables:
    """Parameter table of every node a session may have."""
    from pneumo_ros.nodes import controller, daq, estimator, plant, road_profile, session_recorder
    from pneumo_ros.nodes.base import node_parameters

    modules = {
        "road_profile": road_profile,
        "plant": plant,
        "daq": daq,
        "estimator": estimator,
        "controller": controller,
        "session_recorder": session_recorder,
    }
    return {name: node_parameters(module.PARAMETERS) for name, module in modules.items()}


def _options(
    road: str, duration: float, speed: float, controller: str, seed: int, rate: float, realtime: bool, source: str
) -> list[tuple[str, str, Any]]:
    """The command line's options as settings of nodes."""
    from pneumo_ros.control.presets import controller_settings

    return [
        *_road_options(road),
        ("road_profile", "speed_kmh", speed),
        ("road_profile", "seed", seed),
        ("plant", "seed", seed),
        ("**", "session_nodes", ",".join(session_nodes(source))),
        (RIG_NODES[source], "duration", duration),
        (RIG_NODES[source], "report_progress", True),
        *controller_settings(ALIASES.get(controller, controller)),
        ("**", "rate_hz", rate),
        ("**", "mode", "realtime" if realtime or source == "serial" else "lockstep"),
    ]


def _road_options(road: str) -> list[tuple[str, str, Any]]:
    if road.upper() in list(ROAD_CLASSES):
        return [("road_profile", "kind", "iso"), ("road_profile", "iso_class", road.upper())]
    if road.lower().endswith(".csv"):
        return [("road_profile", "kind", "file"), ("road_profile", "path", road)]
    return [("road_profile", "kind", road)]


def _finish_plan(values: Values, rig: Path | None, target: Path, session: dict[str, str]) -> None:
    for own in values.values():
        if rig is not None:
            own["rig"] = str(rig.resolve())
    values["session_recorder"]["output"] = str(target)
    identity = uuid.uuid4().hex
    values["session_recorder"]["session"] = json.dumps(
        {**session, "session_id": identity, "parameters": json.dumps(values)}
    )
    for own in values.values():
        own["session_id"] = identity


def _tell_effects(console: Console, rig: Rig, source: str) -> None:
    """Who acts on the rig's effects: the simulated rig does, the hardware has its own."""
    from pneumo_ros.effects.configured import library_of
    from pneumo_ros.effects.loading import origins

    for text in origins(library_of(rig)):
        console.print(text, soft_wrap=True)
    names = ", ".join(one.label for one in rig.effects)
    if source == "serial":
        console.print(f"not simulated, for the hardware has its own: {names}; the log's rig names them", soft_wrap=True)
    else:
        console.print(f"the simulated rig has these effects: {names}", soft_wrap=True)


def _check(values: Values, target: Path) -> Rig:
    """Find every mistake before a process starts: rig, trim, effects, road and output file."""
    from pneumo_ros.road import PARAMETERS, build_road

    rig = _checked_rig(str(values["road_profile"].get("rig", "")))
    _checked_rig(str(values.get("plant", {}).get("simulated_rig", "")))
    _check_profile(values, rig)
    own = {p.name: values["road_profile"].get(p.name, p.default) for p in PARAMETERS}
    build_road(own, wheelbase=rig.wheelbase, length_scale=rig.length_scale.value, where="road")
    if target.suffix != ".mcap":
        raise InputError("a log's name must end in .mcap", where=target, remedy="choose another name")
    if target.exists():
        raise InputError("the log exists already", where=target, remedy="choose another name or move it away")
    return rig


def _checked_rig(file: str) -> Rig:
    """A rig that stands at its trim, with effects that the library has; '' is the nominal one."""
    from pneumo_ros.plant.trim import trim
    from pneumo_ros.rig import load_rig

    rig = load_rig(file or None)
    trim(rig)
    if rig.effects:
        from pneumo_ros.effects.configured import configured_effects, library_of

        configured_effects(rig, library_of(rig))
    return rig


def _compile(console: Console, file: str | Path | None, plant: dict[str, Value]) -> None:
    """Equations with effects are compiled once on a machine, in many seconds on a slow one: no node waits for that."""
    from pneumo_ros.rig import load_rig

    rig = load_rig(file or None)
    if not rig.diagnosed:
        return
    import numpy as np

    from pneumo_ros.effects.stepping import stepped_rig
    from pneumo_ros.plant.trim import trim

    with console.status("compiling the rig's equations, once on this machine"):
        stepped = stepped_rig(rig, 1.0 / float(plant["rate_hz"]))
        stepped.step(stepped.init(), trim(rig).command, np.zeros((2, 2)))


def _check_profile(values: Values, rig: Rig) -> None:
    """The valve profile, if one is played, against the rig and, on hardware, against the driver's own limits."""
    from pneumo_ros.control.half_car import PROFILE
    from pneumo_ros.daq.safety_config import load_safety
    from pneumo_ros.plant.trim import trim
    from pneumo_ros.road.valve_profile import read_profile

    if values["controller"].get("controller") != PROFILE:
        return
    largest = rig.inlet_area_max.value
    if "daq" in values:
        safety = load_safety(str(values["daq"].get("safety", "")) or None)
        largest = min(largest, safety.limits["command_area"].trip_high)
    read_profile(str(values["controller"].get("valve_profile", "")), trim(rig).command, largest)


def _check_hardware(own: dict[str, Value], single_process: bool) -> None:
    """The same for what only hardware has."""
    from pneumo_ros.daq.calibration_file import load_calibration
    from pneumo_ros.daq.safety_config import load_safety

    if single_process:
        raise InputError("hardware needs a process of its own", where="--single-process", remedy="leave it out")
    if "calibration" not in own:
        raise InputError(
            "hardware needs its own calibration",
            where="--calibration",
            allowed="appendix_c, appendix_c_corrected, or a YAML file of pneumo calibrate",
            remedy="pneumo calibrate --check --calibration NAME says what is doubtful about one",
        )
    load_calibration(str(own["calibration"]))
    load_safety(str(own.get("safety", "")) or None)
    if not Path(str(own["port"])).exists():
        raise InputError(
            "no such port", where="--port", value=own["port"], remedy="plug it in, or start pneumo emulate"
        )


def _tell_doubts(console: Console, name: str) -> None:
    """What the check of the calibration doubts on a board as the emulated one, in a line."""
    from pneumo_ros.daq.calibration_check import check_calibration
    from pneumo_ros.daq.calibration_file import load_calibration
    from pneumo_ros.daq.emulator.board import board_identity

    doubts = check_calibration(load_calibration(name), board_identity())
    if doubts:
        channels = ", ".join(dict.fromkeys(doubt.channel for doubt in doubts))
        console.print(
            f"[yellow]doubtful calibration[/] {name}: {channels}; "
            f"pneumo calibrate --check --calibration {name} says why",
            highlight=False,
            soft_wrap=True,
        )


def _run_session(
    console: Console, values: Values, target: Path, single_process: bool, place: Place, verbose: bool
) -> None:
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    from pneumo_ros.session.supervisor import NodeProcess, SessionError, StopAsked, Supervisor

    rig_node = "daq" if "daq" in values else "plant"
    names = ("single_process",) if single_process else session_nodes("serial" if rig_node == "daq" else "sim")
    nodes = [NodeProcess(name, f"pneumo_ros.nodes.{name}") for name in names]
    lead = "single_process" if single_process else rig_node
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.1f} s of {task.fields[length]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    length = float(values[rig_node]["duration"])
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("session", total=length or None, length=f"{length:g} s" if length else "any")
        show = (lambda node, line: console.print(f"{node}: {line}", markup=False)) if verbose else (lambda _, __: None)
        supervisor = Supervisor(nodes, values, lead, place, lambda t: progress.update(task, completed=t), show)
        try:
            with supervisor:
                supervisor.wait()
        except SessionError as error:
            progress.stop()
            Console(stderr=True, highlight=False, soft_wrap=True).print(
                f"[red]session failed:[/red] {escape(str(error))}"
            )
            _save_what_is_left(target)
            raise typer.Exit(FAILED) from error
        except StopAsked as asked:
            progress.stop()
            _tell_stopped(console, target, str(asked), supervisor.failure_of_lead())


def _tell_stopped(console: Console, target: Path, by: str, failure: str) -> None:
    """What became of the log when somebody ended the session; an end before the first sample leaves none."""
    from pneumo_ros.log import topics
    from pneumo_ros.log.reading import read_log

    if failure:
        console.print(f"stopped by {by}, after this: {failure}", markup=False, soft_wrap=True)
        _save_what_is_left(target)
        raise typer.Exit(FAILED)
    if not target.exists():
        console.print(f"stopped by {by} before the session began: there is no log")
        raise typer.Exit(INTERRUPTED)
    found = read_log(target, [topics.DISPLACEMENT.name]).topics.get(topics.DISPLACEMENT.name)
    if found is None or found.count < MIN_SAMPLES:
        console.print(f"stopped by {by} before there was anything to show; the log holds the start: {target}")
        raise typer.Exit(INTERRUPTED)
    console.print(f"stopped by {by}; the log is finished")


class Wanted(NamedTuple):
    """What is made of a finished session."""

    summary: bool
    picture: bool
    page: bool


def _report_unless_asked_to_end(console: Console, target: Path, values: Values, wanted: Wanted) -> None:
    """The session and its log are done; who asks again to end gets no report."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
    try:
        _report(console, target, values, wanted)
    except KeyboardInterrupt:
        console.print(f"no report was made; log {target}")
        raise typer.Exit from None


def _save_what_is_left(target: Path) -> None:
    """Say where the log is; if its recorder died, make a readable one of what it had written."""
    from pneumo_ros.log.repair import recover

    out = Console(stderr=True, highlight=False, soft_wrap=True)
    part = target.with_name(target.name + ".part")
    if target.exists():
        out.print(f"log until then: {target}")
        return
    if not part.exists():
        return
    try:
        found = recover(part, target.with_suffix(".recovered.mcap"))
    except InputError as error:
        out.print(f"the recorder left nothing that can be read: {error}")
        return
    out.print(f"recovered {found.kept} messages: {found.output}")


def _report(console: Console, target: Path, values: Values, wanted: Wanted) -> None:
    """Table of the active run beside passive valves on the same road, the picture and the page."""
    from pneumo_ros.cli.passive import passive_run
    from pneumo_ros.log.reading import read_log
    from pneumo_ros.rig import load_rig
    from pneumo_ros.session.summary import load_session

    if not any(wanted):
        console.print(f"log      {target}", soft_wrap=True)
        return
    session = load_session(target)
    other = passive_run(session, load_rig(str(values["road_profile"].get("rig", "")) or None))
    if wanted.summary:
        _summarise(console, target, session, other)
    console.print(f"log      {target}", soft_wrap=True)
    if wanted.picture:
        from pneumo_ros.session.picture import draw_session

        png = target.with_suffix(".png")
        draw_session(session, png, other, f"{values['controller']['controller']}, {target.name}")
        console.print(f"picture  {png}", soft_wrap=True)
    if wanted.page:
        from pneumo_ros.session.report import write_report

        html = target.with_suffix(".html")
        write_report(read_log(target), html, other)
        console.print(f"report   {html}", soft_wrap=True)


def _summarise(console: Console, target: Path, session: Recorded, other: Recorded | None) -> None:
    """Tables of ride and loops, and what a reader must be warned of."""
    from pneumo_ros.cli.tables import summary_table, timing_table
    from pneumo_ros.log.reading import read_log
    from pneumo_ros.session.summary import loop_timing, summarise, wall_time
    from pneumo_ros.session.warnings import warnings_of

    loop = loop_timing(target)
    ours = summarise(session, loop, wall_time(target), warnings_of(read_log(target), loop, session.mode))
    console.print(summary_table(ours, summarise(other) if other is not None else None))
    console.print(timing_table(ours))
    for line in ours.warnings:
        console.print(f"[yellow]warning[/]  {line}", highlight=False, soft_wrap=True)


if __name__ == "__main__":
    app()
