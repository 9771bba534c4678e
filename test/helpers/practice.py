# SPDX-License-Identifier: Apache-2.0
"""The practice logs as test/data/practice holds them, columns of whole numbers, packed; and the logs made of them.

    python test/helpers/practice.py FOLDER [NAME...]     # packs the pairs of a folder anew

A log of 15 s takes 1.4 MB as an MCAP file and about 80 kB so. Numbers are rounded to steps far below the sensors' noise
(10 um, 150 Pa); nothing else is changed.
"""

from __future__ import annotations

import json
import lzma
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from pneumo_ros.log.cdr import JointEncoder, PressureEncoder
from pneumo_ros.log.reading import read_log
from pneumo_ros.log.topics import COMMAND, DISPLACEMENT, FRONT_PRESSURE, JOINT, PRESSURE, REAR_PRESSURE, ROAD, STRING
from pneumo_ros.log.writing import LogWriter

DATA = Path(__file__).resolve().parents[1] / "data" / "practice"
OTHER_WRITER = DATA / "other-writer.mcap"  # the first 2.2 s of leak-front-fit, as its maker's logger wrote them
STEPS = {ROAD.name: 2.5e-7, DISPLACEMENT.name: 5e-7, COMMAND.name: 1e-11, "pressure": 8.0}  # m, m, m2, Pa
PRESSURES = (FRONT_PRESSURE, REAR_PRESSURE)
JOINTS = (ROAD, DISPLACEMENT, COMMAND)
Whole = NDArray[np.int64]


def packed(log_path: Path, target: Path) -> None:
    """Write the columns of a log: config and names as JSON, then second differences, topic by topic."""
    log = read_log(log_path)
    joints = {topic.name: log.joint(topic.name) for topic in JOINTS}
    pressures = [log.pressure(topic.name) for topic in PRESSURES]
    stamps = joints[ROAD.name].stamp_ns
    assert all(np.array_equal(one.stamp_ns, stamps) for one in (*joints.values(), *pressures))
    columns = [np.round(joint.position / STEPS[name]).astype(np.int64) for name, joint in joints.items()]
    columns += [np.round(one.value / STEPS["pressure"]).astype(np.int64)[:, None] for one in pressures]
    table = np.column_stack([stamps, *columns])
    head = {
        "config": log.texts("/rig/config")[-1],
        "names": {name: list(joint.names) for name, joint in joints.items()},
        "variance": float(pressures[0].variance[0]),
        "rows": len(table),
    }
    again = np.diff(table, n=2, axis=0, prepend=np.zeros((2, table.shape[1]), dtype=np.int64))
    text = json.dumps(head).encode()
    body = again[:2].tobytes() + again[2:].T.astype("<i4").tobytes()
    assert np.array_equal(again[2:].astype("<i4"), again[2:])
    target.write_bytes(lzma.compress(len(text).to_bytes(4, "little") + text + body, preset=9 | lzma.PRESET_EXTREME))


def made(name: str, folder: Path) -> Path:
    """The log of that name, "leak-front-fit" for example, as an MCAP file in a folder."""
    path = folder / f"{name}.mcap"
    if not path.exists():
        _write(DATA / f"{name}.xz", path)
    return path


def labels() -> list[dict]:  # type: ignore[type-arg]
    """What was wrong with the rig of each pair, and where."""
    found: list[dict] = json.loads((DATA / "labels.json").read_text(encoding="utf-8"))  # type: ignore[type-arg]
    return found


def _unpacked(source: Path) -> tuple[dict, Whole]:  # type: ignore[type-arg]
    data = lzma.decompress(source.read_bytes())
    end = 4 + int.from_bytes(data[:4], "little")
    head = json.loads(data[4:end])
    width = 1 + sum(map(len, head["names"].values())) + len(PRESSURES)
    first = np.frombuffer(data, dtype="<i8", count=2 * width, offset=end).reshape(2, width)
    rest = np.frombuffer(data, dtype="<i4", offset=end + first.nbytes).reshape(width, -1).T
    return head, np.cumsum(np.cumsum(np.vstack([first, rest.astype(np.int64)]), axis=0), axis=0)


def _write(source: Path, target: Path) -> None:
    head, table = _unpacked(source)
    writer = LogWriter(target, bag_folder=False)
    store = get_typestore(Stores.ROS2_JAZZY)
    config = bytes(store.serialize_cdr(store.types[STRING](data=head["config"]), STRING))
    writer.write(writer.add_topic("/rig/config", STRING), config, int(table[0, 0]))
    stamps, first = table[:, 0].tolist(), 1
    for topic in JOINTS:
        names = head["names"][topic.name]
        channel, encoder = writer.add_topic(topic.name, JOINT), JointEncoder(topic.frame_id, names)
        rows = (table[:, first : first + len(names)] * STEPS[topic.name]).tolist()
        for stamp, row in zip(stamps, rows, strict=True):
            writer.write(channel, encoder.encode(stamp, row), stamp)
        first += len(names)
    for k, topic in enumerate(PRESSURES):
        channel, encoder = writer.add_topic(topic.name, PRESSURE), PressureEncoder(topic.frame_id, head["variance"])
        for stamp, value in zip(stamps, (table[:, first + k] * STEPS["pressure"]).tolist(), strict=True):
            writer.write(channel, encoder.encode(stamp, value), stamp)
    writer.finish()


def main() -> None:
    """Pack pairs anew."""
    folder, names = Path(sys.argv[1]), sys.argv[2:]
    DATA.mkdir(parents=True, exist_ok=True)
    for path in sorted(folder.glob("*.mcap")):
        if not names or path.stem in names:
            packed(path, DATA / f"{path.stem}.xz")
            print(path.stem, (DATA / f"{path.stem}.xz").stat().st_size)


if __name__ == "__main__":
    main()
