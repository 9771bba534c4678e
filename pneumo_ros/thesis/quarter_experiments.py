# SPDX-License-Identifier: Apache-2.0
"""The quarter-car experiments of Sections 6.3 to 6.6, by name."""

from __future__ import annotations

from pneumo_ros.thesis.quarter import Experiment

POLES = (2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0)  # 1/s
AREAS_IN2 = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)  # Section 6.3: estimated by a constant in 1 to 6 in2

CONSTANT: dict[str, float | str] = {"area_in2": 6.0, "volume_in3": 4.0}  # Figure 6.15
UNCERTAIN: dict[str, float | str] = {"volume_in3": 4.0, "height_error_in": 0.4}  # Figures 6.16 to 6.25
K2000: dict[str, float | str] = {**UNCERTAIN, "sliding_in_s3": 2000.0, "layer_in_s": 2.0}

EXPERIMENTS: dict[str, Experiment] = {
    "passive": Experiment("passive"),
    "flc 10": Experiment("flc", options={"area_in2": 6.0}),
    "flc 50": Experiment("flc", options={"area_in2": 6.0, "pole": 50.0}),
    "flc volume": Experiment("flc", options=CONSTANT),
    "mrflc": Experiment("mrflc", options={"area_in2": 6.0}),
    "third_order_integral_smc": Experiment("third_order_integral_smc", options=CONSTANT),
    "third_order_smc": Experiment("third_order_smc", options=CONSTANT),
    "third_order_smflc": Experiment("third_order_smflc", options=CONSTANT),
    "first_order_smflc": Experiment("first_order_smflc", options=CONSTANT),
    "K 1000": Experiment("first_order_smflc", options={**UNCERTAIN, "area_in2": 6.0}),
    "K 10000": Experiment(
        "first_order_smflc", options={**UNCERTAIN, "area_in2": 6.0, "sliding_in_s3": 10000.0, "layer_in_s": 5.0}
    ),
    "K 2000": Experiment("first_order_smflc", options={**K2000, "area_in2": 6.0}),
    "bounded": Experiment("first_order_smflc", options=K2000),
    "exponential": Experiment("first_order_smflc", options={**K2000, "method": "exponential"}),
    "least_squares": Experiment("first_order_smflc", options={**K2000, "method": "least_squares"}),
    "gradient": Experiment("first_order_smflc", options={**K2000, "method": "gradient"}),
    "payload": Experiment("first_order_smflc", options={**K2000, "mass_scale": 2.0}),
}
CURVES: dict[str, tuple[str, bool, dict[str, float | str]]] = {
    "Figure 6.4: FLC, cylinder": ("flc", True, {}),
    "Figure 6.6: FLC, air spring": ("flc", False, {}),
    "Figure 6.13: MRFLC, air spring": ("mrflc", False, {}),
    "Figure 6.16: first order SMFLC, K 10000": (
        "first_order_smflc",
        False,
        {**UNCERTAIN, "sliding_in_s3": 10000.0, "layer_in_s": 5.0},
    ),
}
ESTIMATED = "Figure 6.23: first order SMFLC with estimator"

PAIRS = {
    "Figure 6.9: gain": ("flc 10", "flc 50"),
    "Figure 6.11: volume": ("flc 10", "flc volume"),
    "Figure 6.14: reference": ("flc 10", "mrflc"),
    "Figure 6.18: K_s, phi": ("K 1000", "K 10000"),
    "Figure 6.20: estimator": ("K 2000", "bounded"),
    "Figure 6.24: payload": ("bounded", "payload"),
}
