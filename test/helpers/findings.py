# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis found, made up: for tests of what a person reads of it."""

from __future__ import annotations

from dataclasses import replace

from helpers.rig_logs import signals_of, simulated
from pneumo_ros.diagnosis.half_car.signals import MEASURED
from pneumo_ros.diagnosis.report import Findings
from pneumo_ros.effects.loading import load_library

PLACES = (
    "front_force", "rear_force", "front_air", "rear_air", "front_tyre", "rear_tyre", "body_heave", "body_pitch",
    "road_input", "supply", *(f"sensor:{name}" for name in MEASURED),
)  # fmt: skip

LIBRARY = {
    name: replace(load_library()[name], summary=said)
    for name, said in {
        "leak": "the spring leaks",
        "orifice_coefficient": "an orifice",
        "valve_lag": "a slow valve",
    }.items()
}


def findings(verdict: str = "leak", probability: float = 0.97) -> Findings:
    clean, road, commands = simulated(5.0, 3)
    log = signals_of(clean, road, commands, 3, "held<out>.mcap")
    best = {
        "effects": ["leak"], "side": "front", "sites": ["front"], "probability": probability, "gap_after": 0.01,
        "shrink": 0.975,
        "shrink_ci90": [0.96, 0.99], "parameters": {"leak_area": {"value": 4.1e-7, "std": 2e-9, "unit": "m2"}},
    }  # fmt: skip
    summary = {
        "verdict": verdict, "probability": probability,
        "location": [{"place": "front_air", "share": 0.93}, {"place": "supply", "share": 0.04}],
        "ranking": [best, {**best, "effects": ["supply_droop"], "sites": [""], "side": None, "probability": 0.0,
                           "notes": ["droop ended at its bound"]}],
        "ambiguity_group": ["orifice_coefficient"], "not_testable": {"bump_stop": "the spring never came near it"},
        "next_experiment": {"name": "x", "file": "next_experiment_road.csv", "description": "Open both inlets fully.",
                            "separation": 31.0, "separation_now": 1.2,
                            "command": "pneumo run --road a.csv --valves b.csv"},
        "edit_test": {"log": "heavier.mcap", "changes": {"sprung_mass": 1.1}, "gap_nominal": 1.3, "gap_refit": 0.5,
                      "gap_best": 0.02},
        "gap": {"nominal": 1.2, "refit": 0.4, "best": 0.01, "noise_floor": 0.0034,
                "per_channel": {name: {"nominal": 1.2, "refit": 0.4, "best": 0.01} for name in MEASURED}},
    }  # fmt: skip
    runs = {"nominal": clean + 3 * log.scale, "refit": clean + 0.4 * log.scale, "best": clean}
    return Findings(summary, runs, log, ["fit.mcap"], LIBRARY)
