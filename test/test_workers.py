# SPDX-License-Identifier: Apache-2.0
"""Batches survive killed workers, locally and on a real Dask cluster."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from helpers.folders import ROOT

from pneumo_ros.casemaker.plan import plan
from pneumo_ros.casemaker.planned import Planned
from pneumo_ros.errors import InputError
from pneumo_ros.workers import run_each

CASES = plan("ci")[:2]


def die_once(folder: str) -> None:
    """Kill the own process the first time, succeed the second."""
    marker = Path(folder) / "tried"
    if not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    (Path(folder) / "done").touch()


def slow_case(item: tuple[Planned, str]) -> None:
    """Half made for a second, then whole, as a case is; one that is there is kept."""
    final = Path(item[1]) / "cases" / item[0].name
    if not final.exists():
        part = final.with_suffix(".part")
        part.mkdir(parents=True, exist_ok=True)
        time.sleep(1.0)
        part.rename(final)


def fail(folder: str) -> None:
    """A piece of work that goes wrong."""
    raise ValueError(folder)


def ctrl_c_in_compiled_code(folder: str) -> None:
    """What numba makes of a handler's exception."""
    try:
        raise KeyboardInterrupt
    except KeyboardInterrupt as error:
        raise SystemError("CPUDispatcher returned a result with an exception set") from error


def test_ctrl_c_ends_a_batch_whatever_code_it_meets(tmp_path: Path) -> None:
    """It was a case that failed, and the batch went on."""
    with pytest.raises(KeyboardInterrupt):
        list(run_each(ctrl_c_in_compiled_code, [str(tmp_path)]))
    assert "ValueError" in next(iter(run_each(fail, [str(tmp_path)])))[1]


BATCH = """
import sys
from helpers.arriving import Arriving
from pneumo_ros.workers import run_each
try:
    list(run_each(print, [Arriving(sys.argv[1])], workers=2))
except KeyboardInterrupt:
    print("told")
"""


def test_workers_say_nothing_of_ctrl_c(tmp_path: Path) -> None:
    """One that still imported, or waited for work, ended in a traceback."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "test")}
    command = [sys.executable, "-c", BATCH, str(tmp_path)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment, start_new_session=True
    )
    while not (tmp_path / "arrives").exists():
        assert process.poll() is None
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    said, _ = process.communicate(timeout=30)
    assert said == "told\n"


def test_a_killed_local_worker_costs_a_restart_only(tmp_path: Path) -> None:
    outcomes = dict(run_each(die_once, [str(tmp_path)], workers=2))
    assert outcomes == {str(tmp_path): ""}
    assert (tmp_path / "done").exists()


def test_a_failing_case_is_reported_and_the_others_go_on(tmp_path: Path) -> None:
    (tmp_path / "tried").touch()
    assert list(run_each(fail, ["x", "y"])) == [("x", "ValueError: x"), ("y", "ValueError: y")]
    assert list(run_each(die_once, [str(tmp_path)])) == [(str(tmp_path), "")]


def test_no_scheduler_is_one_line() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match="no scheduler answers"):
        list(run_each(fail, ["x"], scheduler="tcp://127.0.0.1:1"))


@pytest.mark.slow
def test_two_cases_on_a_dask_cluster_with_a_worker_killed(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        pids = [worker.pid for worker in cluster.workers.values()]
        killer = threading.Thread(target=_kill_when_busy, args=(pids[0], tmp_path / "cases"))
        killer.start()
        items = [(case, str(tmp_path)) for case in CASES]
        outcomes = dict(run_each(slow_case, items, scheduler=cluster.scheduler_address))
        killer.join()
        assert pids[0] not in [worker.pid for worker in cluster.workers.values()]
    assert sorted(item[0].name for item in outcomes) == sorted(case.name for case in CASES)
    assert set(outcomes.values()) == {""}
    assert sorted(path.name for path in (tmp_path / "cases").iterdir()) == sorted(case.name for case in CASES)


def _kill_when_busy(pid: int, cases: Path) -> None:
    """SIGKILL a worker once cases are being made and none is finished."""
    deadline = time.monotonic() + 120.0
    while len(list(cases.glob("*.part"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    os.kill(pid, signal.SIGKILL)
