# SPDX-License-Identifier: Apache-2.0
"""Do the quarter car's orderings depend on what the thesis leaves out? Each is tried with every open number changed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from pneumo_ros.thesis.quarter import Experiment, Outcome, measure
from pneumo_ros.thesis.report import Table
from pneumo_ros.thesis.settings import ThesisSettings
from pneumo_ros.workers import run_in_order

SEEDS = 2
VARIATIONS: dict[str, dict[str, float | str]] = {
    "as stated": {},
    "12.5 kg": {"quarter_mass": 12.5},
    "45 kg": {"quarter_mass": 45.0},
    "outlet 0.003 in2": {"quarter_outlet_in2": 0.003},
    "outlet 0.02 in2": {"quarter_outlet_in2": 0.02},
    "road from 0.25 Hz": {"low_hz": 0.25},
    "road from 1 Hz": {"low_hz": 1.0},
    "road to 5 Hz": {"high_hz": 5.0},
    "no bushing": {"quarter_damping": 0.0},
    "bushing 150": {"quarter_damping": 150.0},
    "road class A": {"iso_class": "A"},
    "0.5 ms": {"period": 0.0005},
}

Outcomes = Mapping[str, Outcome]
SLIDING = ("third_order_integral_smc", "third_order_smc", "third_order_smflc", "first_order_smflc")
ORDERINGS: dict[str, Callable[[Outcomes], bool]] = {
    "pole 50 rides better than 10 (FLC, 6 in2)": lambda o: o["flc 50"].rms_g < o["flc 10"].rms_g,
    "volume 4 in3 raises rms by a fifth or more": lambda o: o["flc volume"].rms_g > 1.2 * o["flc 10"].rms_g,
    "MRFLC within 5 % of FLC": lambda o: abs(o["mrflc"].rms_g / o["flc 10"].rms_g - 1.0) < 0.05,
    "first order SMFLC rides best of its family": lambda o: _least(o, "rms_g") == "first_order_smflc",
    "third order integral SMC overshoots most": lambda o: _most(o, "overshoot_in") == "third_order_integral_smc",
    "third order SMC has the largest offset": lambda o: _most(o, "offset_in") == "third_order_smc",
    "K_s 10000, phi 5 rides better than 1000, 1": lambda o: o["K 10000"].rms_g < o["K 1000"].rms_g,
    "the estimator improves the ride": lambda o: o["bounded"].rms_g < o["K 2000"].rms_g,
    "payload changes rms by less than 5 %": lambda o: abs(o["payload"].rms_g / o["bounded"].rms_g - 1.0) < 0.05,
}


def _least(o: Outcomes, key: str) -> str:
    return min(SLIDING, key=lambda name: getattr(o[name], key))


def _most(o: Outcomes, key: str) -> str:
    return max(SLIDING, key=lambda name: abs(getattr(o[name], key)))


def robustness_table(settings: ThesisSettings, experiments: Mapping[str, Experiment]) -> Table:
    """Yes or no for each ordering under each variation."""
    varied = [replace(settings, seeds=SEEDS, **changes) for changes in VARIATIONS.values()]  # type: ignore[arg-type]
    results = run_in_order(measure, [(s, e) for s in varied for e in experiments.values()])
    size = len(experiments)
    columns = [dict(zip(experiments, results[i * size : (i + 1) * size], strict=True)) for i in range(len(varied))]
    rows = []
    for name, ordering in ORDERINGS.items():
        verdicts = [ordering(outcomes) for outcomes in columns]
        rows.append([name, f"{sum(verdicts)} of {len(verdicts)}", *["yes" if v else "no" for v in verdicts]])
    note = f"{SEEDS} roads each; everything else as stated above"
    return Table(
        "What the orderings owe to the numbers the thesis leaves out", ["ordering", "holds", *VARIATIONS], rows, note
    )
