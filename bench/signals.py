# SPDX-License-Identifier: Apache-2.0
"""What signals do to a session: every signal to every process, simulated and on the emulated rig, one table.

After each: no process is left, the log can be read, the valves of the emulated rig are safe, the session ended with an
exit code and one sentence, without a traceback. Exits with 1 if any of that fails. With ``--results FILE`` what is in
that file already is not tried again.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from pneumo_ros.errors import InputError
from pneumo_ros.log.salvage import read_or_salvage

CALIBRATION = "appendix_c_corrected"
SIGNALS = ("HUP", "INT", "INT+INT", "QUIT", "ABRT", "KILL", "USR1", "PIPE", "ALRM", "TERM", "USR2", "STOP 5 s")
PROCESSES = ("supervisor", "road_profile", "rig", "estimator", "controller", "session_recorder", "dashboard")
MODES = ("sim", "emulator")
GROWN = 400_000  # bytes of log after which the session is under way
PATIENCE = 90.0  # s for a start or an end on a loaded computer
AFTER = 5.0  # s a session may go on after a signal before it is ended by Ctrl-C


class NotUnderWay(Exception):  # noqa: N818  no error of the session's
    """The computer was too slow for the session to begin in time: nothing was tried."""


@dataclass(frozen=True)
class Outcome:
    """What was left of one session."""

    code: int | None
    sentence: str
    orphans: int
    samples: int
    traceback: bool
    safe: str

    @property
    def good(self) -> bool:
        """Whether everything is as it must be."""
        return (
            self.code is not None and not self.orphans and self.samples > 0 and not self.traceback
            and self.safe in ("", "yes") and bool(self.sentence)
        )  # fmt: skip


def node_processes(supervisor: int) -> dict[str, int]:
    """Module name -> process of everything that the supervisor started."""
    found = {}
    for entry in Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0")
            parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except (OSError, IndexError, ValueError):
            continue
        if parent == supervisor and b"-m" in words:
            found[words[words.index(b"-m") + 1].decode().rsplit(".", 1)[-1]] = int(entry.name)
    return found


def alive(pid: int) -> bool:
    """Whether a process runs (a zombie does not)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (OSError, IndexError):
        return False


@contextmanager
def emulator(folder: Path) -> Iterator[Path]:
    """An emulated rig; gives its link. Its record is there after the end."""
    link = folder / "rig"
    command = [sys.executable, "-m", "pneumo_ros.cli.emulate", "--quiet", "--link", str(link), "--record",
               str(folder / "record.npz"), "--calibration", CALIBRATION]  # fmt: skip
    process = subprocess.Popen(command)
    try:
        until(link.is_symlink)
        yield link
    finally:
        process.terminate()
        process.wait(PATIENCE)


def until(condition: object, seconds: float = PATIENCE) -> bool:
    """Wait for a condition; False if it never came."""
    end = time.monotonic() + seconds
    while not condition():  # type: ignore[operator]
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def send(pid: int, kind: str) -> None:
    """One of :data:`SIGNALS`."""
    if kind == "STOP 5 s":
        os.kill(pid, signal.SIGSTOP)
        time.sleep(5.0)
        os.kill(pid, signal.SIGCONT)
    elif kind == "INT+INT":
        os.kill(pid, signal.SIGINT)
        time.sleep(0.1)
        if alive(pid):
            os.kill(pid, signal.SIGINT)
    else:
        os.kill(pid, getattr(signal, f"SIG{kind}"))


def trial(mode: str, target: str, kind: str, folder: Path) -> Outcome:
    """One session, one signal."""
    if mode == "sim":
        return session(target, kind, folder, ["--duration", "0"], "plant")
    with emulator(folder) as link:
        options = ["--duration", "0", "--source", "serial", "--port", str(link), "--calibration", CALIBRATION]
        found = session(target, kind, folder, [*options, "--rate", "250"], "daq")
    return Outcome(**{**vars(found), "safe": valves(folder / "record.npz")})


