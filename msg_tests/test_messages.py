# SPDX-License-Identifier: Apache-2.0
"""Messages of a real session against the table of topics: types, names, units' order of magnitude, frames, docs."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.folders import DOCS

pytest.importorskip("rclpy")
from helpers import sessions

from pneumo_ros.cli.reference import documents
from pneumo_ros.log import topics
from pneumo_ros.log.decoded import Log
from pneumo_ros.log.reading import read_log
from pneumo_ros.nodes.interfaces import message_class

PLAUSIBLE = {  # unit -> largest magnitude a running rig can show
    "m": 0.2,
    "rad": 0.3,
    "m/s": 5.0,
    "rad/s": 10.0,
    "m/s2": 500.0,
    "rad/s2": 2000.0,
    "Pa": 1e6,
    "Pa2": 1e6,
    "m2": 0.1,
    "N": 2000.0,
}
IN_LOCKSTEP = [
    t for t in topics.TOPICS if t.recorded and t.publisher in ("road_profile", "plant", "estimator", "controller")
]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    path = tmp_path_factory.mktemp("messages") / "session.mcap"
    code, said = sessions.run("--duration", "2", "--output", str(path), "--single-process", "--no-picture")
    assert code == 0, said
    return read_log(path)


@pytest.mark.parametrize("topic", topics.TOPICS, ids=lambda t: t.name)
def test_type_exists(topic: topics.Topic) -> None:
    made = message_class(topic.type)
    assert f"{made.__module__.split('.')[0]}/msg/{made.__name__}" == topic.type
    assert topic.meaning and topic.name.startswith("/")


@pytest.mark.parametrize("topic", IN_LOCKSTEP, ids=lambda t: t.name)
def test_topic_is_published_as_the_table_says(log: Log, topic: topics.Topic) -> None:
    info = log.topics[topic.name]
    assert info.type == topic.type and info.count > 0
    if topic.type == topics.JOINT:
        joint = log.joint(topic.name)
        assert joint.names == topic.names
        for column, (name, unit) in zip(joint.position.T, topic.fields, strict=True):
            assert np.all(np.isfinite(column)) and np.max(np.abs(column)) < PLAUSIBLE[unit], name
        assert (joint.velocity is not None) == topic.rates


@pytest.mark.parametrize("name", ["topics.md", "parameters.md"])
def test_generated_docs_are_up_to_date(name: str) -> None:
    assert (DOCS / name).read_text(encoding="utf-8") == documents()[name], "run `make docs`"


def test_every_declared_parameter_says_what_it_is() -> None:
    from pneumo_ros.cli.session_plan import node_tables

    for node, table in node_tables().items():
        for p in table:
            assert p.description, f"{node}.{p.name}"
            if isinstance(p.default, float):
                assert p.unit, f"{node}.{p.name} has no unit"
                assert np.isfinite(p.low) and np.isfinite(p.high), f"{node}.{p.name} has no range"
                assert p.low <= p.default <= p.high
