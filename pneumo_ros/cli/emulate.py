# SPDX-License-Identifier: Apache-2.0
"""`pneumo emulate`: a serial port that behaves like the rig, for trying the hardware path without hardware."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pneumo_ros.cli.app import App

if TYPE_CHECKING:
    from pneumo_ros.cli.terminal import Console
    from pneumo_ros.parameters import Value
    from pneumo_ros.rig import Rig
    from pneumo_ros.road import Road

app = App(add_completion=False)


@app.command()
def emulate(
    link: Annotated[Path, typer.Option(help="Link to the pseudo-terminal; give it to --port.")] = Path("pneumo-rig"),
    road: Annotated[str, typer.Option(help="Road the shaker plays once armed: ISO class A-H, sine, sweep, step, "
                                           "bump, flat, or a CSV file.")] = "D",
    speed: Annotated[float, typer.Option(help="Full-scale speed, km/h.")] = 80.0,
    seed: Annotated[int, typer.Option(help="Seed of road, sensor noise and line faults.")] = 1,
    rig: Annotated[Path | None, typer.Option(help="Rig file (YAML), with its effects if pneumo diagnose --save-rig "
                                                  "wrote it; the nominal rig by default.")] = None,
    calibration: Annotated[str, typer.Option(help="What the sensors and valves are really like: name or file.")]
        = "appendix_c",
    adc_bits: Annotated[int, typer.Option(min=8, max=32, help="Width of the input converter, bit.")] = 16,
    dac_bits: Annotated[int, typer.Option(min=8, max=16, help="Width of the output converter, bit.")] = 12,
    converter_noise: Annotated[float, typer.Option(min=0.0, help="Noise of the input converter, counts rms.")] = 0.5,
    fault: Annotated[list[str] | None, typer.Option(
        help="kind@start[+duration][:key=value,...], repeatable; s after the first arming. See --list-faults.")] = None,
    list_faults: Annotated[bool, typer.Option("--list-faults", help="Show the faults and their options.")] = False,
    duration: Annotated[float | None, typer.Option(help="Stop by itself after so long, s.")] = None,
    start_us: Annotated[int, typer.Option(min=0, max=2**32 - 1, help="Device clock at boot, us.")] = 0,
    record: Annotated[Path | None, typer.Option(help="Write what the board really did (.npz).")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing.")] = False,
) -> None:  # fmt: skip
    """Emulate the rig on a pseudo-terminal: plant in real time, converters, valves, watchdog, and faults."""
    from pneumo_ros.cli.choices import check_road
    from pneumo_ros.cli.terminal import Console
    from pneumo_ros.daq.emulator.faults import parse_fault

    console = Console(quiet=quiet, highlight=False)
    if list_faults:
        _show_faults(console)
        return
    faults = [parse_fault(text) for text in fault or []]
    check_road(road)
    import signal
    import time

    from pneumo_ros.cli.rig_notes import tell_assumed
    from pneumo_ros.daq.calibration_file import load_calibration
    from pneumo_ros.daq.emulator.board import board_identity
    from pneumo_ros.daq.emulator.emulator import Emulator
    from pneumo_ros.daq.emulator.simulation import RigSimulation, SimulationSettings
    from pneumo_ros.daq.priority import freeze_startup_objects, prefer_this_process
    from pneumo_ros.effects.stepping import stepped_rig
    from pneumo_ros.rig import load_rig

    the_rig = load_rig(rig)
    tell_assumed(console, the_rig, rig)
    hello = board_identity(boot_id=round(time.time()) % 2**32, adc_bits=adc_bits, dac_bits=dac_bits)
    simulation = RigSimulation(
        the_rig, _road(road, speed, seed, the_rig), hello, load_calibration(calibration),
        SimulationSettings(seed, converter_noise), stepped_rig(the_rig, hello.sample_period_us * 1e-6),
    )  # fmt: skip
    say = lambda state: console.print(f"board: {state.name.lower()}")  # noqa: E731
    emulator = Emulator(simulation, link, faults, seed, start_us, say)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: emulator.stop())
    simulation.warm_up()
    prefer_this_process()
    freeze_startup_objects()
    if the_rig.effects:
        from pneumo_ros.effects.configured import library_of
        from pneumo_ros.effects.loading import origins

        for text in origins(library_of(the_rig)):
            console.print(text, soft_wrap=True)
        console.print("with its effects: " + ", ".join(one.label for one in the_rig.effects), soft_wrap=True)
    console.print(f"emulating the rig on {link}; Ctrl-C ends it; try", soft_wrap=True)
    console.print(f"  pneumo run --source serial --port {link} --calibration {calibration}", soft_wrap=True)
    done = emulator.run(duration)
    if record is not None:
        done.save(record)


def _road(road: str, speed: float, seed: int, rig: Rig) -> Road:
    from pneumo_ros.road import build_road

    values: dict[str, Value]
    if len(road) == 1:
        values = {"kind": "iso", "iso_class": road.upper()}
    elif road.lower().endswith(".csv"):
        values = {"kind": "file", "path": road}
    else:
        values = {"kind": road}
    given = {**values, "speed_kmh": speed, "seed": seed}
    return build_road(given, wheelbase=rig.wheelbase, length_scale=rig.length_scale.value, where="--road")


def _show_faults(console: Console) -> None:
    from pneumo_ros.daq.emulator.faults import DEFAULTS, MEANING, PULSES

    for kind, options in DEFAULTS.items():
        defaults = ",".join(f"{key}={value}" for key, value in options.items())
        span = f"+{PULSES[kind]:g}" if kind in PULSES else ""
        console.print(f"{kind}@0{span}{':' if defaults else ''}{defaults}  [dim]{MEANING[kind]}[/dim]", soft_wrap=True)


if __name__ == "__main__":
    app()
