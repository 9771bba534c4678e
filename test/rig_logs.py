"""Simulated logs for the tests of the diagnosis: the nominal rig, driven over a road with its valves moving."""

from __future__ import annotations

import numpy as np

from pneumo_ros.gap.signals import COMMANDS, MEASURED, ROADS, Signals, TopicData, prepare
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


def topics(seconds: float = 8.0, seed: int = 0) -> dict[str, TopicData]:
    """The topics of a contract log of the nominal rig, with sensor noise."""
    clean, road, commands = simulated(seconds, seed)
    rng = np.random.default_rng(seed + 1000)
    noise = np.array([DISPLACEMENT_NOISE] * 4 + [PRESSURE_NOISE] * 2)
    y = clean + rng.normal(size=clean.shape) * noise
    t = np.arange(len(y)) / RATE
    return {
        "/road/profile": TopicData(t, dict(zip(ROADS, road.T, strict=True)), t + 1e-4),
        "/valve/command": TopicData(t, dict(zip(COMMANDS, commands.T, strict=True)), t + 1e-4),
        "/rig/displacement": TopicData(t, dict(zip(MEASURED[:4], y[:, :4].T, strict=True)), t + 1e-4),
        "/rig/front/pressure": TopicData(t, {"pressure": y[:, 4]}, t + 1e-4),
        "/rig/rear/pressure": TopicData(t, {"pressure": y[:, 5]}, t + 1e-4),
    }


def signals_of(
    channels: np.ndarray, road: np.ndarray, commands: np.ndarray, seed: int = 0, name: str = "log"
) -> Signals:
    """Signals of given channels with noise added, as a contract log would give them."""
    rng = np.random.default_rng(seed + 2000)
    noise = np.array([DISPLACEMENT_NOISE] * 4 + [PRESSURE_NOISE] * 2)
    y = channels + rng.normal(size=channels.shape) * noise
    t = np.arange(len(y)) / RATE
    parts = {
        "/road/profile": TopicData(t, dict(zip(ROADS, road.T, strict=True))),
        "/valve/command": TopicData(t, dict(zip(COMMANDS, commands.T, strict=True))),
        "/rig/displacement": TopicData(t, dict(zip(MEASURED[:4], y[:, :4].T, strict=True))),
        "/rig/front/pressure": TopicData(t, {"pressure": y[:, 4]}),
        "/rig/rear/pressure": TopicData(t, {"pressure": y[:, 5]}),
    }
    return prepare(parts, load_rig(), name)
