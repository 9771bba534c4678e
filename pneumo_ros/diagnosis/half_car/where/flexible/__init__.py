# SPDX-License-Identifier: Apache-2.0
"""Flexible corrections: what each place could add to the model, in general shapes rather than named effects.

A place's shapes are smooth and saturating functions of the local motion, memory of several lengths, flow and opening.
They are wide enough to follow friction, lag, leaks, hysteresis, wrong stiffness or scale without knowing which it is.
"""

from pneumo_ros.diagnosis.half_car.where.features import Features
from pneumo_ros.diagnosis.half_car.where.flexible.air import air_bases
from pneumo_ros.diagnosis.half_car.where.flexible.basis import KINDS as KINDS
from pneumo_ros.diagnosis.half_car.where.flexible.basis import Basis as Basis
from pneumo_ros.diagnosis.half_car.where.flexible.body import body_bases
from pneumo_ros.diagnosis.half_car.where.flexible.force import force_bases
from pneumo_ros.diagnosis.half_car.where.flexible.inputs import road_bases, supply_bases
from pneumo_ros.diagnosis.half_car.where.flexible.sensor import sensor_bases
from pneumo_ros.diagnosis.half_car.where.flexible.tyre import tyre_bases


def all_bases(features: Features) -> list[Basis]:
    """Every shape of every place, in the same order for every log."""
    out: list[Basis] = []
    for i in (0, 1):
        out += [*force_bases(features, i), *air_bases(features, i), *tyre_bases(features, i)]
    return [*out, *body_bases(features), *road_bases(features), *supply_bases(features), *sensor_bases(features)]
