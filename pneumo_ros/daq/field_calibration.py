# SPDX-License-Identifier: Apache-2.0
"""Zero and span at run time: what the readings of a resting rig make of a calibration. Knows no port."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pneumo_ros.daq.calibration import SENSORS, Calibration, units_of
from pneumo_ros.errors import InputError
from pneumo_ros.plant.sensors import read_channels
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import Rig
from pneumo_ros.rig.channels import DISPLACEMENTS

Readings = Mapping[str, tuple[float, float]]  # sensor -> (mean, standard deviation), SI
REST = {"displacement": 1e-4, "pressure": 2e3}  # m and Pa: standard deviation above which the rig is not at rest
SPREAD = 20.0  # standard deviations that zero and span point must be apart


@dataclass(frozen=True)
class Point:
    """A sensor's voltage at a known value (m or Pa absolute)."""

    volts: float
    reference: float


def references(what: str, rig: Rig) -> dict[str, float]:
    """Known values of a resting rig, SI.

    Parameters
    ----------
    what : "displacement": levelled at design height on a flat road; "pressure": springs and supply vented
    rig : parameters
    """
    if what == "pressure":
        return dict.fromkeys(SENSORS[4:], rig.ambient_pressure.value)
    levelled = read_channels(trim(rig).state, rig.front_arm.value, rig.rear_arm.value)
    return {channel: float(value) for channel, value in zip(DISPLACEMENTS, levelled[:4], strict=True)}


def zero(calibration: Calibration, readings: Readings, what: str, rig: Rig) -> tuple[Calibration, dict[str, Point]]:
    """Shift the sensors of one kind to their known values.

    Returns
    -------
    the shifted calibration and each sensor's zero point, which a later span needs

    Raises
    ------
    InputError
        if a sensor is not at rest.
    """
    known = references(what, rig)
    for channel in known:
        _at_rest(channel, readings)
    ambient = rig.ambient_pressure.value
    points = {
        channel: Point(calibration.sensors[channel].volts(readings[channel][0], ambient), reference)
        for channel, reference in known.items()
    }
    return calibration.zeroed({channel: readings[channel][0] for channel in known}, known), points


def span(
    calibration: Calibration, readings: Readings, channel: str, reference: float, zero_point: Point | None, rig: Rig,
    date: str,
) -> Calibration:  # fmt: skip
    """The line of one sensor through its zero point and the present reading at a known value (SI).

    Raises
    ------
    InputError
        without a zero point, not at rest, or too close to the zero point.
    """
    if channel not in SENSORS:
        raise InputError("unknown channel", where="span", value=channel, allowed=", ".join(SENSORS))
    if zero_point is None:
        raise InputError("no zero point yet", where="span", key=channel, remedy="set zero first")
    mean, std = _at_rest(channel, readings)
    sensor, ambient = calibration.sensors[channel], rig.ambient_pressure.value
    volts = sensor.volts(mean, ambient)
    scatter = std / abs(sensor.gain * units_of(channel)[sensor.unit])
    if abs(volts - zero_point.volts) <= SPREAD * scatter or reference == zero_point.reference:
        raise InputError(
            "too close to the zero point", where="span", key=channel, value=reference,
            allowed=f"a reading at least {SPREAD:g} standard deviations away", remedy="move the sensor further",
        )  # fmt: skip
    return calibration.spanned(channel, (zero_point.volts, zero_point.reference), (volts, reference), ambient, date)


def _at_rest(channel: str, readings: Readings) -> tuple[float, float]:
    mean, std = readings[channel]
    limit = REST["pressure" if channel.endswith("pressure") else "displacement"]
    if std > limit:
        raise InputError("not at rest", where="calibration", key=channel, value=std, allowed=f"at most {limit:g} (SI)")
    return mean, std
