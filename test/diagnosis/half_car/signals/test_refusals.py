# SPDX-License-Identifier: Apache-2.0
"""Logs and pairs of logs that are refused, in one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers.practice import OTHER_WRITER
from helpers.rig_logs import simulated, topics, write_log
from helpers.topic_tables import DISPLACEMENT, FRONT, REAR, ROAD, VALVE, Topics, rows, with_channel

from pneumo_ros.diagnosis.half_car.signals import check_pair, prepare, read_signals
from pneumo_ros.errors import InputError
from pneumo_ros.rig import load_rig
from pneumo_ros.units import ATMOSPHERE

Spoil = Callable[[Topics], Topics]


@pytest.fixture(scope="module")
def clean() -> Topics:
    return topics()


REFUSED: dict[str, tuple[Spoil, str]] = {
    "no road": (lambda t: {k: v for k, v in t.items() if k != ROAD}, "no /road/profile"),
    "no command": (lambda t: {k: v for k, v in t.items() if k != VALVE}, "no /valve/command"),
    "nothing measured": (lambda t: {k: t[k] for k in (ROAD, VALVE)}, "nothing was measured"),
    "unknown names": (
        lambda t: {**t, ROAD: t[ROAD]._replace(channels={"left": t[ROAD].channels["front"]})},
        "no 'front' in /road/profile",
    ),
    "only NaN": (
        lambda t: {**t, ROAD: with_channel(t[ROAD], "rear", np.full(4000, np.nan))},
        "'rear' of .* holds no number",
    ),
    "millimetres": (
        lambda t: {**t, DISPLACEMENT: with_channel(t[DISPLACEMENT], "sprung_front", np.linspace(20.0, 40.0, 4000))},
        "not in metres",
    ),
    "bar": (
        lambda t: {**t, FRONT: with_channel(t[FRONT], "pressure", t[FRONT].channels["pressure"] / 1e5)},
        "not in Pa absolute",
    ),
    "square millimetres": (
        lambda t: {**t, VALVE: with_channel(t[VALVE], "front_inlet", t[VALVE].channels["front_inlet"] * 1e6)},
        "not in m2",
    ),
    "road in millimetres": (
        lambda t: {**t, ROAD: with_channel(t[ROAD], "front", t[ROAD].channels["front"] * 1e3)},
        r"road height not in metres",
    ),
    "gauge pressures": (
        lambda t: {
            **t,
            **{p: with_channel(t[p], "pressure", t[p].channels["pressure"] - ATMOSPHERE) for p in (FRONT, REAR)},
        },
        "gauge, not absolute",
    ),
    "one clock set ahead": (
        lambda t: {**t, REAR: t[REAR]._replace(stamp=np.where(np.arange(4000) < 2000, 0.0, 0.1) + t[REAR].stamp)},
        "share no time base, value '0.1 s'",
    ),
    "too short": (lambda t: {k: rows(v, np.arange(500)) for k, v in t.items()}, "too short"),
    "too slow": (lambda t: {k: rows(v, np.arange(0, 4000, 40)) for k, v in t.items()}, "too slowly"),
    "stamps not set": (lambda t: {**t, ROAD: t[ROAD]._replace(stamp=np.zeros(4000))}, "stamps are not set"),
    "no overlap": (lambda t: {**t, ROAD: t[ROAD]._replace(stamp=t[ROAD].stamp + 100.0)}, "do not overlap"),
    "one clock set back": (
        lambda t: {**t, FRONT: t[FRONT]._replace(stamp=np.where(np.arange(4000) < 2000, 5.0, 0.0) + t[FRONT].stamp)},
        "set back in some topics",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_diagnosed_is_refused_in_one_line(clean: Topics, case: str) -> None:
    spoil, said = REFUSED[case]
    with pytest.raises(InputError, match=said) as error:
        prepare(spoil(clean), load_rig(), "bad.mcap")
    assert "\n" not in str(error.value)


def test_a_missing_channel_says_what_is_there_instead(clean: Topics) -> None:
    foreign = clean[DISPLACEMENT]._replace(
        channels=dict(zip("abcd", clean[DISPLACEMENT].channels.values(), strict=True))
    )
    signals = prepare({**clean, DISPLACEMENT: foreign}, load_rig())
    assert "which names a, b, c, d" in " ".join(limit.text for limit in signals.limitations)
    empty = with_channel(clean[FRONT], "pressure", np.full(4000, np.nan))
    texts = " ".join(limit.text for limit in prepare({**clean, FRONT: empty}, load_rig()).limitations)
    assert "holds no number in /rig/front/pressure" in texts and "bridged" not in texts


def test_two_rigs_are_refused(clean: Topics) -> None:
    one = prepare(clean, load_rig(), "a.mcap")
    other = prepare(topics(seed=1), load_rig().with_values(sprung_mass=55.0), "b.mcap")
    with pytest.raises(InputError, match=r"a\.mcap and b\.mcap are of two rigs.*sprung_mass"):
        check_pair([one], other)
    check_pair([one], prepare(topics(seed=1), load_rig().with_values(pressure_noise=200.0), "b.mcap"))


def test_holding_out_a_fitted_log_is_refused(clean: Topics) -> None:
    one = prepare(clean, load_rig(), "a.mcap")
    with pytest.raises(InputError, match="one of the logs to fit"):
        check_pair([one], one)


def test_a_file_that_is_no_log_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "notes.mcap"
    path.write_text("not a log")
    with pytest.raises(InputError, match=r"notes\.mcap"):
        read_signals(path)


def test_a_truncated_log_is_refused(tmp_path: Path) -> None:
    whole = OTHER_WRITER.read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"cut\.mcap") as error:
        read_signals(path)
    assert "\n" not in str(error.value)


def test_a_log_without_config_needs_a_rig(tmp_path: Path) -> None:
    path = write_log(tmp_path / "bare.mcap", *simulated(3.0), [])
    with pytest.raises(InputError, match=r"no /rig/config.*--rig"):
        read_signals(path)
    assert read_signals(path, load_rig()).rig == load_rig()


def test_a_config_that_changes_during_the_log_is_refused(tmp_path: Path) -> None:
    other = load_rig().with_values(sprung_mass=55.0).to_yaml()
    same = write_log(tmp_path / "same.mcap", *simulated(3.0), [load_rig().to_yaml()] * 2)
    assert read_signals(same).rig == load_rig()
    mixed = write_log(tmp_path / "mixed.mcap", *simulated(3.0), [load_rig().to_yaml(), other])
    with pytest.raises(InputError, match="two rigs are mixed"):
        read_signals(mixed)


def test_a_broken_config_is_said_in_one_line(tmp_path: Path) -> None:
    path = write_log(tmp_path / "broken.mcap", *simulated(3.0), ["rig: {sprung_mass: {value: -3, unit: kg}}"])
    with pytest.raises(InputError, match="out of range") as error:
        read_signals(path)
    assert "\n" not in str(error.value)
