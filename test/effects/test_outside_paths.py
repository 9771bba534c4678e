# SPDX-License-Identifier: Apache-2.0
"""Nothing that a log says is imported, opened or written: effects come only from files that the user names."""

from __future__ import annotations

import hashlib
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from helpers.hostile import rest_log
from helpers.small_logs import text
from typer.testing import CliRunner

from pneumo_ros.cli.main import app
from pneumo_ros.effects import library
from pneumo_ros.effects.cache import cache_folder, kept
from pneumo_ros.effects.configured import configured_effects, library_of, with_files
from pneumo_ros.effects.loading import load_library, origin_of, origins
from pneumo_ros.errors import InputError
from pneumo_ros.log.decoded import STRING
from pneumo_ros.log.reading import read_log
from pneumo_ros.rig import NamedEffect, load_rig, parse_rig
from pneumo_ros.session.replay import replay

LIBRARY = load_library()
SOURCE = Path(library.__path__[0], "lvdt_offset.py").read_text()
OWN = SOURCE.replace('id="lvdt_offset"', 'id="tilted"')


def config(**entry: object) -> str:
    """/rig/config that names an effect."""
    effect = {"effect": "tilted", "site": "sprung_rear", "parameters": {"offset": 1e-3}, **entry}
    return yaml.safe_dump({**yaml.safe_load(load_rig().to_yaml()), "effects": [effect]})


@pytest.fixture
def trap(tmp_path: Path) -> tuple[Path, Path]:
    """A Python file that leaves a mark when it is executed, and the mark."""
    mark, file = tmp_path / "executed", tmp_path / "elsewhere" / "tilted.py"
    file.parent.mkdir()
    file.write_text(f"{OWN}\nimport pathlib\npathlib.Path({str(mark)!r}).write_text('!')\n")
    return file, mark


