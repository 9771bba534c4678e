# SPDX-License-Identifier: Apache-2.0
"""Counts to volts and back, and the two maps the driver needs ready-made: counts to SI, areas to counts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from pneumo_ros.daq.calibration import SENSORS, Calibration
from pneumo_ros.daq.frames import INPUT_COUNT, OUTPUT_COUNT, Hello, InputRange, OutputRange
from pneumo_ros.errors import InputError
from pneumo_ros.rig.channels import VALVES

MICRO = 1e-6


def volts_range(entries: Sequence[InputRange] | Sequence[OutputRange], number: int) -> tuple[float, float]:
    """Range of the entry for channel or valve ``number``, V."""
    entry = entries[place_of(entries, number)]
    return entry.min_uv * MICRO, entry.max_uv * MICRO


def place_of(entries: Sequence[InputRange] | Sequence[OutputRange], number: int) -> int:
    """Where channel or valve ``number`` is on this board."""
    return next(place for place, entry in enumerate(entries) if entry[0] == number)


def input_step(hello: Hello, channel: int) -> float:
    """Volts of one count of an input."""
    low, high = volts_range(hello.inputs, channel)
    return (high - low) / (1 << hello.adc_bits)


def output_step(hello: Hello, valve: int) -> float:
    """Volts of one count of an output."""
    low, high = volts_range(hello.outputs, valve)
    return (high - low) / ((1 << hello.dac_bits) - 1)


def check_map(hello: Hello) -> None:
    """Refuse a board whose channel map is not one of each.

    Raises
    ------
    InputError
        naming the board and what is wrong with its map.
    """
    where = f"board {hello.serial_number or '?'}"
    for entries, count, what in ((hello.inputs, INPUT_COUNT, "input"), (hello.outputs, OUTPUT_COUNT, "output")):
        numbers = sorted(entry[0] for entry in entries)
        if numbers != list(range(count)):
            raise InputError(
                f"its {what} map is not one of each", where=where, value=numbers, allowed=f"0 to {count - 1}"
            )
        if any(entry.min_uv >= entry.max_uv for entry in entries):
            raise InputError(f"an {what} has an empty range", where=where, remedy="mend the firmware's tables")


class InputScale(NamedTuple):
    """Raw counts of one board to SI, channel by channel in the order of SENSORS.

    ``places`` says where on the board each channel is; ``low`` and ``high`` are the rail counts.
    """

    places: tuple[int, ...]
    slopes: tuple[float, ...]
    intercepts: tuple[float, ...]
    low: int
    high: int

    def ordered(self, counts: Sequence[int]) -> tuple[int, ...]:
        """Counts as they came, in the order of SENSORS."""
        return tuple([counts[place] for place in self.places])

    def values(self, ordered: Sequence[int]) -> tuple[float, ...]:
        """SI values, m and Pa absolute, of counts in the order of SENSORS."""
        return tuple([s * c + i for c, s, i in zip(ordered, self.slopes, self.intercepts, strict=True)])


def input_scale(calibration: Calibration, hello: Hello, ambient: float) -> InputScale:
    """The map of a board; ``ambient`` pressure in Pa."""
    slopes, intercepts = [], []
    for number, name in enumerate(SENSORS):
        slope, intercept = calibration.sensors[name].line(ambient)
        low, high = volts_range(hello.inputs, number)
        slopes.append(slope * input_step(hello, number))
        intercepts.append(intercept + slope * 0.5 * (low + high))
    half = 1 << (hello.adc_bits - 1)
    places = tuple(place_of(hello.inputs, number) for number in range(INPUT_COUNT))
    return InputScale(places, tuple(slopes), tuple(intercepts), -half, half - 1)


class OutputScale(NamedTuple):
    """Areas in the order of VALVES to a board's DAC counts and back."""

    places: tuple[int, ...]
    gains: tuple[float, ...]
    offsets: tuple[float, ...]
    top: int

    def counts(self, areas: Sequence[float]) -> tuple[int, ...]:
        """DAC counts in the board's order for areas, m2, clipped to what the DAC can say."""
        out = [0] * len(self.places)
        for area, place, gain, offset in zip(areas, self.places, self.gains, self.offsets, strict=True):
            out[place] = min(max(round(area * gain + offset), 0), self.top)
        return tuple(out)

    def areas(self, counts: Sequence[int]) -> tuple[float, ...]:
        """Areas, m2, in the order of VALVES that counts stand for."""
        return tuple((counts[p] - o) / g for p, g, o in zip(self.places, self.gains, self.offsets, strict=True))


def output_scale(calibration: Calibration, hello: Hello) -> OutputScale:
    """The map of a board's valves."""
    gains, offsets = [], []
    for number, name in enumerate(VALVES):
        valve = calibration.valves[name]
        low, _ = volts_range(hello.outputs, number)
        step = output_step(hello, number)
        closed = valve.volts(0.0)
        gains.append((valve.volts(1e-6) - closed) / 1e-6 / step)
        offsets.append((closed - low) / step)
    places = tuple(place_of(hello.outputs, number) for number in range(OUTPUT_COUNT))
    return OutputScale(places, tuple(gains), tuple(offsets), (1 << hello.dac_bits) - 1)
