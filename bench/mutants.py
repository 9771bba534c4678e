# SPDX-License-Identifier: Apache-2.0
"""Which small changes of a module no test notices: mutation analysis with cosmic-ray.

    make mutants MODULE=units      # one of MODULES below

Every mutant is one operator, number, comparison or decorator changed in a copy of the sources under build/mutants; the
tests of the module run against it. Who survives is printed with its change. docs/mutants.md keeps the results.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TREE = ROOT / "build" / "mutants"
TIMEOUT = 120.0  # s for the tests of one mutant; one that runs longer counts as killed
# Name -> (source file, tests that answer for it).
MODULES = {
    "units": ("pneumo_ros/units.py", "test/test_units.py"),
    "frames": ("pneumo_ros/daq/frames.py", "test/daq/test_frames.py"),
    "safety": ("pneumo_ros/daq/actuation.py", "test/daq/test_core.py"),
    "plausibility": ("pneumo_ros/daq/plausibility.py", "test/daq/test_core.py"),
    "estimator": ("pneumo_ros/estimation/half_car.py", "test/estimation"),
    "least_squares": ("pneumo_ros/estimation/least_squares.py", "test/estimation"),
    "judge": ("pneumo_ros/diagnosis/judge/verdict.py", "test/diagnosis/judge/test_verdict.py"),
}


def copied() -> None:
    """The files that git knows, as they stand."""
    shutil.rmtree(TREE, ignore_errors=True)
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True).stdout
    for name in filter(None, listed.decode().split("\0")):
        if (ROOT / name).is_file() and not name.startswith("docs/"):
            (TREE / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, TREE / name)


def configured(source: str, tests: str) -> None:
    """cosmic-ray's configuration; the first failing test ends a mutant."""
    command = f"{sys.executable} -m pytest -x -q -p no:cacheprovider {tests}"
    (TREE / "mutants.toml").write_text(
        f'[cosmic-ray]\nmodule-path = "{source}"\ntimeout = {TIMEOUT}\nexcluded-modules = []\n'
        f'test-command = "{command}"\n\n[cosmic-ray.distributor]\nname = "local"\n'
    )


def cosmic_ray(*arguments: str) -> str:
    """Run its command line in the copy."""
    place = {**os.environ, "PYTHONPATH": str(TREE), "NUMBA_CACHE_DIR": str(TREE / "numba")}
    command = [str(Path(sys.executable).parent / "cosmic-ray"), *arguments]
    return subprocess.run(command, cwd=TREE, env=place, check=True, capture_output=True, text=True).stdout


def main() -> None:
    """Print how many mutants there were, and those that survived."""
    if len(sys.argv) != 2 or sys.argv[1] not in MODULES:
        raise SystemExit(f"give one of {', '.join(MODULES)}")
    copied()
    configured(*MODULES[sys.argv[1]])
    cosmic_ray("init", "mutants.toml", "session.sqlite")
    cosmic_ray("baseline", "mutants.toml")
    cosmic_ray("exec", "mutants.toml", "session.sqlite")
    rows = [json.loads(line) for line in cosmic_ray("dump", "session.sqlite").splitlines()]
    done = [(item, result) for item, result in rows if result is not None]
    survivors = [(item, result) for item, result in done if result["test_outcome"] == "survived"]
    print(f"{sys.argv[1]}: {len(done)} mutants, {len(done) - len(survivors)} killed, {len(survivors)} survived")
    for item, result in survivors:
        (mutation,) = item["mutations"]
        print(f"\n{mutation['module_path']}:{mutation['start_pos'][0]} {mutation['operator_name']}")
        print("\n".join(line for line in (result["diff"] or "").splitlines() if line[:1] in "+-"))


if __name__ == "__main__":
    main()
