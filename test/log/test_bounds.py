# SPDX-License-Identifier: Apache-2.0
"""Small files that ask for gigabytes or for ever: refused on one line, in little memory, and quickly."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from helpers.bombs import BOMBS, GIGA, aliases, chunk, file, run, zstd_run
from helpers.fuzz import CONFIGS, mutated_config, mutated_log, read_everything
from helpers.small_logs import session, write

from pneumo_ros.documents import parse_json, parse_yaml
from pneumo_ros.errors import InputError
from pneumo_ros.log.bounds import chunks_up_to, free_for_messages
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.salvage import salvage

LIMIT_MB = 400.0
READABLE = ("aliases in parameters", "deep YAML")  # what nodes say of themselves: left out where it cannot be read


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_is_refused_in_little_memory(tmp_path: Path, name: str) -> None:
    done = run("log", "info", BOMBS[name](tmp_path / "bomb.mcap"), patience=20.0)
    assert done.code == (0 if name in READABLE else 2), done.said
    assert done.peak < LIMIT_MB and "Traceback" not in done.said
    assert done.code == 0 or done.said.strip().count("\n") == 0, done.said


@pytest.mark.parametrize("name", ["zstd, 4 GiB, 1 kB stated", "lz4, 4 GiB, 1 kB stated"])
def test_recovery_leaves_a_bomb_out(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="nothing readable"):
        salvage(BOMBS[name](tmp_path / "bomb.mcap"))


def test_a_larger_chunk_is_read_where_the_user_says_so(tmp_path: Path) -> None:
    log = write(tmp_path / "log.mcap", session(2000), chunk_size=1 << 30)
    with chunks_up_to(1):
        assert len(read_log(log).topics) == 4
    large = write(tmp_path / "large.mcap", session(6000), chunk_size=1 << 30)
    with chunks_up_to(1), pytest.raises(InputError, match=r"more than 1 MiB.*pneumo --max-chunk MiB"):
        read_log(large)
    assert read_log(large).topics["/rig/displacement"].count == 6000


def test_a_log_larger_than_memory_is_refused_before_it_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = write(tmp_path / "log.mcap", session(2000))
    assert 1 << 30 < free_for_messages() < 1 << 50
    monkeypatch.setattr("pneumo_ros.log.bags.free_for_messages", lambda: 100_000)
    with pytest.raises(InputError, match=r"do not fit into memory.*half of what is free"):
        read_log(log)
    assert read_log(log, ["/rig/config"]).topics, "what is not kept needs no memory"


def test_many_chunks_that_pack_too_well_are_refused_together(tmp_path: Path) -> None:
    """Each chunk is within the limit; a file of 100 kB does not hold a gigabyte all the same."""
    size = 60 << 20
    one = chunk(b"zstd", zstd_run(size, size, byte=b"\x80"), size)
    # A private record of the length that its own bytes state would leave the chunk: the ratio must be found first.
    begin = b"\x80" + (size - 9).to_bytes(8, "little")
    one = chunk(b"zstd", zstd_run(size - len(begin), size, begin, b"\x80"), size)
    with pytest.raises(InputError, match="bytes in a file of"):
        read_log(file(tmp_path / "many.mcap", *[one] * (GIGA // size)))


def test_texts_are_bounded() -> None:
    for words, make in {
        "alias": lambda: parse_yaml(aliases(), "x"),
        "too deep": lambda: parse_yaml("[" * 100_000, "x"),
        "too long": lambda: parse_yaml("a" * 5_000_000, "x"),
        "too large": lambda: parse_yaml("[" + "1," * 300_000 + "]", "x"),
        "cannot be read": lambda: parse_yaml("a: 2001-99-99", "x"),
        "cannot be read|broken": lambda: parse_yaml("a: " + "1" * 10_000, "x") if sys.version_info >= (3, 11) else
        parse_yaml("a: 2001-13-01", "x"),
        "x: the text is too deep": lambda: parse_json("[" * 100_000, "x"),
        "broken JSON": lambda: parse_json('{"a": [1, 2', "x"),
    }.items():  # fmt: skip
        with pytest.raises(InputError, match=words) as caught:
            make()
        assert "\n" not in str(caught.value)
    assert parse_json('{"a": "[[[[[\\"[[["}', "x") == {"a": '[[[[[\\"[[['.replace("\\", "")}


def test_mutated_logs_end_in_an_error_of_one_line_or_in_messages(tmp_path: Path) -> None:
    """A sample of ``bench/fuzz_logs.py``."""
    outcomes = [read_everything(mutated_log(seed), tmp_path) for seed in range(60)]
    assert {"read", "refused"} <= set(outcomes) and outcomes.count("read") > 3


# A standard type under a definition without its fields; a log whose displacement and command are gone.
@pytest.mark.parametrize("seed", [2662, 4107, 4189, 4420, 7241, 9875])
def test_what_ten_thousand_mutations_found_stays_mended(seed: int, tmp_path: Path) -> None:
    assert read_everything(mutated_log(seed), tmp_path) in ("read", "refused")


def test_mutated_configurations_end_in_an_error_of_one_line_or_in_a_configuration(tmp_path: Path) -> None:
    outcomes = [mutated_config(seed, tmp_path) for seed in range(40)]
    assert set(outcomes) == {"read", "refused"} and len(CONFIGS) >= 4
