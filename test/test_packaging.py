# SPDX-License-Identifier: Apache-2.0
"""What package.xml, setup.py, floors.txt and the changelog promise: dependencies, versions, releases, headers."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package import Package, parse_package
from catkin_pkg.package_version import update_versions
from helpers.folders import ROOT
from packaging.requirements import Requirement
from packaging.version import Version

import pneumo_ros
from pneumo_ros.log.topics import TOPICS

# Module -> rosdep key, where they differ; as in rosdep's python.yaml. "" : brought by another key, see BROUGHT.
KEYS = {
    "jinja2": "python3-jinja2",
    "lz4": "",
    "markupsafe": "",
    "matplotlib": "python3-matplotlib",
    "mcap": "",
    "numba": "python3-numba",
    "numpy": "python3-numpy",
    "rich": "python3-rich",
    "rosbags": "python3-rosbags-pip",
    "scipy": "python3-scipy",
    "serial": "python3-serial",
    "typer": "python3-typer",
    "yaml": "python3-yaml",
    "zstandard": "",
}
# Distribution -> the one that requires it, up to one with a key.
BROUGHT = {"lz4": "mcap", "zstandard": "mcap", "mcap": "mcap-ros2-support", "markupsafe": "jinja2"}
# Extras of setup.py, or message packages that a node uses where they are there: each says so when it is missing.
OPTIONAL = {"bokeh", "tornado", "dask", "distributed", "pyarrow", "fmpy", "control_msgs"}


@pytest.fixture(scope="module")
def package() -> Package:
    return parse_package(str(ROOT))


def imported() -> set[str]:
    """Top-level modules that the package and its launch files import anywhere, without Python's own."""
    found = set()
    for path in [*(ROOT / "pneumo_ros").rglob("*.py"), *(ROOT / "launch").glob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.split(".")[0])
    found |= {topic.type.split("/")[0] for topic in TOPICS}  # nodes import message classes by name
    return found - set(sys.stdlib_module_names) - {"pneumo_ros"}


def requirements(name: str) -> dict[str, Requirement]:
    """What a distribution requires without extras, by normalised name."""
    listed = [Requirement(text) for text in metadata.requires(name) or []]
    return {re.sub(r"[-_.]+", "-", one.name).lower(): one for one in listed if "extra" not in str(one.marker)}


def test_every_import_is_a_dependency_with_a_rosdep_key(package: Package) -> None:
    declared = {depend.name for depend in package.exec_depends}
    for module in imported() - OPTIONAL:
        key = KEYS.get(module, module)
        assert key in declared if key else module in BROUGHT, module


def test_nothing_is_declared_that_is_not_imported(package: Package) -> None:
    used = {KEYS.get(module, module) for module in imported()}
    # setuptools: the executables' start-up code; ros2launch: `ros2 launch`; the rest are needed by what is imported.
    others = {"python3-setuptools", "ros2launch", "mcap-ros2-support", "lifecycle_msgs", "builtin_interfaces"}
    assert {depend.name for depend in package.exec_depends} <= used | others


@pytest.mark.parametrize(("brought", "by"), BROUGHT.items())
def test_what_has_no_key_comes_with_what_has_one(brought: str, by: str, package: Package) -> None:
    assert brought in requirements(by)
    end = BROUGHT.get(by, by)
    assert {end, f"python3-{end}"} & {depend.name for depend in package.exec_depends}


def test_no_middleware_is_required(package: Package) -> None:
    """Any RMW does; Fast DDS is what the wheels have and what docs/install.md recommends."""
    assert not [depend.name for depend in package.exec_depends if depend.name.startswith("rmw_")]
    code = " ".join(path.read_text(encoding="utf-8") for path in (ROOT / "pneumo_ros" / "nodes").glob("*.py"))
    assert "rmw_fastrtps" not in code and "RMW_IMPLEMENTATION" not in code


def test_one_version_number(package: Package) -> None:
    assert package.version == pneumo_ros.__version__ == metadata.version("pneumo_ros")