@pytest.mark.parametrize(
    "verb",
    [
        ("replay", "LOG", "--closed-loop"), ("replay", "LOG", "--stepped"), ("log", "info", "LOG"),
        ("log", "validate", "LOG"), ("log", "report", "LOG", "-o", "OUT.html"), ("log", "compare", "LOG", "LOG"),
        ("diagnose", "LOG", "-o", "OUT"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_a_log_that_names_a_file_runs_nothing(tmp_path: Path, trap: tuple[Path, Path], verb: tuple[str, ...]) -> None:
    file, mark = trap
    log = rest_log(tmp_path / "sent.mcap", config(file=str(file)))
    words = [str(log) if w == "LOG" else str(tmp_path / w) if w.startswith("OUT") else w for w in verb]
    done = CliRunner().invoke(app, words)
    assert not mark.exists(), done.output
    assert done.exception is None or isinstance(done.exception, InputError | SystemExit), repr(done.exception)
    if verb[0] == "diagnose" or "--closed-loop" in verb:
        assert "unknown effect" in str(done.exception) and "--effect FILE" in str(done.exception)


def test_a_rig_file_beside_a_bag_and_a_valve_profile_of_a_log_are_not_opened(
    tmp_path: Path, trap: tuple[Path, Path]
) -> None:
    """A bag's folder may bring a rig file along; a session that played a profile names the file by its path."""
    file, mark = trap
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "rig.yaml").write_text(config(file=file.name))
    setup = {"node": "controller", "parameters": {"controller": "profile", "valve_profile": "/dev/zero"}}
    message = ("/rig/setup", STRING, 0, text(yaml.safe_dump(setup)))
    rest_log(bag / "part.mcap", load_rig().to_yaml(), extra=[message])
    log = read_log(bag)
    assert log.config == load_rig() and not mark.exists()
    with pytest.raises(InputError, match=r"never opened, key 'valve_profile', value '/dev/zero'.*--valves"):
        replay(log)


def test_the_users_own_file_loads_from_beside_the_rig_file_with_its_path_shown(
    tmp_path: Path, trap: tuple[Path, Path]
) -> None:
    file, mark = trap
    rig_file = file.with_name("rig.yaml")
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    rig_file.write_text(config(file=file.name, source=digest))
    rig = load_rig(rig_file)
    assert rig.effects[0].file == str(file.resolve()) and not mark.exists()
    effects = library_of(rig)
    assert mark.exists() and configured_effects(rig, effects)[0].effect == "tilted"
    assert origins(effects) == [f"effect tilted is loaded from {file.resolve()} (SHA-256 {digest[:16]})"]
    published = rig.to_yaml()
    assert str(tmp_path) not in published and "file" not in published and digest in published
    assert parse_rig(published) == rig
    sent = with_files(parse_rig(published), [file])
    assert configured_effects(sent, library_of(sent))[0].effect == "tilted"


@pytest.mark.parametrize("name", ["../tilted.py", "/etc/passwd", "sub/tilted.py", "link.py"])
def test_a_rig_file_names_only_what_stands_beside_it(tmp_path: Path, name: str) -> None:
    (tmp_path / "away").mkdir()
    (tmp_path / "away" / "tilted.py").write_text(OWN)
    (tmp_path / "link.py").symlink_to(tmp_path / "away" / "tilted.py")
    (tmp_path / "rig.yaml").write_text(config(file=name))
    with pytest.raises(InputError, match=r"not beside the rig file, key 'effects\[0\].file'"):
        load_rig(tmp_path / "rig.yaml")


def test_another_source_than_the_recorded_one_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "tilted.py"
    file.write_text(OWN)
    effect = load_library([file])["tilted"]
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    origin = origin_of(effect)
    assert origin is not None and origin.digest == digest
    file.write_text(OWN + "# changed\n")
    rig = with_files(parse_rig(config(source=digest)), [file])
    with pytest.raises(InputError, match=f"another than the one that was recorded.*allowed: SHA-256 {digest[:16]}"):
        configured_effects(rig, library_of(rig))
    known = NamedEffect("lvdt_offset", "sprung_rear", (("offset", 1e-3),), digest)
    with pytest.raises(InputError, match='value "the package\'s own"'):
        configured_effects(parse_rig(yaml.safe_dump({**yaml.safe_load(load_rig().to_yaml()),
                                                   "effects": [known.to_dict()]})), LIBRARY)  # fmt: skip


def test_what_runs_is_what_was_hashed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiled remains beside the file are not looked at, and a planted file in the cache is replaced."""
    monkeypatch.setenv("PNEUMO_KERNEL_CACHE", str(tmp_path / "cache"))
    file, mark = tmp_path / "tilted.py", tmp_path / "executed"
    file.write_text(OWN + "# planted\n")
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    cache_folder()
    planted = tmp_path / "cache" / f"pneumo_effect_tilted_{digest[:20]}.py"
    planted.write_text(f"import pathlib\npathlib.Path({str(mark)!r}).write_text('!')\n")
    assert load_library([file])["tilted"].id == "tilted"
    assert not mark.exists() and planted.read_bytes() == file.read_bytes()
    assert not (tmp_path / "__pycache__").exists()


def test_generated_code_is_the_users_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    open_to_all = tmp_path / "open"
    open_to_all.mkdir()
    open_to_all.chmod(0o777)
    monkeypatch.setenv("PNEUMO_KERNEL_CACHE", str(open_to_all))
    assert stat.S_IMODE(cache_folder().stat().st_mode) == 0o700
    outside = tmp_path / "outside.py"
    outside.write_text("x = 1\n")
    (open_to_all / "kernel.py").symlink_to(outside)
    assert not kept("kernel.py", b"y = 2\n").is_symlink() and outside.read_text() == "x = 1\n"


def test_a_working_folder_from_elsewhere_brings_neither_modules_nor_compiler_settings(tmp_path: Path) -> None:
    mark = tmp_path / "executed"
    for name in ("numba.py", "yaml.py", "mcap.py"):
        (tmp_path / name).write_text(f"open({str(mark)!r}, 'w').close()\n")
    (tmp_path / ".numba_config.yaml").write_text(f"cache_dir: {tmp_path / 'planted'}\n")
    code = (
        "import sys; sys.argv = ['pneumo', '--version']\n"
        "from pneumo_ros.cli.main import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "import numba, os\nassert numba.config.CACHE_DIR == '', numba.config.CACHE_DIR\n"
        "assert os.environ['PYTHONSAFEPATH'] == '1'\n"
    )
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    script = tmp_path / "bin" / "start.py"
    script.parent.mkdir()
    script.write_text(code)
    subprocess.run([sys.executable, str(script)], cwd=tmp_path, env=environment, check=True, capture_output=True)
    assert not mark.exists()
