# SPDX-License-Identifier: Apache-2.0
"""Calibration: Appendix C to the digit, scaling both ways, fits from points, refusals, zero and span."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pneumo_ros.daq.calibration import SENSORS
from pneumo_ros.daq.calibration_check import check_calibration, resolution
from pneumo_ros.daq.calibration_file import calibration_to_yaml, load_calibration, parse_calibration
from pneumo_ros.daq.calibration_fit import fit_points, read_points
from pneumo_ros.daq.emulator.board import board_identity
from pneumo_ros.daq.frames import Channel, InputRange, Valve
from pneumo_ros.daq.scaling import check_map, input_scale, output_scale
from pneumo_ros.errors import InputError
from pneumo_ros.rig import load_rig
from pneumo_ros.rig.channels import VALVES
from pneumo_ros.units import ATMOSPHERE, INCH, PSI


def test_appendix_c_is_the_default_to_the_digit() -> None:
    c = load_calibration()
    assert c.sensors["unsprung_front"].value(0.05, ATMOSPHERE) == pytest.approx((-106.41 * 0.05 + 5.63) * INCH)
    assert c.sensors["sprung_rear"].value(7.5, ATMOSPHERE) == pytest.approx((-1.151 * 7.5 + 9.82) * INCH)
    ambient = 98_000.0  # gauge psi becomes absolute with the session's ambient pressure
    assert c.sensors["front_pressure"].value(4.5, ambient) == pytest.approx(100.0 * PSI + ambient)
    assert c.sensors["rear_pressure"].value(0.5, ambient) == pytest.approx(ambient)


def test_valves_open_to_the_rigs_largest_inlet() -> None:
    c = load_calibration()
    assert c.valves["front_inlet"].area(10.0) == pytest.approx(load_rig().inlet_area_max.value)
    assert c.valves["rear_outlet"].volts(c.valves["rear_outlet"].area(3.0)) == pytest.approx(3.0)


def test_the_printed_c1_is_flagged_and_the_corrected_one_is_not() -> None:
    hello = board_identity(adc_bits=16)
    printed = check_calibration(load_calibration("appendix_c"), hello)
    assert {f.channel for f in printed if f.code == "resolution"} == {"unsprung_front", "unsprung_rear"}
    assert {f.channel for f in printed if f.code == "twin"} == {"unsprung_front", "unsprung_rear"}
    assert check_calibration(load_calibration("appendix_c_corrected"), hello) == []
    one_count = resolution(load_calibration("appendix_c"), hello, "unsprung_front")
    assert one_count == pytest.approx(0.0325 * INCH, rel=0.01)  # errata 12's figure


@pytest.mark.parametrize(("name", "bits"), [("appendix_c", 24), ("appendix_c_corrected", 16)])
def test_counts_and_values_are_inverse_to_half_a_count(name: str, bits: int) -> None:
    calibration = load_calibration(name)
    board = board_identity(adc_bits=bits)
    # A board with its own order of channels and unequal ranges.
    order = (3, 6, 0, 1, 5, 2, 4)
    board = board._replace(inputs=tuple(InputRange(c, -10_000_000, 9_000_000 + 100_000 * c) for c in order))
    scale = input_scale(calibration, board, ATMOSPHERE)
    si = {"sprung_front": 0.031, "sprung_rear": 0.028, "unsprung_front": -0.017, "unsprung_rear": -0.02,
          "front_pressure": 2.8e5, "rear_pressure": 4.3e5, "supply_pressure": 7.9e5}  # fmt: skip
    counts = [0] * 7
    for place, entry in enumerate(board.inputs):
        volts = calibration.sensors[SENSORS[entry.channel]].volts(si[SENSORS[entry.channel]], ATMOSPHERE)
        low, high = entry.min_uv * 1e-6, entry.max_uv * 1e-6
        counts[place] = round((volts - 0.5 * (low + high)) / (high - low) * 2**bits)
    values = scale.values(scale.ordered(counts))
    for channel, value, slope in zip(SENSORS, values, scale.slopes, strict=True):
        assert abs(value - si[channel]) <= 0.5000001 * abs(slope)


def test_areas_and_dac_counts_are_inverse_to_half_a_count() -> None:
    scale = output_scale(load_calibration(), board_identity())
    areas = (1.2e-6, 3.4e-6, 1.93548e-6, 0.0)
    assert np.allclose(scale.areas(scale.counts(areas)), areas, atol=0.51 * 1.6129e-5 / 4095)
    assert scale.counts((1.0, -1.0, 0.0, 1.6129e-5)) == (4095, 0, 0, 4095)


def test_a_board_with_a_doubled_channel_is_refused() -> None:
    board = board_identity()
    with pytest.raises(InputError, match="input map"):
        check_map(board._replace(inputs=(board.inputs[1], *board.inputs[1:])))
    check_map(board)
    assert len(Channel) == len(SENSORS) and len(Valve) == len(VALVES)


def test_yaml_round_trip_and_mistakes_are_named() -> None:
    c = load_calibration("appendix_c_corrected")
    text = calibration_to_yaml(c)
    assert parse_calibration(text, "again") == c
    for broken, word in (
        (text.replace("gain: -1.0641", "gain: 0.0"), "measures nothing"),
        (text.replace("gain: -1.0641", "gain: .nan"), "finite"),
        (text.replace("unit: psig", "unit: furlong"), "psia"),
        (text.replace("sprung_rear:", "sprung_back:"), "sprung_back"),
        (text.replace("offset: 9.82", "ofset: 9.82"), "ofset"),
        ("calibration: [1, 2", "line"),
        ("{}", "calibration"),
    ):
        with pytest.raises(InputError, match=word):
            parse_calibration(broken, "test.yaml")


def points_file(tmp_path: Path, rows: list[tuple[str, float, str, float]]) -> Path:
    path = tmp_path / "points.csv"
    path.write_text("channel,reference,unit,volts\n" + "".join(f"{c},{r!r},{u},{v!r}\n" for c, r, u, v in rows))
    return path


def rows_of(gain: float, offset: float, references: np.ndarray, repeats: int, noise: float, seed: int):
    rng = np.random.default_rng(seed)
    return [
        ("sprung_front", float(r), "in", float((r - offset) / gain + noise * rng.standard_normal()))
        for r in references for _ in range(repeats)
    ]  # fmt: skip


def test_fit_recovers_the_line_and_its_interval_covers_it(tmp_path: Path) -> None:
    """The 95 % interval holds the true gain in about 95 % of repetitions (here 200: 0.90 to 0.985)."""
    hits = 0
    for seed in range(200):
        rows = rows_of(-1.151, 9.82, np.linspace(0.5, 2.0, 8), 20, 2e-3, seed)
        (points,) = read_points(points_file(tmp_path, rows))
        fit = fit_points(points)
        hits += abs(fit.gain + 1.151) <= fit.gain_half
        assert abs(fit.offset - 9.82) < 0.03
    assert 0.90 <= hits / 200 <= 0.985
    assert points.repeats.tolist() == [20] * 8 and points.scatter == pytest.approx(2e-3, rel=0.2)


def test_bad_points_are_refused_and_the_reason_is_said(tmp_path: Path) -> None:
    good = np.linspace(0.5, 2.0, 6)
    cases = [
        (rows_of(-1.151, 9.82, good[:3], 10, 1e-4, 0), "too few"),
        (rows_of(-1.151, 9.82, 1.0 + 1e-3 * good, 10, 1e-3, 0), "no spread"),
        ([*rows_of(-1.151, 9.82, good, 10, 1e-4, 0), ("sprung_front", 2.2, "in", 9.0)], "not monotone"),
        ([("sprung_front", 1.0, "psig", 1.0)], "unknown unit"),
        ([("nose", 1.0, "in", 1.0)], "unknown channel"),
        ([("sprung_front", 1.0, "in", float("nan"))], "finite"),
    ]
    for rows, word in cases:
        with pytest.raises(InputError, match=word):
            for points in read_points(points_file(tmp_path, rows)):
                fit_points(points)
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(InputError, match="not a table"):
        read_points(tmp_path / "empty.csv")


def test_zero_and_span() -> None:
    c = load_calibration("appendix_c_corrected")
    zeroed = c.zeroed({"sprung_front": 0.0312}, {"sprung_front": 0.0300})
    volts = c.sensors["sprung_front"].volts(0.0312, ATMOSPHERE)
    assert zeroed.sensors["sprung_front"].value(volts, ATMOSPHERE) == pytest.approx(0.0300)
    assert zeroed.sensors["sprung_rear"] == c.sensors["sprung_rear"]
    spanned = c.spanned("front_pressure", (1.0, 2e5), (3.0, 5e5), 1e5, "2026-01-01").sensors["front_pressure"]
    assert spanned.value(1.0, 1e5) == pytest.approx(2e5) and spanned.value(3.0, 1e5) == pytest.approx(5e5)
    assert spanned.unit == "psig" and spanned.date == "2026-01-01"


def test_command_line_writes_a_file_that_loads_and_flags_the_default(tmp_path: Path) -> None:
    from typer.testing import CliRunner

    from pneumo_ros.cli.calibrate import app

    csv = points_file(tmp_path, rows_of(-1.2, 9.9, np.linspace(0.5, 2.0, 8), 10, 1e-4, 3))
    output, plot = tmp_path / "mine.yaml", tmp_path / "mine.png"
    run = CliRunner().invoke(app, [str(csv), "--output", str(output), "--plot", str(plot)])
    assert run.exit_code == 0, run.output
    mine = load_calibration(output)
    assert mine.sensors["sprung_front"].gain == pytest.approx(-1.2, abs=1e-3)
    assert mine.sensors["sprung_front"].interval is not None and plot.stat().st_size > 10_000
    flagged = CliRunner().invoke(app, ["--check"])
    assert flagged.exit_code == 1 and "errata.md 12" in flagged.output
    assert CliRunner().invoke(app, ["--check", "--calibration", "appendix_c_corrected"]).exit_code == 0
