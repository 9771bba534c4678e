# SPDX-License-Identifier: Apache-2.0
"""FMUs built by the tests themselves: one C file, compiled with fmpy's headers, zipped with a description."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from scipy.integrate import solve_ivp

SOURCE = Path(__file__).parents[1] / "data" / "fmu.c"
PARAMETER = 'causality="parameter" variability="tunable" initial="exact"'
OWN = 'causality="output" variability="continuous" initial="calculated"'
DRIVE = 'causality="input" variability="continuous"'
START = 'causality="output" variability="continuous" initial="exact"'
# Name, attributes, start, the state it is the rate of; their numbers are the source's.
VARIABLES: tuple[tuple[str, str, str, int | None], ...] = (
    ("body.s", START, "0", None),
    ("body.v", START, "0", None),
    ("der(body.s)", OWN, "", 0),
    ("der(body.v)", OWN, "", 1),
    ("mass", PARAMETER, "3", None),
    ("damping", PARAMETER, "0.5", None),
    ("stiffness", PARAMETER, "1000", None),
    ("base", DRIVE, "0", None),
    ("base_speed", DRIVE, "0", None),
    ("to_ground", DRIVE, "0", None),
    ("to_base", DRIVE, "0", None),
    ("bounce", PARAMETER, "0.8", None),
    ("swing", OWN, "", None),
)
FRAME_YAML = """
rig: base-excited frame
time: {field: t, unit: s}
channels: {floor: {field: x, unit: mm}}
inputs:
  base: {field: y, unit: mm}
  base_speed: {rate_of: base}
states: {floor: floor, speed: rate of floor}
parameters: {mass: 3.0799 +- 0.03 kg, damping: 0.669 +- 0.13 N s/m, stiffness: 1191 +- 24 N/m}
fmu:
  names: {floor: body.s, speed: body.v}
  slots:
    floor_to_ground: {force: to_ground, travel: body.s, rate: body.v}
    floor_to_base: {force: to_base, travel: swing, rate: body.v - base_speed}
    floor: sensor
"""


def headers() -> Path:
    """Folder of the standard's headers, which come with fmpy."""
    import fmpy

    return Path(str(fmpy.__file__)).parent / "c-code"


def unused(version: int) -> str:
    """Functions that a library must have and these models have no use for: whoever calls one is told that it failed."""
    from fmpy import fmi2, fmi3

    kinds = (fmi2.FMU2Model, fmi2.FMU2Slave) if version == 2 else (fmi3.FMU3Model, fmi3.FMU3Slave)
    source = SOURCE.read_text(encoding="utf-8")
    names = {name for kind in kinds for name in dir(kind) if name.startswith(f"fmi{version}")}
    return "".join(f"int {name}(void) {{ return 3; }}\n" for name in sorted(names) if f" {name}(" not in source)


def compiled(folder: Path, version: int, defines: tuple[str, ...] = ()) -> Path:
    """The shared library."""
    library = folder / f"frame_{version}_{'_'.join(defines)}.so"
    others = library.with_suffix(".c")
    others.write_text(unused(version), encoding="utf-8")
    words = ["gcc", "-O2", "-shared", "-fPIC", "-Wall", "-Wextra", f"-DFMI={version}", *(f"-D{d}" for d in defines)]
    subprocess.run([*words, f"-I{headers()}", str(SOURCE), str(others), "-o", str(library), "-lm"], check=True)
    others.unlink()
    return library


def description(version: int, interfaces: tuple[str, ...], events: bool, completed: bool = False) -> str:
    """modelDescription.xml."""
    return _second(interfaces, events, completed) if version == 2 else _third(interfaces, completed)


def _interface(name: str, attribute: str) -> str:
    return f'<{name} modelIdentifier="frame" {attribute if name == "ModelExchange" else ""}/>'


