# SPDX-License-Identifier: Apache-2.0
"""Every mistake is found before a process starts: rig, trim, effects, road, valve profile, hardware, output file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pneumo_ros.cli.terminal import Console
from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.parameters import Value
    from pneumo_ros.rig import Rig
    from pneumo_ros.session.plan import Values


def tell_effects(console: Console, rig: Rig, source: str) -> None:
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


def check_session(values: Values, target: Path) -> Rig:
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


def compile_rig(console: Console, file: str | Path | None, plant: dict[str, Value]) -> None:
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


def check_hardware(own: dict[str, Value], single_process: bool) -> None:
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


def tell_doubts(console: Console, name: str) -> None:
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
