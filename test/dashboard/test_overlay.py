# SPDX-License-Identifier: Apache-2.0
"""Runs laid over each other: a diagnosis's residual log, two sessions; a log of something else says what it has."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bokeh.document import Document
from bokeh.models import CheckboxButtonGroup, CrosshairTool, Legend, Plot, Select, TabPanel, Toolbar, WheelZoomTool
from helpers.rig_logs import noisy, simulated, write_log
from helpers.small_logs import STRING, text, write

from pneumo_ros.dashboard.overlay import CHANNELS, Overlay, is_residual, remainders, series_of
from pneumo_ros.dashboard.shell import ROOM
from pneumo_ros.dashboard.source import Playback
from pneumo_ros.diagnosis.half_car.signals import read_signals
from pneumo_ros.diagnosis.report.residual_log import write_residual_log
from pneumo_ros.errors import InputError
from pneumo_ros.log.reading import read_log
from pneumo_ros.rig import load_rig


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    clean, road, commands = simulated(3.0, 1)
    path = tmp_path_factory.mktemp("logs") / "held.mcap"
    return write_log(path, noisy(clean, 1), road, commands, [load_rig().to_yaml()])


def test_a_residual_log_shows_every_run(tmp_path: Path, session: Path) -> None:
    held = read_signals(session)
    runs = {"nominal": held.measured + 1e-3, "refit": held.measured, "best": held.measured}
    write_residual_log(tmp_path / "residual.mcap", held, runs)
    log = read_log(tmp_path / "residual.mcap")
    series = series_of(log)
    assert is_residual(log)
    assert [one.name for one in series] == ["measured", "nominal", "refit", "corrected", "residual"]
    np.testing.assert_allclose(series[1].values[:, 0] - series[0].values[:, 0], 1.0, atol=1e-9)  # mm
    assert np.abs(series[-1].values).max() < 1e-9
    left = remainders(series[:-1])
    assert [one.name for one in left] == ["minus nominal", "minus refit", "minus corrected"]
    np.testing.assert_allclose(left[0].values[:, 0], -1.0, atol=1e-9)


def test_the_runs_of_a_diagnosis_are_explained(tmp_path: Path, session: Path) -> None:
    held = read_signals(session)
    runs = {"nominal": held.measured + 1e-3, "refit": held.measured, "best": held.measured}
    write_residual_log(tmp_path / "residual.mcap", held, runs)
    document = Document()
    Overlay(document, "residual.mcap", series_of(read_log(tmp_path / "residual.mcap")))
    heading, root = document.roots
    for part in ("residual.mcap", "refit: parameters re-estimated", "corrected: with the best explanation"):
        assert part in heading.text, heading.text
    legends = [legend for legend in root.select({"type": Legend}) if "corrected" in str(legend.items[-1].label)]
    lines = [sum(len(item.label.value) for item in legend.items[: legend.ncols]) for legend in legends
             if isinstance(legend.ncols, int)]  # fmt: skip
    lines += [sum(len(item.label.value) for item in legend.items) for legend in legends if legend.ncols == "auto"]
    assert len(lines) == 19 and max(lines) <= ROOM  # a telephone cuts off what is longer


def test_two_sessions_meet_on_their_road(tmp_path: Path, session: Path) -> None:
    """The second log commands its valves for a second before the road begins, as a log of hardware does."""
    clean, road, commands = simulated(3.0, 1)
    wait = [np.vstack([np.repeat(part[:1], 500, axis=0), part]) for part in (noisy(clean, 2), road, commands)]
    later = write_log(tmp_path / "later.mcap", *wait, [load_rig().to_yaml()])
    first, second = series_of(read_log(session), read_log(later))
    there = np.interp(first.time, second.time, second.values[:, 0])
    assert np.std(there - first.values[:, 0]) < 0.05  # mm; two draws of 10 um


def test_the_page_has_what_comparing_needs(session: Path) -> None:
    log = read_log(session)
    document = Document()
    Overlay(document, "two", series_of(log, log))
    heading, root = document.roots
    assert "<b>two</b>" in heading.text and "held.mcap and held.mcap" in heading.text
    assert {str(tab.title) for tab in root.select({"type": TabPanel})} == {
        "over time",
        "residual",
        "spectrum",
        "XY",
    }
    assert len(list(root.select({"type": CrosshairTool}))) == 19
    assert len(list(root.select({"type": WheelZoomTool}))) == 19
    tools = list(root.select({"type": Toolbar}))
    assert tools and all(tool.logo is None for tool in tools)
    plots = list(root.select({"type": Plot}))
    assert len(plots) == 19 and all(
        plot.toolbar_location == "above" for plot in plots
    )  # beside, four of its seven hide
    assert {str(plot.title.text) for plot in plots} >= {"front pressure", "front pressure, held.mcap"}
    Overlay(Document(), "another tab", series_of(log, log))  # a model belongs to one document
    assert all(legend.click_policy == "hide" for legend in root.select({"type": Legend}))
    choosers = list(root.select({"type": CheckboxButtonGroup}))
    assert [len(chooser.labels) for chooser in choosers] == [len(CHANNELS)] * 2
    across = root.select_one({"type": Select, "name": "x"})
    assert across is not None
    assert across.options[:2] == ["sprung front", "sprung rear"], "as the plots are called"
    across.value = "front pressure"
    assert any("front pressure, kPa" in str(axis.axis_label) for axis in root.select({"name": None}) if
               hasattr(axis, "axis_label"))  # fmt: skip


def test_a_log_of_something_else_says_what_it_has(tmp_path: Path) -> None:
    log = read_log(write(tmp_path / "else.mcap", [("/chatter", STRING, 1, text("hello"))]))
    for ask in (lambda: Playback(log), lambda: series_of(log)):
        with pytest.raises(InputError, match=r"nothing to show.*/chatter \(1\)"):
            ask()
