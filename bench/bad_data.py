# SPDX-License-Identifier: Apache-2.0
"""Diagnoses of spoiled logs: what each kind of bad data does to the verdict, on twelve cases with a known answer.

``python bench/bad_data.py --results FILE`` goes on where FILE ends; ``--cases 3`` takes the first three. The good
answers are: an error of one line; no name (not_testable, unknown, none); the right name; or any name beside a new note.
A finding is a wrong name of more than half the probability, with no note that the sound log's diagnosis does not have.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "test"))

from helpers.own_logs import QUICK, driven
from helpers.rig_logs import excitation, noisy, topics_of_channels
from rosbags.typesys import Stores, get_typestore

from pneumo_ros.diagnosis.diagnose import Options
from pneumo_ros.diagnosis.half_car.from_logs import diagnose_files
from pneumo_ros.diagnosis.half_car.signals import TopicData
from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder
from pneumo_ros.log.topics import JOINT, STRING, TOPICS
from pneumo_ros.log.writing import LogWriter
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig

Topics = dict[str, TopicData]
SECONDS, START = 6.0, 10**18
MOVED, FRONT, REAR = "/rig/displacement", "/rig/front/pressure", "/rig/rear/pressure"
CASES: dict[str, tuple[tuple[str, str, float], ...]] = {  # effect, site, factor on its typical size
    "leak": (("leak", "front", 1.0),), "friction": (("coulomb_friction", "rear", 1.0),), "none": (),
    "valve lag": (("valve_lag", "rear", 1.0),), "tyre damping": (("tyre_damping", "both", 1.0),),
    "damping": (("viscous_damping", "front", 1.0),), "lvdt scale": (("lvdt_scale", "sprung_rear", 1.0),),
    "payload": (("payload", "", 1.0),), "pressure scale": (("pressure_scale", "rear_pressure", 1.0),),
    "hysteresis": (("bellows_hysteresis", "rear", 1.0),), "delay": (("transport_delay", "", 1.0),),
    "friction and leak": (("coulomb_friction", "rear", 1.0), ("leak", "front", 1.0)),
}  # fmt: skip


def on(topic: str, name: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Topics], Topics]:
    """One channel changed, or all of a topic for ''."""

    def changed(topics: Topics) -> Topics:
        data = topics[topic]
        channels = {key: change(value.copy()) if name in ("", key) else value for key, value in data.channels.items()}
        return {**topics, topic: data._replace(channels=channels)}

    return changed


def spiky(values: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(3)
    values[rng.choice(len(values), len(values) // 100, replace=False)] += 20.0 * values.std()
    return values


def holed(values: np.ndarray) -> np.ndarray:
    values[np.random.default_rng(4).random(len(values)) < 0.05] = np.nan
    return values


def stuck(values: np.ndarray) -> np.ndarray:
    values[len(values) // 2 :] = values[len(values) // 2]
    return values


def clipped(values: np.ndarray) -> np.ndarray:
    return np.clip(values, *np.quantile(values, [0.25, 0.75]))


def late(topic: str, seconds: float) -> Callable[[Topics], Topics]:
    """Stamps of a topic shifted against the others."""
    return lambda topics: {**topics, topic: topics[topic]._replace(stamp=topics[topic].stamp + seconds)}


def rows(choose: Callable[[np.ndarray], np.ndarray]) -> Callable[[Topics], Topics]:
    """The same rows of every topic."""

    def chosen(topics: Topics) -> Topics:
        out = {}
        for name, data in topics.items():
            index = choose(data.stamp)
            out[name] = TopicData(data.stamp[index], {key: value[index] for key, value in data.channels.items()})
        return out

    return chosen


def swapped(topics: Topics) -> Topics:
    """The two pressure sensors at each other's place."""
    return {**topics, FRONT: topics[REAR], REAR: topics[FRONT]}


def crossed(topics: Topics) -> Topics:
    """The two sensors of the body at each other's place."""
    found = dict(topics[MOVED].channels)
    found["sprung_front"], found["sprung_rear"] = found["sprung_rear"], found["sprung_front"]
    return {**topics, MOVED: topics[MOVED]._replace(channels=found)}


MUTATIONS: dict[str, Callable[[Topics], Topics]] = {
    "as it is": dict, "constant": on(MOVED, "sprung_front", lambda v: 0.0 * v + v[0]),
    "all NaN": on(FRONT, "pressure", lambda v: v * np.nan), "5 % NaN": on(MOVED, "unsprung_rear", holed),
    "spiky": on(MOVED, "sprung_rear", spiky), "spiky pressure": on(REAR, "pressure", spiky),
    "clipped": on(MOVED, "sprung_front", clipped), "clipped pressure": on(REAR, "pressure", clipped),
    "stuck": on(MOVED, "unsprung_front", stuck), "stuck pressure": on(FRONT, "pressure", stuck),
    "pressures swapped": swapped, "body sensors swapped": crossed,
    "millimetres": on(MOVED, "", lambda v: 1e3 * v), "psi": on(FRONT, "pressure", lambda v: v / 6894.757),
    "gauge": on(REAR, "pressure", lambda v: v - 101325.0), "sign": on(MOVED, "sprung_rear", lambda v: -v),
    "200 ms late": late(FRONT, 0.2), "20 ms late": late(MOVED, 0.02),
    "commands 200 ms late": late("/valve/command", 0.2),
    "gap": rows(lambda t: np.flatnonzero((t < 2.0) | (t > 3.0))),
    "rows doubled": rows(lambda t: np.sort(np.r_[np.arange(len(t)), np.arange(0, len(t), 7)])),
    "1 s": rows(lambda t: np.flatnonzero(t < 1.0)), "10 Hz": rows(lambda t: np.arange(0, len(t), 50)),
}  # fmt: skip
PAIRS: dict[str, Callable[[Topics, Topics], Topics]] = {
    "hold-out is fit": lambda fit, held: fit,
    "hold-out is fit, rounded": lambda fit, held: {
        name: data._replace(channels={k: v.astype(np.float32).astype(float) for k, v in data.channels.items()})
        for name, data in fit.items()
    },
    "hold-out is fit, shifted": lambda fit, held: {
        name: data._replace(stamp=data.stamp + 100.0) for name, data in fit.items()
    },
    "hold-out overlaps fit": lambda fit, held: rows(lambda t: np.flatnonzero(t > 2.0))(fit),
    "hold-out of another rig": lambda fit, held: on(MOVED, "", lambda v: 1.3 * v)(held),
}  # what becomes of the held-out log, given both


