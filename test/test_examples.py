# SPDX-License-Identifier: Apache-2.0
"""The engine on other rigs: real measurements with a known effect (skipped where the data are not there)."""

from __future__ import annotations

from pathlib import Path

import frame_friction
import leaking_chamber
import numpy as np
import pytest

from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.effects.parameters import Active
from pneumo_ros.errors import InputError


@pytest.fixture(scope="module")
def real(shared: Path) -> Path:
    folder = shared / "data" / "real"
    if not folder.is_dir():
        pytest.skip(f"real measurements not found at {folder}")
    return folder


@pytest.fixture(scope="module")
def frame(real: Path) -> Diagnosis:
    return frame_friction.diagnose_frame(real)


def test_the_frames_friction_against_the_ground_is_named(frame: Diagnosis) -> None:
    assert frame.verdict == "coulomb_friction"
    assert frame.location[0][0] == "floor_to_ground"
    assert 1.0 < frame.active[0].values[0] < 1.6  # N


def test_the_frames_held_out_gap_shrinks(frame: Diagnosis) -> None:
    assert 1.0 - frame.gap.best / frame.gap.nominal > 0.85
    assert 1.0 - frame.gap.best / frame.gap.refit > 0.85


def test_friction_against_the_base_does_not_do(frame: Diagnosis, real: Path) -> None:
    """Dry friction on the relative velocity, as large as it likes, leaves most of the gap: the location is told."""
    record = frame_friction.read_record(real)
    half = len(record.measured) // 2
    held = record.slice(half, len(record.measured))
    model = frame_friction.Frame()
    nominal = np.array([p.nominal for p in model.parameters])
    start, _ = model.initial(held)

    def gap(site: str, force: float) -> float:
        predicted = model.predict(held, nominal, start, (Active("coulomb_friction", site, (force,)),))
        return float(np.sqrt(np.mean((predicted - held.measured) ** 2)) / held.measured.std())

    forces = np.linspace(0.05, 6.0, 40)
    assert min(gap("ground", f) for f in forces) < 0.15
    assert min(gap("base", f) for f in forces) > 0.4


def test_the_frame_without_damping_keeps_its_energy() -> None:
    """Base at rest: energy of the nominal frame stays within 1e-4 over 5 s, and dry friction only takes it away."""
    count = 1250
    base = np.zeros((2 * frame_friction.SUBSTEPS * (count - 1) + 1, 2))
    record = frame_friction.FrameRecord("still", 0.004, np.zeros((count, 1)), base)
    model, start = frame_friction.Frame(), np.array([2e-3, 0.0])
    free = model.predict(record, np.array([3.0, 0.0, 1191.0]), start, ())[:, 0]
    rubbed = model.predict(
        record, np.array([3.0, 0.0, 1191.0]), start, (Active("coulomb_friction", "ground", (0.1,)),)
    )[:, 0]
    assert np.abs(free[-200:]).max() == pytest.approx(2e-3, rel=2e-3)
    # Each half cycle takes 2 F / k off the amplitude.
    cycles = 5.0 * np.sqrt(1191.0 / 3.0) / (2.0 * np.pi)
    assert np.abs(rubbed[-80:]).max() == pytest.approx(max(2e-3 - 4 * 0.1 / 1191.0 * cycles, 0.0), abs=1e-4)


def test_the_printed_chamber_leaks_and_its_gap_shrinks(real: Path) -> None:
    found = leaking_chamber.diagnose_chamber(real / "chamber_Ultimaker_010.csv")
    assert found.verdict == "leak"
    assert 1.0 - found.gap.best / found.gap.nominal > 0.9


def test_the_tight_chamber_is_not_called_leaking(real: Path) -> None:
    """Its slope is far beyond chance (see the first line) and stays inside what a tight chamber may lose."""
    record = leaking_chamber.read_record(real / "chamber_Aluminium.csv")
    t, p = np.arange(len(record.measured)) * record.period, record.measured[:, 0]
    slope, covariance = np.polyfit(t, p, 1, cov=True)
    assert slope[0] < -20.0 * np.sqrt(covariance[0, 0])
    found = leaking_chamber.diagnose_chamber(real / "chamber_Aluminium.csv")
    assert found.verdict == "none"
    assert found.nuisance["seepage"].value * leaking_chamber.HOLD < leaking_chamber.TIGHT


def test_missing_measurements_are_said_in_one_line(tmp_path: Path) -> None:
    for read in (frame_friction.read_record, lambda folder: leaking_chamber.read_record(folder / "chamber_x.csv")):
        with pytest.raises(InputError, match="measurement not found"):
            read(tmp_path)
