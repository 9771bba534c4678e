# SPDX-License-Identifier: Apache-2.0
"""Settings that belong together: estimator and controller values of each way to run the half car.

``default`` is what a session starts with; ``thesis`` is Section 6.7.5 as printed; the last two go beyond it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from pneumo_ros.parameters import Value

_SURFACE: dict[str, Value] = {"known_surface": True, "acceleration_from_pressure": True, "forgetting": 5.0}


@dataclass(frozen=True)
class Preset:
    """Values over the defaults of :mod:`pneumo_ros.estimation.half_car` and :mod:`pneumo_ros.control.half_car`."""

    meaning: str
    estimator: dict[str, Value] = field(default_factory=dict)
    controller: dict[str, Value] = field(default_factory=dict)


PRESETS: dict[str, Preset] = {
    "passive": Preset("valves at trim", controller={"controller": "passive"}),
    "default": Preset("first order SMFLC with estimator, gains for 500 Hz and real sensors"),
    "thesis": Preset(
        "first order SMFLC with estimator, gains of Section 6.7.5",
        controller={"sliding_heave_in_s3": 20000.0, "area_floor_in2": 0.0},
    ),
    "area_rate_feedforward": Preset(
        "a quarter of dA/dt of the known surface fed forward; one valve cannot empty the spring fast enough for more",
        _SURFACE,
        {"controller": "area_rate_feedforward", "area_rate_share": 0.25, "pole": 14.0, "follow_axles": True},
    ),
    "two_valve": Preset(
        "dA/dt of the known surface fed forward and the outlets commanded as well",
        _SURFACE,
        {
            "controller": "two_valve",
            "area_rate_share": 0.7,
            "pole": 12.0,
            "sliding_heave_in_s3": 1000.0,
            "follow_axles": True,
        },
    ),
}


def controller_settings(name: str) -> list[tuple[str, str, Value]]:
    """(node, parameter, value) of a preset, for estimator and controller; any other name is a member of the controller
    family with its defaults."""
    if name not in PRESETS:
        return [("controller", "controller", name)]
    preset = PRESETS[name]
    own = {"controller": "first_order_smflc", **preset.controller}
    return [
        *(("estimator", key, value) for key, value in preset.estimator.items()),
        *(("controller", key, value) for key, value in own.items()),
    ]
