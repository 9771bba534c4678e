# SPDX-License-Identifier: Apache-2.0
"""One place, one session: the lock is exclusive, says who holds it, and ends with its last process."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from pneumo_ros.errors import InputError
from pneumo_ros.session.claim import Claim, runtime_folder


def test_a_taken_place_is_refused_by_name_with_the_remedy(tmp_path: Path) -> None:
    claim = Claim(7, "/rig1", "sim, a.mcap", tmp_path)
    with pytest.raises(InputError, match=r"domain 7, namespace /rig1.*sim, a.mcap, process \d+.*--isolate, --domain N"):
        Claim(7, "/rig1", "serial, b.mcap", tmp_path)
    Claim(7, "/rig2", "", tmp_path).release()
    Claim(8, "/rig1", "", tmp_path).release()
    claim.release()
    Claim(7, "/rig1", "serial, b.mcap", tmp_path).release()


def test_it_is_held_until_the_last_process_that_inherited_it_has_ended(tmp_path: Path) -> None:
    claim = Claim(7, "", "sim", tmp_path)
    node = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE, pass_fds=(claim.descriptor,))
    claim.release()
    with pytest.raises(InputError, match="a session runs here already"):
        Claim(7, "", "sim", tmp_path)
    node.kill()
    node.wait()
    Claim(7, "", "sim", tmp_path).release()


def test_a_lock_that_says_nothing_is_still_a_lock(tmp_path: Path) -> None:
    claim = Claim(7, "", "sim", tmp_path)
    (tmp_path / "domain-7.lock").write_text("")
    with pytest.raises(InputError, match="it has not said yet what it is"):
        Claim(7, "", "sim", tmp_path)
    claim.release()


def test_locks_are_this_users_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert runtime_folder().is_relative_to(tmp_path) and runtime_folder().stat().st_mode & 0o077 == 0
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "file"))
    with pytest.raises(InputError, match="XDG_RUNTIME_DIR"):
        runtime_folder()
