# SPDX-License-Identifier: Apache-2.0
"""Simulated logs for the tests of the diagnosis: the nominal rig, driven over a road with its valves moving."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rosbags.typesys import Stores, get_typestore

from pneumo_ros.diagnosis.half_car.signals import COMMANDS, MEASURED, ROADS, Signals, TopicData, prepare
from pneumo_ros.log.cdr import JointEncoder, PressureEncoder
from pneumo_ros.log.topics import COMMAND, DISPLACEMENT, FRONT_PRESSURE, JOINT, REAR_PRESSURE, ROAD, STRING
from pneumo_ros.log.writing import LogWriter
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.trim import nominal_half_car
from pneumo_ros.rig import Rig, load_rig

RATE = 500.0
DISPLACEMENT_NOISE, PRESSURE_NOISE = 1e-5, 150.0


def excitation(seconds: float, seed: int, rate: float = RATE) -> tuple[np.ndarray, np.ndarray]:
    """Road (N, 2) m and commands (N, 4) m2: a few sines on each, phases from the seed."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate

    def sines(size: float, frequencies: tuple[float, ...]) -> np.ndarray:
        phases = rng.uniform(0.0, 2.0 * np.pi, len(frequencies))
        waves = [np.sin(2.0 * np.pi * f * t + p) for f, p in zip(frequencies, phases, strict=True)]
        return size * np.mean(waves, axis=0) * np.minimum(t, 1.0)

    _, trim = nominal_half_car(load_rig())
    road = np.column_stack([sines(0.006, (0.7, 1.6, 3.1, 8.3)), sines(0.006, (0.9, 1.9, 3.6, 8.9))])
    commands = np.tile(trim.command, (len(t), 1))
    commands[:, 0] *= 1.0 + sines(0.6, (0.4, 1.1, 2.7))
    commands[:, 1] *= 1.0 + sines(0.6, (0.5, 1.3, 2.9))
    return road, commands


def channels_of(states: np.ndarray, rig: Rig) -> np.ndarray:
    front = states[:, 0] + rig.front_arm.value * states[:, 1]
    rear = states[:, 0] - rig.rear_arm.value * states[:, 1]
    return np.column_stack([front, rear, states[:, 2], states[:, 3], states[:, 8], states[:, 9]])


def simulated(
    seconds: float = 8.0, seed: int = 0, car: HalfCar | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Noise-free channels (N, 6), road and commands of a run from rest."""
    rig = load_rig()
    nominal, trim = nominal_half_car(rig)
    road, commands = excitation(seconds, seed)
    states = (car or nominal).simulate(trim.state, commands[:-1], road, 1.0 / RATE)
    return channels_of(states, rig), road, commands


def topics_of_channels(channels: np.ndarray, road: np.ndarray, commands: np.ndarray) -> dict[str, TopicData]:
    """The topics of a contract log that holds these channels."""
    t = np.arange(len(channels)) / RATE
    return {
        "/road/profile": TopicData(t, dict(zip(ROADS, road.T, strict=True)), t + 1e-4),
        "/valve/command": TopicData(t, dict(zip(COMMANDS, commands.T, strict=True)), t + 1e-4),
        "/rig/displacement": TopicData(t, dict(zip(MEASURED[:4], channels[:, :4].T, strict=True)), t + 1e-4),
        "/rig/front/pressure": TopicData(t, {"pressure": channels[:, 4]}, t + 1e-4),
        "/rig/rear/pressure": TopicData(t, {"pressure": channels[:, 5]}, t + 1e-4),
    }


def noisy(channels: np.ndarray, seed: int) -> np.ndarray:
    """Channels with the nominal rig's sensor noise added."""
    noise = np.array([DISPLACEMENT_NOISE] * 4 + [PRESSURE_NOISE] * 2)
    return channels + np.random.default_rng(seed).normal(size=channels.shape) * noise


def topics(seconds: float = 8.0, seed: int = 0) -> dict[str, TopicData]:
    """The topics of a contract log of the nominal rig, with sensor noise."""
    clean, road, commands = simulated(seconds, seed)
    return topics_of_channels(noisy(clean, seed + 1000), road, commands)


def signals_of(
    channels: np.ndarray, road: np.ndarray, commands: np.ndarray, seed: int = 0, name: str = "log"
) -> Signals:
    """Signals of given channels with noise added, as a contract log would give them."""
    return prepare(topics_of_channels(noisy(channels, seed + 2000), road, commands), load_rig(), name)


def write_log(path: Path, channels: np.ndarray, road: np.ndarray, commands: np.ndarray, configs: list[str]) -> Path:
    """A contract log as a file, with any number of configs in it."""
    writer, store = LogWriter(path), get_typestore(Stores.ROS2_JAZZY)
    stamps = [10**18 + k * 2_000_000 for k in range(len(channels))]
    config = writer.add_topic("/rig/config", STRING)
    for k, text in enumerate(configs):
        writer.write(config, bytes(store.serialize_cdr(store.types[STRING](data=text), STRING)), stamps[0] + k)
    tables = {
        ROAD: road, COMMAND: commands, DISPLACEMENT: channels[:, :4], FRONT_PRESSURE: channels[:, 4:5],
        REAR_PRESSURE: channels[:, 5:],
    }  # fmt: skip
    for topic, values in tables.items():
        channel = writer.add_topic(topic.name, topic.type)
        for stamp, row in zip(stamps, values.tolist(), strict=True):
            if topic.type == JOINT:
                data = JointEncoder(topic.frame_id, topic.names).encode(stamp, row)
            else:
                data = PressureEncoder(topic.frame_id, PRESSURE_NOISE**2).encode(stamp, row[0])
            writer.write(channel, data, stamp)
    writer.finish()
    return path