def test_the_release_tool_writes_both_numbers(tmp_path: Path, package: Package) -> None:
    for name in ("package.xml", "setup.py"):
        shutil.copy(ROOT / name, tmp_path)
    update_versions({str(tmp_path): package}, "9.8.7")
    assert parse_package(str(tmp_path)).version == "9.8.7"
    assert 'version="9.8.7",' in (tmp_path / "setup.py").read_text(encoding="utf-8")


def test_the_changelog_is_read_up_to_the_last_release(package: Package) -> None:
    text = (ROOT / "CHANGELOG.rst").read_text(encoding="utf-8")
    sections = re.findall(r"^(.+)\n-{3,}$", text, re.MULTILINE)
    changelog = get_changelog_from_path(str(ROOT), package.name)
    released = [version for version, _, _ in changelog.foreach_version(reverse=True)]
    assert released[0] == package.version
    assert len(released) == len([title for title in sections if title != "Forthcoming"])
    assert "Forthcoming" not in sections[1:]
    assert all(changelog.get_content_of_version(version) for version in released)


def test_every_source_file_begins_with_its_licence() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("which files are the project's is known to git")
    command = [sys.executable, str(ROOT / ".ci" / "headers.py"), "--check"]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert found.returncode == 0, f"run `make headers`:\n{found.stdout}{found.stderr}"


def floors() -> dict[str, Version]:
    """Pinned oldest versions that hold for this Python."""
    lines = (ROOT / "floors.txt").read_text(encoding="utf-8").splitlines()
    pins = [Requirement(line) for line in lines if line and not line.startswith("#")]
    return {pin.name: Version(str(pin.specifier)[2:]) for pin in pins if pin.marker is None or pin.marker.evaluate()}


def test_the_floors_are_the_oldest_versions_that_setup_allows() -> None:
    ours = requirements("pneumo_ros")
    pinned = floors()
    assert {"numpy", "scipy", "numba", "matplotlib", "typer", "rich", "jinja2", "pyyaml"} <= set(pinned)
    for name in set(pinned) & set(ours):
        if name in ("numpy", "scipy", "numba", "typer"):
            lowest = next(one for one in ours[name].specifier if one.operator == ">=")
            assert Version(lowest.version).release[:2] == pinned[name].release[:2], name
        assert ours[name].specifier.contains(pinned[name]), name


def test_tests_run_beside_launch_testing_s_plugin(tmp_path: Path) -> None:
    """ROS's launch_testing hooks into every pytest, with a signature that pytest 9 refuses."""
    (tmp_path / "legacy_hooks.py").write_text("def pytest_pycollect_makemodule(nothing_there, parent): ...\n")
    described = tmp_path / "launch_testing-0.dist-info"
    described.mkdir()
    (described / "METADATA").write_text("Name: launch_testing\nVersion: 0\n")
    (described / "entry_points.txt").write_text("[pytest11]\nlaunch_testing = legacy_hooks\n")
    (tmp_path / "test_one.py").write_text("def test_one():\n    pass\n")
    (tmp_path / "own.ini").write_text("[pytest]\n")
    # Not what another pytest was told by its environment: colcon gives it the tests to run that way.
    environment = {key: value for key, value in os.environ.items() if key != "PYTEST_ADDOPTS"}
    environment["PYTHONPATH"] = str(tmp_path)
    codes = []
    for config in (ROOT / "pyproject.toml", tmp_path / "own.ini"):
        command = [sys.executable, "-m", "pytest", "-c", str(config), str(tmp_path / "test_one.py")]
        codes.append(subprocess.run(command, env=environment, capture_output=True, check=False).returncode)
    assert codes[0] == 0 and codes[1] != 0


def test_colcon_finds_the_tests() -> None:
    """colcon runs pytest for a package whose extra `test` names it."""
    named = [Requirement(text) for text in metadata.requires("pneumo_ros") or [] if 'extra == "test"' in text]
    assert "pytest" in {one.name for one in named}