def session(target: str, kind: str, folder: Path, options: list[str], rig: str) -> Outcome:
    """Start a session, send the signal when it is under way, wait for the end and look at what is left."""
    log = folder / "session.mcap"
    view = ["--view"] if target in ("dashboard", "supervisor") else []  # what the supervisor leaves behind is all
    said = (folder / "said.txt").open("w+")
    process = subprocess.Popen(
        [sys.executable, "-m", "pneumo_ros.cli.main", "run", "--isolate", "--no-picture", "--no-report", "--output",
         str(log), *options, *view],
        stdout=said, stderr=subprocess.STDOUT, env={**os.environ, "XDG_STATE_HOME": str(folder), "COLUMNS": "400"},
    )  # fmt: skip
    part = log.with_name("session.mcap.part")
    if not until(lambda: process.poll() is not None or (part.exists() and part.stat().st_size > GROWN)):
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)
        raise NotUnderWay
    nodes = node_processes(process.pid)
    names = {"supervisor": process.pid, "rig": nodes.get(rig), "dashboard": nodes.get("view")}
    pid = names.get(target, nodes.get(target))
    if pid is not None and process.poll() is None:
        send(pid, kind)
    if not until(lambda: process.poll() is not None, AFTER):
        process.send_signal(signal.SIGINT)
        if view:  # the dashboard stays until a second one
            time.sleep(10.0)
            process.send_signal(signal.SIGINT)
    until(lambda: process.poll() is not None)
    until(lambda: not any(alive(pid) for pid in nodes.values()), 15.0)
    orphans = sum(alive(pid) for pid in (process.pid, *nodes.values()))
    said.seek(0)
    text = said.read()
    return Outcome(process.poll(), sentence(text, process.poll()), orphans, samples(folder), "Traceback" in text, "")


def sentence(text: str, code: int | None) -> str:
    """How the session says it ended; a supervisor that was killed says nothing, its exit code does."""
    for line in text.splitlines():
        if any(word in line for word in ("session failed", "stopped by", "error:")):
            return line.strip()
    return f"(killed by signal {-code})" if code is not None and code < 0 else ""


def samples(folder: Path) -> int:
    """Measurements that can be read from what the session left."""
    for name in ("session.mcap", "session.recovered.mcap", "session.mcap.part"):
        if (folder / name).exists():
            try:
                log, _ = read_or_salvage(folder / name)
                return log.topics["/rig/displacement"].count
            except (InputError, KeyError):
                continue
    return 0


def valves(record: Path) -> str:
    """Whether the emulated valves were safe at the end."""
    with np.load(record) as data:
        states = [text for _, kind, text in json.loads(str(data["events"])) if kind == "valves"]
    return "yes" if not states or states[-1] == "safe" else f"NO: {states[-1]}"


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--modes", nargs="+", default=MODES, choices=MODES)
    parser.add_argument("--processes", nargs="+", default=PROCESSES, choices=PROCESSES)
    parser.add_argument("--signals", nargs="+", default=SIGNALS, choices=SIGNALS)
    parser.add_argument("--results", type=Path, help="file of outcomes, a line each, that is read first and added to")
    arguments = parser.parse_args()
    for number in (signal.SIGHUP, signal.SIGQUIT):  # nohup and a shell's background jobs hand down ignored ones
        signal.signal(number, signal.SIG_DFL)
    known = outcomes(arguments.results)
    wrong = rows = skipped = 0
    print(f"{'mode':9s} {'process':17s} {'signal':9s} {'good':5s} {'code':>4s} {'samples':>7s} {'safe':5s} sentence")
    for mode, target, kind in itertools.product(arguments.modes, arguments.processes, arguments.signals):
        found = known.get((mode, target, kind))
        if found is None:
            try:
                with tempfile.TemporaryDirectory() as folder:
                    found = trial(mode, target, kind, Path(folder))
            except NotUnderWay:
                print(f"{mode:9s} {target:17s} {kind:9s} not tried: no session within {PATIENCE} s", flush=True)
                skipped += 1
                continue
            if arguments.results is not None:
                with arguments.results.open("a") as stream:
                    stream.write(json.dumps([mode, target, kind, asdict(found)]) + "\n")
        rows, wrong = rows + 1, wrong + (not found.good)
        shown = found.sentence + (f" [{found.orphans} left]" if found.orphans else "")
        shown += " [traceback]" if found.traceback else ""
        print(f"{mode:9s} {target:17s} {kind:9s} {'yes' if found.good else 'NO':5s} {found.code!s:>4s} "
              f"{found.samples:7d} {found.safe:5s} {shown[:150]}", flush=True)  # fmt: skip
    print(f"{rows - wrong} of {rows} as they must be, {skipped} not tried")
    return 1 if wrong or skipped else 0


def outcomes(results: Path | None) -> dict[tuple[str, str, str], Outcome]:
    """What an earlier run found, by mode, process and signal."""
    if results is None or not results.exists():
        return {}
    rows = [json.loads(line) for line in results.read_text().splitlines()]
    return {(mode, target, kind): Outcome(**found) for mode, target, kind, found in rows}


if __name__ == "__main__":
    sys.exit(main())
