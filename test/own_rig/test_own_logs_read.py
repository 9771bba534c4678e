# SPDX-License-Identifier: Apache-2.0
"""One log in every form that a rig of one's own may come in: the same record."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from rosbags.typesys import Stores, get_typestore
from scipy.io import savemat

from pneumo_ros.errors import InputError
from pneumo_ros.log.cdr import JointEncoder
from pneumo_ros.log.topics import JOINT
from pneumo_ros.log.writing import LogWriter
from pneumo_ros.own_rig.description import read_description
from pneumo_ros.own_rig.propose import proposal
from pneumo_ros.own_rig.quantities import quantity
from pneumo_ros.own_rig.records import OwnRecord, read_record

TIME = np.arange(600) * 0.01
X, U = np.sin(3.0 * TIME), np.cos(3.0 * TIME)
FORMS: dict[str, tuple[str, str]] = {  # file -> time, channels and inputs of its rig file
    "log.csv": ("time: {field: t, unit: ms}\n", "x: {unit: mm, noise: 0.1}|u: {sign: -1}"),
    "bare.csv": ("time: {field: 0, unit: ms}\n", "x: {field: 1, unit: mm, noise: 0.1}|u: {field: 2, sign: -1}"),
    "log.mat": ("time: 0.01 s\n", "x: {field: 'data.y[0]', unit: mm, noise: 0.1}|u: {field: data.u, sign: -1}"),
    "log.parquet": ("time: {field: t, unit: ms}\n", "x: {unit: mm, noise: 0.1}|u: {sign: -1}"),
    "log.mcap": ("", "x: {topic: /cart, field: 'position[rail]', unit: mm, noise: 0.1}|"
                     "u: {topic: /motor, field: 'effort[0]', sign: -1}"),
}  # fmt: skip


def write(path: Path) -> Path:
    table = np.column_stack([1e3 * TIME, 1e3 * X, -U])
    if path.name == "log.csv":
        np.savetxt(path, table, "%.9f", ",", header="t,x,u", comments="")
    elif path.name == "bare.csv":  # points between thousands, semicolons, no names
        rows = [f"{row[0]:,.3f}".replace(",", ".") + f";{row[1]:.9f};{row[2]:.9f}" for row in table]
        path.write_text("\n".join(rows) + "\n")
    elif path.suffix == ".mat":
        savemat(path, {"data": {"y": np.column_stack([1e3 * X, X]), "u": -U}})
    elif path.suffix == ".parquet":
        pa = pytest.importorskip("pyarrow", reason="reference data not found: Parquet needs pyarrow")
        from pyarrow import parquet

        parquet.write_table(pa.table({name: table[:, k] for k, name in enumerate(("t", "x", "u"))}), path)
    else:
        bag(path, 1)
    return path


def bag(path: Path, every: int) -> None:
    """A cart and a motor on topics of their own; the cart sampled every so many rows."""
    writer = LogWriter(path, {}, bag_folder=False)
    cart, motor = writer.add_topic("/cart", JOINT), writer.add_topic("/motor", JOINT)
    place = JointEncoder("", ("other", "rail"))
    types = get_typestore(Stores.ROS2_JAZZY)
    joint, header, stamp = (types.types[name] for name in (JOINT, "std_msgs/msg/Header", "builtin_interfaces/msg/Time"))
    for k, (t, x, u) in enumerate(zip(TIME, X, U, strict=True)):
        ns = round(1e9 * t) + 10**9
        if k % every == 0:
            writer.write(cart, place.encode(ns, [5.0, 1e3 * float(x)]), ns)
        message = joint(header=header(stamp=stamp(sec=ns // 10**9, nanosec=ns % 10**9), frame_id=""), name=["axle"],
                        position=np.zeros(0), velocity=np.zeros(0), effort=np.array([-float(u)]))  # fmt: skip
        writer.write(motor, bytes(types.serialize_cdr(message, JOINT)), ns)
    writer.finish(True, "")


def described(folder: Path, time: str, signals: str) -> Callable[[Path], OwnRecord]:
    channel, _, driver = signals.partition("|")
    text = f"{time}channels:\n  {channel}\ninputs:\n  {driver}\nstates: {{x: x}}\n"
    (folder / "rig.yaml").write_text(text)
    rig = read_description(folder / "rig.yaml")
    return lambda path: read_record(path, rig)


@pytest.mark.parametrize("name", FORMS)
def test_every_form_of_a_log_is_the_same_record(name: str, tmp_path: Path) -> None:
    record = described(tmp_path, *FORMS[name])(write(tmp_path / name))
    assert record.period == pytest.approx(0.01, rel=1e-6) and len(record.measured) >= 599
    assert np.allclose(record.measured[:599, 0], X[:599], atol=1e-6)
    assert np.allclose(record.inputs[:599, 0], U[:599], atol=1e-6)
    assert record.noise == pytest.approx([1e-4])


def test_topics_at_their_own_rates_count_where_they_were_sampled(tmp_path: Path) -> None:
    bag(tmp_path / "slow.mcap", 4)
    text = "channels:\n  x: {topic: /cart, field: 'position[rail]', unit: mm}\n"
    text += "  v: {topic: /motor, field: 'effort[axle]'}\n"
    (tmp_path / "rig.yaml").write_text(text + "states: {x: x}\n")
    record = read_record(tmp_path / "slow.mcap", read_description(tmp_path / "rig.yaml"))
    assert record.weight.mean(axis=0) == pytest.approx([0.25, 1.0], abs=0.01)
    there = record.weight[:, 0] > 0.0
    assert np.allclose(record.measured[there, 0], X[: len(there)][there], atol=1e-6)


def test_a_log_proposes_its_own_rig_file(tmp_path: Path) -> None:
    bag(tmp_path / "log.mcap", 2)
    found = yaml.safe_load(proposal(tmp_path / "log.mcap"))["channels"]
    assert found == {"rail": {"topic": "/cart", "field": "position[rail]", "unit": "1"},
                     "axle": {"topic": "/motor", "field": "effort[axle]", "unit": "1"}}  # fmt: skip
    table = yaml.safe_load(proposal(write(tmp_path / "log.csv")))
    assert table["time"]["field"] == "t" and list(table["channels"]) == ["x", "u"]


def test_numbers_are_read_as_people_write_them() -> None:
    assert quantity("0.669 +- 0.13 N s/m", "f", "k").std == 0.13
    assert quantity("80 +- 5% N/m", "f", "k").std == 4.0
    gauge = quantity("2 +- 0.1 bar gauge", "f", "k")
    assert (gauge.value, gauge.std, gauge.unit) == (301325.0, pytest.approx(1e4), "Pa")
    for bad in ("two", True, None, "1e999", "3 +- -1 kg", [1]):
        with pytest.raises(InputError):
            quantity(bad, "f", "k")