def logged(case: str, seed: int) -> Topics:
    """A sound log of a case."""
    model = RigModel(load_rig())
    active = []
    for effect, site, factor in CASES[case]:
        parameters = model.effects[effect].parameters
        active.append(Active(effect, site, tuple(p.typical * factor if p.size else p.typical for p in parameters)))
    road, commands = excitation(SECONDS, seed)
    clean = model.simulate(driven(road, commands), initial=trim(model.rig).state, active=tuple(active))
    return dict(topics_of_channels(noisy(clean, seed), road, commands))


def written(path: Path, topics: Topics) -> Path:
    """A log file of these topics, as their stamps say."""
    path.unlink(missing_ok=True)
    writer, store = LogWriter(path, bag_folder=False), get_typestore(Stores.ROS2_JAZZY)
    config = bytes(store.serialize_cdr(store.types[STRING](data=load_rig().to_yaml()), STRING))
    writer.write(writer.add_topic("/rig/config", STRING), config, START)
    for topic in (t for t in TOPICS if t.name in topics):
        data, channel = topics[topic.name], writer.add_topic(topic.name, topic.type)
        joint, gauge = JointEncoder(topic.frame_id, tuple(data.channels)), PressureEncoder(topic.frame_id, 150.0**2)
        table = np.column_stack(list(data.channels.values()))
        for stamp, row in zip((START + np.round(data.stamp * 1e9)).astype(int).tolist(), table.tolist(), strict=True):
            encoded = joint.encode(stamp, row) if topic.type == JOINT else gauge.encode(stamp, row[0])
            writer.write(channel, encoded, stamp)
    writer.finish()
    return path


def tried(case: str, kind: str, folder: Path) -> dict[str, Any]:
    """One diagnosis of a spoiled pair of logs."""
    fit, held = logged(case, 1), logged(case, 2)
    if kind in PAIRS:
        held = PAIRS[kind](fit, held)
    else:
        fit, held = MUTATIONS[kind](fit), MUTATIONS[kind](held)
    began = time.process_time()
    try:
        found = diagnose_files([written(folder / "fit.mcap", fit)], written(folder / "held.mcap", held),
                               options=Options(effort=QUICK, pairs=False))  # fmt: skip
    except InputError as error:
        said = str(error)
        return {"verdict": "refused", "probability": 1.0, "notes": [], "said": said, "one line": "\n" not in said}
    return summary(found, time.process_time() - began)


def summary(found: Diagnosis, seconds: float) -> dict[str, Any]:
    """What counts of a diagnosis."""
    return {"verdict": found.verdict, "probability": round(found.probability, 3), "notes": list(found.notes),
            "seconds": round(seconds, 1)}  # fmt: skip


def judged(case: str, one: dict[str, Any], sound: dict[str, Any] | None) -> str:
    """What a result is; "WRONG" is a finding."""
    verdict = str(one["verdict"])
    if verdict in ("refused", "not_testable", "unknown", "none"):
        return "nothing wrong named" if verdict != "refused" else verdict
    if set(verdict.split("+")) <= {effect for effect, _, _ in CASES[case]}:
        return "right"
    known = {shape(text) for text in (sound or {"notes": []})["notes"]}
    if any(shape(text) not in known for text in one["notes"]):
        return "wrong, with a note"
    return "wrong, unsure" if one["probability"] <= 0.5 else "WRONG"


def shape(text: str) -> str:
    """A note without its numbers."""
    return re.sub(r"[-+0-9.e]+", "#", text)


def main() -> None:
    """Run what is missing, then print counts by mutation and every finding."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--results", type=Path, required=True)
    parser.add_argument("--cases", type=int, default=len(CASES))
    parser.add_argument("--show", action="store_true", help="only what the file holds")
    options = parser.parse_args()
    lines = options.results.read_text().splitlines() if options.results.exists() else []
    found = {(case, kind): one for case, kind, one in map(json.loads, lines)}
    for case in [] if options.show else list(CASES)[: options.cases]:
        for kind in (*MUTATIONS, *PAIRS):
            if (case, kind) in found:
                continue
            with tempfile.TemporaryDirectory() as folder:
                found[case, kind] = tried(case, kind, Path(folder))
            with options.results.open("a") as stream:
                stream.write(json.dumps([case, kind, found[case, kind]]) + "\n")
    counts: dict[str, Counter[str]] = {}
    for (case, kind), one in found.items():
        outcome = judged(case, one, found.get((case, "as it is")))
        counts.setdefault(kind, Counter())[outcome] += 1
        if outcome == "WRONG":
            print(f"{case}, {kind}: {one['verdict']} {one['probability']}")
    for kind, row in counts.items():
        print(f"| {kind} | {', '.join(f'{n} {name}' for name, n in row.items())} |")
    wrong = sum(row["WRONG"] for row in counts.values())
    print(f"{len(found)} diagnoses, {wrong} confident wrong names")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
