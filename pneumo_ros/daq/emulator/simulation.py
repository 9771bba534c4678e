# SPDX-License-Identifier: Apache-2.0
"""What hangs on the emulated board: the rig, its sensors through inverse calibration and converters, its valves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.daq.calibration import SENSORS, Calibration
from pneumo_ros.daq.frames import Hello
from pneumo_ros.daq.scaling import input_scale, output_scale
from pneumo_ros.plant.stepping import SteppedRig, plain_rig
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import Rig
from pneumo_ros.road import Road

ROAD_BLOCK = 32  # samples of the road computed at once; a second's worth would make one sample late
NOISE_BLOCK = 4096


@dataclass(frozen=True)
class SimulationSettings:
    """How the emulated hardware behaves beyond the rig itself.

    Attributes
    ----------
    seed : of the noise
    converter_noise : standard deviation of the converter's own noise, counts
    """

    seed: int = 1
    converter_noise: float = 0.5


class RigSimulation:
    """The rig in steps of one sample period.

    Parameters
    ----------
    rig : parameters; starts at trim, which closed valves hold
    road : what the shaker plays once :meth:`start_road` was called; flat before
    hello : ranges and widths of the board's converters
    calibration : of the sensors and valves as they really are
    stepped : the rig with effects, stepped at the board's sample period; the nominal equations of ``rig`` without
    """

    def __init__(
        self,
        rig: Rig,
        road: Road,
        hello: Hello,
        calibration: Calibration,
        settings: SimulationSettings,
        stepped: SteppedRig | None = None,
    ) -> None:
        self.rig, self.hello, self.settings, self.trim = rig, hello, settings, trim(rig)
        self.period = hello.sample_period_us * 1e-6
        self.stepped = plain_rig(rig, self.period) if stepped is None else stepped
        self._state = self.stepped.init()
        self.supply = rig.supply_pressure.value
        self._inputs = input_scale(calibration, hello, rig.ambient_pressure.value)
        self._outputs = output_scale(calibration, hello)
        self._rng = np.random.default_rng(settings.seed)
        self._noise: list[list[float]] = []
        self._std = np.array([rig.displacement_noise.value] * 4 + [rig.pressure_noise.value] * 3)
        self._road, self._block, self._heights = road, -1, np.zeros((ROAD_BLOCK + 1, 2))
        self._road_index: int | None = None
        self._areas = np.zeros(4)

    def write_outputs(self, counts: tuple[int, ...]) -> None:
        """The valves' drive: counts, held until the next; a valve opens from nothing to its largest area."""
        self._areas = np.clip(self._outputs.areas(counts), 0.0, self.rig.inlet_area_max.value)

    def start_road(self) -> None:
        """The road's first height holds at the next sample: the one that will be the first of the armed board."""
        if self._road_index is None:
            self._road_index = -1

    def set_supply(self, pressure: float) -> None:
        """Another supply pressure, Pa absolute, from now on."""
        if pressure != self.supply:
            self.supply = pressure
            self.stepped = self.stepped.with_supply(pressure)

    def advance(self) -> None:
        """One sample period passes."""
        self._state = self.stepped.step(self._state, self._areas, self._road_ends())

    @property
    def state(self) -> NDArray[np.float64]:
        """(10,) of :mod:`pneumo_ros.plant.equations`."""
        return self.stepped.plant_state(self._state)

    def values(self) -> list[float]:
        """Noise-free readings in the order of SENSORS, m and Pa absolute."""
        return [*self.stepped.read(self._state), self.stepped.supply(self._state)]

    def convert(self, values: Sequence[float]) -> tuple[int, ...]:
        """Counts in the board's order: sensor noise, inverse calibration, converter noise, rounding, rails."""
        noise = self._next_noise()
        scale, width, out = self._inputs, len(SENSORS), [0] * len(SENSORS)
        for i in range(width):
            exact = (values[i] + noise[i] - scale.intercepts[i]) / scale.slopes[i] + noise[width + i]
            out[scale.places[i]] = min(max(round(exact), scale.low), scale.high)
        return tuple(out)

    def shifted(self, count: int, channel: str, value: float) -> int:
        """A count as it would be with the sensor off by ``value``, m or Pa."""
        slope = self._inputs.slopes[SENSORS.index(channel)]
        return min(max(count + round(value / slope), self._inputs.low), self._inputs.high)

    def warm_up(self) -> None:
        """Compile what the first period needs, so that it is not late."""
        self.stepped.step(self._state, self._areas, np.zeros((2, 2)))
        self._road.sample(np.zeros(1))

    def rail(self, side: str) -> int:
        """Counts at the converter's end."""
        return self._inputs.high if side == "high" else self._inputs.low

    def place(self, channel: str) -> int:
        """Where a channel's counts are in a sample."""
        return self._inputs.places[SENSORS.index(channel)]

    def _road_ends(self) -> NDArray[np.float64]:
        if self._road_index is None or self._road_index < 0:
            self._road_index = None if self._road_index is None else 0
            return np.zeros((2, 2))
        block, row = divmod(self._road_index, ROAD_BLOCK)
        if block != self._block:
            index = block * ROAD_BLOCK + np.arange(ROAD_BLOCK + 1)
            self._heights, self._block = self._road.sample(index * self.period)[0], block
        self._road_index += 1
        return self._heights[row : row + 2]

    def _next_noise(self) -> list[float]:
        if not self._noise:
            width = len(SENSORS)
            block = self._rng.standard_normal((NOISE_BLOCK, 2 * width))
            block[:, :width] *= self._std
            block[:, width:] *= self.settings.converter_noise
            self._noise = block.tolist()[::-1]
        return self._noise.pop()
