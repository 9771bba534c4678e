# SPDX-License-Identifier: Apache-2.0
"""A bag with other topics, other types and another layout of the half car's log: the same diagnosis, byte for byte."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.rig_logs import noisy, simulated, write_log
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from pneumo_ros.diagnosis.diagnose import Options
from pneumo_ros.errors import InputError
from pneumo_ros.log.reading import read_log
from pneumo_ros.own_rig.from_files import OwnTask, prepared
from pneumo_ros.own_rig.outputs import write_outputs
from pneumo_ros.own_rig.propose import proposal

AXLE = """
from pneumo_ros.own_rig import Force, Sensor

SLOTS = [
    Force("strut", travel=lambda x, u, p: x.axle - u.body, rate=lambda x, u, p: x.speed - u.body_speed),
    Sensor("axle"),
]


def rhs(x, u, p, f):
    strut = p.area * (u.pressure - 101325.0) + p.damping * (x.speed - u.body_speed)
    return x.speed, (p.tyre * (u.road - x.axle) - strut + f.strut) / p.mass - 9.81


def outputs(x, u, p, f):
    return (x.axle,)
"""
NAMES = """
rig: front axle
channels:
  axle: {{{axle}}}
inputs:
  body: {{{body}}}
  body_speed: {{rate_of: body}}
  road: {{{road}}}
  pressure: {{{pressure}}}
states: {{axle: axle, speed: rate of axle}}
parameters: {{mass: 4.54 +- 0.05 kg, tyre: 14000 +- 600 N/m, area: 1.1e-3 +- 0.1e-3 m2, damping: 50 +- 8 N s/m}}
families: {{strut: [coulomb_friction, viscous_damping], 'sensor:axle': [lag]}}
"""
OWN = {
    "axle": "topic: /rig/displacement, field: 'position[unsprung_front]'",
    "body": "topic: /rig/displacement, field: 'position[sprung_front]'",
    "road": "topic: /road/profile, field: 'position[front]'",
    "pressure": "topic: /rig/front/pressure, field: fluid_pressure",
}
FOREIGN = {
    "axle": "topic: /lab/corner, field: 'heights[1]'",
    "body": "topic: /lab/corner, field: 'heights[0]'",
    "road": "topic: /bench, field: plate.lift",
    "pressure": "topic: /lab/gauge, field: absolute",
}
TYPES = {
    "lab_msgs/msg/Corner": "std_msgs/Header header\nfloat32 battery\nfloat64[] heights",
    "lab_msgs/msg/Plate": "float64 lift\nbool moving",
    "lab_msgs/msg/Bench": "std_msgs/Header header\nlab_msgs/Plate plate",
    "lab_msgs/msg/Gauge": "string label\nstd_msgs/Header header\nfloat64 absolute",
}


def foreign(log: Path, folder: Path) -> Path:
    """The log as another recorder would have written it: a rosbag2 folder with types of its own."""
    held = read_log(log)
    body, road = held.joint("/rig/displacement"), held.joint("/road/profile")
    gauge = held.columns("/rig/front/pressure")
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in TYPES.items():
        store.register(get_types_from_msg(text, name))
    made = store.types
    heights = body.position[:, [body.names.index(n) for n in ("sprung_front", "unsprung_front")]]
    lift = road.position[:, road.names.index("front")]
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        kinds = {"/bench": "Bench", "/lab/gauge": "Gauge", "/lab/corner": "Corner"}
        links = {t: writer.add_connection(t, f"lab_msgs/msg/{kind}", typestore=store) for t, kind in kinds.items()}
        for k, ns in enumerate(body.stamp_ns.tolist()):
            stamp = made["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
            header = made["std_msgs/msg/Header"](stamp=stamp, frame_id="lab")
            plate = made["lab_msgs/msg/Plate"](lift=float(lift[k]), moving=True)
            for topic, kind, values in (
                ("/bench", "Bench", {"plate": plate}),
                ("/lab/gauge", "Gauge", {"label": "front", "absolute": float(gauge.arrays["fluid_pressure"][k])}),
                ("/lab/corner", "Corner", {"battery": 12.1, "heights": heights[k].copy()}),
            ):
                message = made[f"lab_msgs/msg/{kind}"](header=header, **values)
                writer.write(links[topic], ns, store.serialize_cdr(message, f"lab_msgs/msg/{kind}"))
    return folder


def described(folder: Path, where: dict[str, str]) -> Path:
    folder.mkdir()
    (folder / "rig.py").write_text(AXLE, encoding="utf-8")
    (folder / "rig.yaml").write_text(NAMES.format(**where), encoding="utf-8")
    return folder / "rig.py"


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The contract's log and the foreign one, both named session."""
    folder = tmp_path_factory.mktemp("bags")
    clean, road, commands = simulated(2.0, 4)
    own = write_log(folder / "session.mcap", noisy(clean, 4), road, commands, [])
    return own, foreign(own, folder / "session")


def task(folder: Path, where: dict[str, str], log: Path) -> OwnTask:
    return prepared(described(folder, where), [log])


@pytest.mark.slow
def test_a_foreign_bag_is_diagnosed_byte_for_byte_as_the_original(logs: tuple[Path, Path], tmp_path: Path) -> None:
    written = []
    for name, where, log in (("own", OWN, logs[0]), ("foreign", FOREIGN, logs[1])):
        made = task(tmp_path / name, where, log)
        write_outputs(tmp_path / name / "out", made.diagnose(Options(pairs=False)), made.model, made.fit, made.holdout)
        written.append((tmp_path / name / "out" / "diagnosis.json").read_bytes())
    assert written[0] == written[1]


def test_the_records_are_the_same_to_the_bit(logs: tuple[Path, Path], tmp_path: Path) -> None:
    own, other = (task(tmp_path / name, where, log).fit[0] for name, where, log in
                  (("own", OWN, logs[0]), ("foreign", FOREIGN, logs[1])))  # fmt: skip
    assert np.array_equal(own.measured, other.measured) and np.array_equal(own.inputs, other.inputs)
    assert own.period == other.period and own.name == other.name == "session"


def test_a_bag_folder_of_unknown_types_proposes_its_names(logs: tuple[Path, Path]) -> None:
    text = proposal(logs[1])
    assert 'topic: /lab/corner, field: "heights[1]"' in text and "topic: /bench, field: plate.lift" in text


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("topic: /lab/corner, field: heights", "not one number a message"),
        ("topic: /lab/corners", "no such topic"),
        ("topic: /bench, field: plate.drop", "no such field"),
        ("topic: /lab/corner, field: 'heights[2]'", "no such entry"),
    ],
)
def test_a_wrong_name_in_a_foreign_bag_is_told(entry: str, said: str, logs: tuple[Path, Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said) as told:
        task(tmp_path / "bad", {**FOREIGN, "axle": entry}, logs[1])
    assert len(str(told.value).splitlines()) == 1
