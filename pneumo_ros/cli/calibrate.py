# SPDX-License-Identifier: Apache-2.0
"""`pneumo calibrate`: a calibration from measured points, or what is doubtful about an existing one."""

from __future__ import annotations

from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pneumo_ros.cli.app import App
from pneumo_ros.cli.existing import Overwrite, refuse_existing

if TYPE_CHECKING:
    from pneumo_ros.cli.terminal import Console
    from pneumo_ros.daq.calibration_fit import Fit


app = App(add_completion=False)


@app.command()
def calibrate(
    points: Annotated[
        Path | None,
        typer.Argument(help="CSV with a row a reading: channel,reference,unit,volts; repeated readings are averaged."),
    ] = None,
    check: Annotated[bool, typer.Option("--check", help="List what is doubtful; exit code 1 if anything is.")] = False,
    calibration: Annotated[
        str, typer.Option(help="Calibration to check, or to take the other channels from: name or YAML file.")
    ] = "appendix_c",
    output: Annotated[Path, typer.Option("--output", "-o", help="Calibration file to write.")] = Path(
        "calibration.yaml"
    ),
    overwrite: Overwrite = False,
    plot: Annotated[Path | None, typer.Option(help="Picture of points, lines and residuals (PNG, PDF, SVG).")] = None,
    adc_bits: Annotated[int, typer.Option(min=8, max=32, help="Width of the board's converter, bit.")] = 16,
    adc_range: Annotated[float, typer.Option(min=0.1, max=100.0, help="Range of the board's inputs, +- V.")] = 10.0,
) -> None:
    """Fit calibration lines to measured points, as Appendix C of the thesis did, or check a calibration."""
    from pneumo_ros.errors import InputError

    if points is None and not check:
        raise InputError("nothing to do", where="pneumo calibrate", remedy="give a CSV file of points, or --check")
    if points is not None:
        calibration = str(_fit(points, calibration, output, plot, overwrite))
    if check:
        _check(calibration, adc_bits, adc_range)


def _fit(points: Path, base: str, output: Path, plot: Path | None, overwrite: bool) -> Path:
    from dataclasses import replace

    from pneumo_ros.daq.calibration_file import load_calibration, save_calibration
    from pneumo_ros.daq.calibration_fit import fit_points, read_points
    from pneumo_ros.errors import InputError

    if output.suffix not in (".yaml", ".yml"):
        raise InputError("not a YAML name", where="--output", value=str(output), allowed="a name that ends in .yaml")
    refuse_existing([output, *([plot] if plot is not None else [])], overwrite)
    fits = [fit_points(channel, points) for channel in read_points(points)]
    old, today = load_calibration(base), date.today().isoformat()
    lines = {fit.points.channel: fit.calibration(today, f"pneumo calibrate {points.name}") for fit in fits}
    _show(fits)
    if plot is not None:
        _plot(fits, plot)
    save_calibration(replace(old, name=output.stem, sensors={**old.sensors, **lines}), output)
    _console().print(f"wrote {output}; channels without points are those of {old.name}")
    return output


def _show(fits: list[Fit]) -> None:
    for fit in fits:
        p = fit.points
        _console().print(
            f"[bold]{p.channel}[/bold] = {fit.gain:.6g} V + {fit.offset:.6g} {p.unit}   "
            f"(95 %: gain +- {fit.gain_half:.2g} {p.unit}/V, offset +- {fit.offset_half:.2g} {p.unit})\n"
            f"  {len(p.volts)} points from {int(p.repeats.sum())} readings; residual rms {fit.rms:.3g} {p.unit}, "
            f"largest {fit.nonlinearity:.2%} of the span",
            soft_wrap=True,
            highlight=False,
        )


def _plot(fits: list[Fit], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, len(fits), figsize=(4.5 * len(fits), 6), squeeze=False, height_ratios=(3, 1))
    for (top, bottom), fit in zip(axes.T, fits, strict=True):
        p = fit.points
        top.plot(
            p.volts, fit.gain * p.volts + fit.offset, color="tab:orange", label=f"{fit.gain:.5g} V + {fit.offset:.5g}"
        )
        top.plot(p.volts, p.reference, "o", color="tab:blue", label="mean readings")
        top.set(title=p.channel, ylabel=f"reference, {p.unit}")
        top.legend()
        bottom.plot(p.volts, fit.residuals, "o", color="tab:blue")
        bottom.axhline(0.0, color="black", linewidth=0.8)
        bottom.set(xlabel="mean reading, V", ylabel=f"residual, {p.unit}")
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)
    _console().print(f"wrote {path}")


def _check(name: str, adc_bits: int, adc_range: float) -> None:
    from pneumo_ros.daq.calibration_check import check_calibration
    from pneumo_ros.daq.calibration_file import load_calibration
    from pneumo_ros.daq.emulator.board import board_identity

    hello = board_identity(adc_bits=adc_bits, input_volts=(-adc_range, adc_range))
    findings = check_calibration(load_calibration(name), hello)
    console = _console()
    for finding in findings:
        console.print(f"[yellow]{finding.channel}[/yellow] ({finding.code}): {finding.text}", soft_wrap=True)
    if not findings:
        console.print(f"{name}: nothing doubtful at {adc_bits} bit over +-{adc_range:g} V")
        return
    console.print(f"{len(findings)} doubts about {name}; for Eq. C.1 as printed see docs/errata.md 12", soft_wrap=True)
    raise typer.Exit(1)


def _console() -> Console:
    from pneumo_ros.cli.terminal import Console

    return Console()


if __name__ == "__main__":
    app()