def _second(interfaces: tuple[str, ...], events: bool, completed: bool) -> str:
    rows = []
    for number, (name, attributes, start, state) in enumerate(VARIABLES):
        real = (f'start="{start}" ' if start else "") + (f'derivative="{state + 1}"' if state is not None else "")
        rows.append(f'<ScalarVariable name={quoteattr(name)} valueReference="{number}" {attributes}><Real {real}/>'
                    "</ScalarVariable>")  # fmt: skip
    not_needed = f'completedIntegratorStepNotNeeded="{str(not completed).lower()}"'
    kinds = "".join(_interface(name, not_needed) for name in interfaces)
    structure = '<Outputs/><Derivatives><Unknown index="3"/><Unknown index="4"/></Derivatives>'
    return (f'<?xml version="1.0"?><fmiModelDescription fmiVersion="2.0" modelName="frame" guid="{{frame}}" '
            f'numberOfEventIndicators="{int(events)}">{kinds}<ModelVariables>{"".join(rows)}</ModelVariables>'
            f"<ModelStructure>{structure}</ModelStructure></fmiModelDescription>")  # fmt: skip


def _third(interfaces: tuple[str, ...], completed: bool) -> str:
    rows = ['<Float64 name="time" valueReference="99" causality="independent" variability="continuous"/>']
    for number, (name, attributes, start, state) in enumerate(VARIABLES):
        more = (f'start="{start}" ' if start else "") + (f'derivative="{state}"' if state is not None else "")
        rows.append(f'<Float64 name={quoteattr(name)} valueReference="{number}" {attributes} {more}/>')
    kinds = "".join(_interface(name, f'needsCompletedIntegratorStep="{str(completed).lower()}"') for name in interfaces)
    structure = "".join(f'<ContinuousStateDerivative valueReference="{k}"/>' for k in (2, 3))
    return (f'<?xml version="1.0"?><fmiModelDescription fmiVersion="3.0" modelName="frame" '
            f'instantiationToken="{{frame}}">{kinds}<ModelVariables>{"".join(rows)}</ModelVariables>'
            f"<ModelStructure>{structure}</ModelStructure></fmiModelDescription>")  # fmt: skip


def platform(version: int) -> str:
    """Folder of this platform below ``binaries/``."""
    import fmpy

    return str(fmpy.platform if version == 2 else fmpy.platform_tuple)


def built(
    path: Path,
    version: int = 2,
    interfaces: tuple[str, ...] = ("ModelExchange",),
    defines: tuple[str, ...] = (),
    completed: bool = False,
) -> Path:
    """An FMU at a path, beside it nothing."""
    assert sys.platform.startswith("linux"), "the tests build FMUs with gcc for Linux"
    library = compiled(path.parent, version, defines)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description(version, interfaces, "BALL" in defines, completed))
        archive.write(library, f"binaries/{platform(version)}/frame.so")
    library.unlink()
    return path


def with_names(fmu: Path, names: str = FRAME_YAML) -> Path:
    """The FMU with its YAML beside it."""
    fmu.with_suffix(".yaml").write_text(names, encoding="utf-8")
    return fmu


def frame_log(path: Path, friction: float = 1.3, seconds: float = 5.0) -> Path:
    """The frame on a base that shakes at 1 Hz, with dry friction against the ground that turns over within 0.5 mm/s."""
    period = 0.01
    t = np.arange(0.0, seconds, period)
    turn = 2.0 * np.pi

    def base(time: Any) -> Any:
        return 1.8e-3 * np.sin(turn * time) + 0.3e-3 * np.sin(2.3 * turn * time)

    def rates(time: float, z: np.ndarray) -> list[float]:
        speed = 1.8e-3 * turn * np.cos(turn * time) + 0.3e-3 * 2.3 * turn * np.cos(2.3 * turn * time)
        force = -1200.0 * (z[0] - base(time)) - 0.7 * (z[1] - speed) - friction * np.tanh(z[1] / 5e-4)
        return [z[1], force / 3.08]

    x = solve_ivp(rates, (0.0, t[-1]), (0.0, 0.0), t_eval=t, method="LSODA", rtol=1e-8, atol=1e-10).y[0]
    x += np.random.default_rng(5).normal(0.0, 5e-6, len(t))
    np.savetxt(path, np.column_stack([t, 1e3 * x, 1e3 * base(t)]), "%.6f", ",", header="t,x,y", comments="")
    return path
