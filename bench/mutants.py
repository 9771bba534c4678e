# SPDX-License-Identifier: Apache-2.0
"""Which small changes of a module no test notices: mutation analysis with cosmic-ray.

    make mutants MODULE=units      # one of MODULES below

Every mutant is one operator, number, comparison or decorator changed in a copy of the sources under build/mutants; the
tests of the module run against it, from a warm process (warm_tests.py). Who survives is printed with its change.
docs/mutants.md keeps the results.
"""

from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import WorkerOutcome, WorkResult

ROOT = Path(__file__).resolve().parent.parent
TREE = ROOT / "build" / "mutants"
WARM = ROOT / "bench" / "warm_tests.py"
TIMEOUT = 120.0  # s for the tests of one mutant; one that runs longer counts as killed
# Name -> (source file, tests that answer for it).
MODULES = {
    "units": ("pneumo_ros/units.py", "test/test_units.py"),
    "frames": ("pneumo_ros/daq/frames.py", "test/daq/test_frames.py"),
    "safety": ("pneumo_ros/daq/actuation.py", "test/daq/test_actuation.py"),
    "plausibility": ("pneumo_ros/daq/plausibility.py", "test/daq/test_plausibility.py"),
    "estimator": ("pneumo_ros/estimation/half_car.py", "test/estimation"),
    "least_squares": ("pneumo_ros/estimation/least_squares.py", "test/estimation"),
    "judge": ("pneumo_ros/diagnosis/judge/verdict.py", "test/diagnosis/judge/test_verdict.py"),
}


def copied() -> None:
    """The files that git knows, as they stand."""
    shutil.rmtree(TREE, ignore_errors=True)
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True).stdout
    for name in filter(None, listed.decode().split("\0")):
        if (ROOT / name).is_file():
            (TREE / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, TREE / name)


def configured(source: str, place: Path) -> None:
    """cosmic-ray's configuration: one question to the warm process that listens at ``place`` for each mutant."""
    command = f"{sys.executable} -S {WARM} ask {place}"
    (TREE / "mutants.toml").write_text(
        f'[cosmic-ray]\nmodule-path = "{source}"\ntimeout = {TIMEOUT}\nexcluded-modules = []\n'
        f'test-command = "{command}"\n\n[cosmic-ray.distributor]\nname = "local"\n'
    )


def environment() -> dict[str, str]:
    """The copy before the installed package, compiled code beside it."""
    return {**os.environ, "PYTHONPATH": str(TREE), "NUMBA_CACHE_DIR": str(TREE / "numba")}


def cosmic_ray(*arguments: str) -> str:
    """Run its command line in the copy."""
    command = [str(Path(sys.executable).parent / "cosmic-ray"), *arguments]
    return subprocess.run(command, cwd=TREE, env=environment(), check=True, capture_output=True, text=True).stdout


def unevaluated(source: Path) -> list[ast.expr]:
    """What is never evaluated (PEP 563): annotations of arguments, results and variables."""
    found: list[ast.expr | None] = []
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.arg | ast.AnnAssign):
            found.append(node.annotation)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            found.append(node.returns)
    return [expression for expression in found if expression is not None]


def skip_annotations(source: str) -> None:
    """Leave out mutants that no test can notice, because nothing runs them."""
    spans = [
        ((one.lineno, one.col_offset), (one.end_lineno or one.lineno, one.end_col_offset or 0))
        for one in unevaluated(TREE / source)
    ]
    with use_db(str(TREE / "session.sqlite"), WorkDB.Mode.open) as database:
        for item in list(database.work_items):
            (mutation,) = item.mutations
            if any(first <= tuple(mutation.start_pos) < last for first, last in spans):
                database.set_result(item.job_id, WorkResult(worker_outcome=WorkerOutcome.SKIPPED))


@contextmanager
def warm(tests: str, place: Path) -> Iterator[None]:
    """A process that has the libraries and runs the tests when asked; the first failing one ends a run."""
    command = [sys.executable, str(WARM), "serve", str(place), "-x", "-q", "-p", "no:cacheprovider", tests]
    process = subprocess.Popen(command, cwd=TREE, env=environment())
    try:
        while not place.exists():
            if process.poll() is not None:
                raise SystemExit("the warm process has ended")
            time.sleep(0.1)
        yield
        if process.poll() is not None:
            raise SystemExit("the warm process has ended: every mutant since then counts as killed, which says nothing")
    finally:
        process.kill()
        process.wait()


def main() -> None:
    """Print how many mutants there were, and those that survived."""
    if len(sys.argv) != 2 or sys.argv[1] not in MODULES:
        raise SystemExit(f"give one of {', '.join(MODULES)}")
    source, tests = MODULES[sys.argv[1]]
    copied()
    if "njit" in (ROOT / source).read_text(encoding="utf-8"):  # compiled callers keep what they called, changed or not
        os.environ["NUMBA_DISABLE_JIT"] = "1"
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "warm"
        configured(source, place)
        cosmic_ray("init", "mutants.toml", "session.sqlite")
        skip_annotations(source)
        with warm(tests, place):
            try:
                cosmic_ray("baseline", "mutants.toml")
            except subprocess.CalledProcessError as error:
                raise SystemExit(f"{tests} fails in the copy before any change: run it in {TREE}") from error
            cosmic_ray("exec", "mutants.toml", "session.sqlite")
    rows = [json.loads(line) for line in cosmic_ray("dump", "session.sqlite").splitlines()]
    done = [(item, result) for item, result in rows if result is not None and result["worker_outcome"] != "skipped"]
    survivors = [(item, result) for item, result in done if result["test_outcome"] == "survived"]
    print(f"{sys.argv[1]}: {len(done)} mutants, {len(done) - len(survivors)} killed, {len(survivors)} survived")
    for item, result in survivors:
        (mutation,) = item["mutations"]
        print(f"\n{mutation['module_path']}:{mutation['start_pos'][0]} {mutation['operator_name']}")
        print("\n".join(line for line in (result["diff"] or "").splitlines() if line[:1] in "+-"))


if __name__ == "__main__":
    main()
