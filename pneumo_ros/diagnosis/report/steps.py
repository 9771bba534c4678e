# SPDX-License-Identifier: Apache-2.0
"""What to do with a verdict: sentences, and the commands to type from where the diagnosis was typed."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pneumo_ros.diagnosis.half_car.experiment import ROAD_FILE, VALVE_FILE
from pneumo_ros.diagnosis.report.words import LIKELY, effect_name, first_place, forbidden, place_words

# For a place without a name: (what moves it, the road that does) [display]
_TELLING: Final = {
    "air": ("that sweeps the valves' whole range on a smooth road", "--road flat --controller third_order_smc"),
    "supply": ("that draws air from both ends at once", "--road E"),
    "force": ("that moves the springs slowly and fast, by little and by much", "--road sweep"),
    "tyre": ("that goes through the wheels' hop", "--road sweep"),
    "sensor": ("that takes each sensor through its range slowly", "--road sine"),
    "body": ("that shakes heave and pitch", "--road bump"),
    "road": ("on another road than the one that was fitted", "--road E"),
}

_ORDINALS: Final = ("second", "third", "fourth", "fifth")  # names of logs that come next [display]


@dataclass(frozen=True)
class Asked:
    """What the user typed, so that the next command can be typed at the same place.

    Attributes
    ----------
    fit, holdout : logs, as typed
    output : the diagnosis' folder, as typed
    rig : the file of --save-rig; None where none was wanted
    options : of the diagnosis, to be repeated
    rig_options : of ``pneumo run`` for the rig that the logs are of; none where another recorder made them
    program : how ``pneumo`` was called: a path, where the shell would not find the name
    """

    fit: tuple[Path, ...] = (Path("FIT.mcap"),)
    holdout: Path | None = None
    output: Path = Path("DIAGNOSIS")
    rig: Path | None = None
    options: tuple[str, ...] = ()
    rig_options: tuple[str, ...] = ()
    program: str = "pneumo"

    def diagnosis(self, *further: Path, output: Path, options: tuple[str, ...] = ()) -> str:
        """``pneumo diagnose`` of the same logs and further ones."""
        held = () if self.holdout is None else ("--holdout", self.holdout)
        words = (self.program, "diagnose", *self.fit, *further, *held, *self.options, "--output", output, *options)
        return command(*words)

    def session(self, *options: object, output: Path) -> str:
        """``pneumo run`` on the rig that the logs are of."""
        return command(self.program, "run", *self.rig_options, *options, "--output", output)


@dataclass(frozen=True)
class Step:
    """A sentence, and what to type for it, line by line; the first one is what comes next."""

    text: str
    commands: tuple[str, ...] = ()


def command(*words: object) -> str:
    """Words as a shell takes them."""
    return " ".join(shlex.quote(str(word)) for word in words)


def next_steps(summary: Mapping[str, Any], asked: Asked | None = None) -> list[Step]:
    """What to do with the verdict, the most useful first."""
    asked = asked or Asked()
    if summary.get("rig_model"):
        return _own_steps(summary, asked)
    if summary["verdict"] == "not_testable":
        return [_record_again(summary, asked)]
    experiment = summary.get("next_experiment")
    steps = [_experiment(experiment, asked)] if experiment else []
    if summary["verdict"] == "unknown":
        return [*steps, _look_closer(summary, asked), _idea(summary, asked)]
    if not experiment and float(summary["probability"]) < LIKELY:
        steps.append(_more(asked, "Log a second session on another road and fit both.", "--road E"))
    return [*steps, _keep(summary, asked)]


def _own_steps(summary: Mapping[str, Any], asked: Asked) -> list[Step]:
    """For a rig of one's own, which no verb drives."""
    verdict = str(summary["verdict"])
    if verdict == "not_testable":
        return [Step("Record a log that moves more, or longer.")]
    if verdict == "unknown":
        where = first_place(summary) or "the curves of the report"
        return [Step(f"Look at {where}. What could be missing there is a further slot of rig.py (docs/your-rig.md).")]
    rig = asked.rig or asked.output / "rig.yaml"
    text = "Keep the model, with its parameters as re-estimated." if verdict == "none" else (
        f"Look at {first_place(summary) or 'it'} on the rig, or keep the effect in the model.")  # fmt: skip
    options = () if asked.rig is not None else ("--overwrite", "--save-rig", str(rig))
    split = [_own_experiment(summary["next_experiment"], asked)] if summary.get("next_experiment") else []
    if asked.rig is not None:
        return [*split, Step(f"{text} {rig} has it, for --rig of the next diagnosis.")]
    return [*split, Step(f"{text} A rig file has it, for --rig of the next diagnosis:",
                 (asked.diagnosis(output=asked.output, options=options),))]  # fmt: skip


