# SPDX-License-Identifier: Apache-2.0
"""What is doubtful about a calibration: one count against the motion, twins that disagree, ranges that do not fit.

The thesis's Eq. C.1 is the case in point (docs/errata.md 12): at 16 bit over +-10 V one count is 0.032 in, the size
of the motion itself, and it is a hundred times as sensitive as its twin.
"""

from __future__ import annotations

from dataclasses import dataclass

from pneumo_ros.daq.calibration import SENSORS, Calibration
from pneumo_ros.daq.frames import Hello
from pneumo_ros.daq.scaling import input_step, output_step, volts_range
from pneumo_ros.rig.channels import VALVES
from pneumo_ros.units import ATMOSPHERE, INCH, PSI

STROKE = 1.0 * INCH  # m, heights 1.2 to 2.2 in of the effective area table
PRESSURE_SPAN = 100.0 * PSI  # Pa, the transducers' range (Appendix C)
FINEST_SHARE = 1e-3  # one count must not be more than this share of stroke or span
TWIN_RATIO = 5.0  # gains of sensors of one kind may differ by so much
REACH = {"displacement": (-1.5 * INCH, 3.0 * INCH), "pressure": (ATMOSPHERE, ATMOSPHERE + PRESSURE_SPAN)}


@dataclass(frozen=True)
class Finding:
    """One doubt about one channel."""

    channel: str
    code: str
    text: str


def kind_of(channel: str) -> str:
    """ "displacement" or "pressure"."""
    return "pressure" if channel.endswith("pressure") else "displacement"


def check_calibration(calibration: Calibration, hello: Hello, ambient: float = ATMOSPHERE) -> list[Finding]:
    """All doubts about ``calibration`` on a board that says ``hello``; empty if there are none."""
    return [
        *_resolutions(calibration, hello),
        *_twins(calibration),
        *_reaches(calibration, hello, ambient),
        *_valve_reaches(calibration, hello),
    ]


def resolution(calibration: Calibration, hello: Hello, channel: str) -> float:
    """What one count is worth, m or Pa."""
    sensor = calibration.sensors[channel]
    return abs(sensor.gain * sensor.factor) * input_step(hello, SENSORS.index(channel))


def _resolutions(calibration: Calibration, hello: Hello) -> list[Finding]:
    found = []
    for channel in SENSORS:
        span, unit, scale = (STROKE, "mm", 1e3) if kind_of(channel) == "displacement" else (PRESSURE_SPAN, "Pa", 1.0)
        step = resolution(calibration, hello, channel)
        if step > FINEST_SHARE * span:
            text = (
                f"one count is {step * scale:.3g} {unit}, {step / span:.1%} of {span * scale:.4g} {unit}; "
                f"{calibration.sensors[channel].source or 'no source given'}"
            )
            found.append(Finding(channel, "resolution", text))
    return found


def _twins(calibration: Calibration) -> list[Finding]:
    lvdts = {name: abs(c.gain * c.factor) for name, c in calibration.sensors.items() if kind_of(name) == "displacement"}
    finest = min(lvdts.values())
    return [
        Finding(name, "twin", f"{gain / finest:.0f} times the volts-to-motion gain of the finest displacement sensor")
        for name, gain in lvdts.items()
        if gain > TWIN_RATIO * finest
    ]


def _reaches(calibration: Calibration, hello: Hello, ambient: float) -> list[Finding]:
    found = []
    for index, channel in enumerate(SENSORS):
        low, high = volts_range(hello.inputs, index)
        for value in REACH[kind_of(channel)]:
            volts = calibration.sensors[channel].volts(value, ambient)
            if not low <= volts <= high:
                text = f"{value:.4g} (SI) would be {volts:.3g} V, outside {low:g} to {high:g} V: the channel would rail"
                found.append(Finding(channel, "reach", text))
                break
    return found


def _valve_reaches(calibration: Calibration, hello: Hello) -> list[Finding]:
    found = []
    for index, name in enumerate(VALVES):
        low, high = volts_range(hello.outputs, index)
        volts = calibration.valves[name].volts(0.0)
        if not low - output_step(hello, index) <= volts <= high:
            found.append(Finding(name, "valve", f"closed would be {volts:.3g} V, outside {low:g} to {high:g} V"))
    return found