def _own_experiment(experiment: Mapping[str, Any], asked: Asked) -> Step:
    file = shlex.quote(str(asked.output / str(experiment["file"])))
    aim = f"{_split(experiment)}: {str(experiment['description']).rstrip('.')}. {file} holds it"
    return Step(f"{aim}; it stays inside what the log had of range and rate. Log that, and fit both logs.")


def _experiment(experiment: Mapping[str, Any], asked: Asked) -> Step:
    played = _second(asked)
    files = {key: asked.output / name for key, name in (("--road", ROAD_FILE), ("--valves", VALVE_FILE))}
    length = str(experiment.get("command", "")).rpartition("--duration ")[2].split(" ")[0] or "12"
    run = asked.session(*(word for pair in files.items() for word in pair), "--duration", length, output=played)
    text = str(experiment["description"]).rstrip(".")
    return Step(
        f"{_split(experiment)}: {text}.{_where(asked)}", (run, asked.diagnosis(played, output=_another(asked.output)))
    )


def _split(experiment: Mapping[str, Any]) -> str:
    """What an experiment is for: "Split heat transfer from leak"."""
    names = [" and ".join(effect_name(one) for one in str(name).split("+")) for name in experiment.get("splits") or ()]
    if len(names) != 2:
        return "Split the rivals"
    return f"Tell whether {names[1]} is there at all" if names[0] == "none" else f"Split {names[0]} from {names[1]}"


def _where(asked: Asked) -> str:
    """A sentence for logs that do not say which rig made them: another one's session would mix two rigs."""
    return "" if asked.rig_options else (
        " Only a session of the rig that made the logs tells; the command runs the simulated one, on hardware add "
        "--source serial --port PORT --calibration FILE.")  # fmt: skip


def _second(asked: Asked) -> Path:
    """A log beside the first one that is neither given nor there: second.mcap, then third.mcap and so on."""
    folder = asked.fit[0].parent
    known = {log.name for log in (*asked.fit, *([asked.holdout] if asked.holdout else []))}
    names = (*_ORDINALS, *(f"session-{number}" for number in range(len(_ORDINALS) + 2, 1000)))
    fresh = (folder / f"{name}.mcap" for name in names if f"{name}.mcap" not in known)
    return next(path for path in fresh if not path.exists())


def _another(folder: Path) -> Path:
    """The next folder of a row that is not there: report, report-2, report-3."""
    stem, _, last = folder.name.rpartition("-")
    follows = stem and last.isdigit() and folder.with_name(stem).exists()
    name, number = (stem, int(last)) if follows else (folder.name, 1)
    rest = (folder.with_name(f"{name}-{k}") for k in range(number + 1, number + 1000))
    return next(path for path in rest if not path.exists())


def _more(asked: Asked, text: str, options: str) -> Step:
    played = _second(asked)
    run = asked.session(*options.split(), "--duration", "20", output=played)
    return Step(f"{text}{_where(asked)}", (run, asked.diagnosis(played, output=_another(asked.output))))


def _look_closer(summary: Mapping[str, Any], asked: Asked) -> Step:
    """The experiment for a place without a name: what moves that place."""
    places = [str(entry["place"]) for entry in summary.get("location") or []]
    kind = next((kind for kind in _TELLING for place in places[:1] if kind in place), "road")
    moves, options = _TELLING[kind]
    where = place_words(places[0]) if places else "the rig"
    return _more(asked, f"Log a session {moves}: it shows more of the law at {where}.", options)


def _idea(summary: Mapping[str, Any], asked: Asked) -> Step:
    where = first_place(summary) or "the curves of the report"
    text = f"Look at {where}. An idea becomes a candidate as a Python file (docs/diagnosis.md shows one)."
    return Step(text, (asked.diagnosis(output=_another(asked.output), options=("--effect", "MY_EFFECT.py")),))


def _keep(summary: Mapping[str, Any], asked: Asked) -> Step:
    none = summary["verdict"] == "none"
    rig = asked.rig or asked.output / "rig.yaml"
    drive = command(asked.program, "run", "--rig", rig)
    text = "Keep the model, with its parameters as re-estimated." if none else (
        f"Look at {first_place(summary) or 'it'} on the rig, or keep the effect in the model.")  # fmt: skip
    if asked.rig is not None:
        return Step(f"{text} {rig} has it, for --rig of every verb:", (drive,))
    save = asked.diagnosis(output=asked.output, options=("--overwrite", "--save-rig", str(rig)))
    return Step(f"{text} The first command writes a rig file with it, for --rig of every verb:", (save, drive))


def _record_again(summary: Mapping[str, Any], asked: Asked) -> Step:
    if forbidden(summary):
        return Step("Mend what is listed as a note, and record the session again.")
    run = asked.session("--road", "E", "--duration", "20", output=_second(asked))
    return Step("Record a session that moves more: a rougher road with the valves at work, 15 s or longer.", (run,))
