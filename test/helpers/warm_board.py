# SPDX-License-Identifier: Apache-2.0
"""Importing this loads all that an emulated board runs, compiled code too: boards forked off it begin at once."""

from __future__ import annotations

import helpers.emulators  # noqa: F401
import pneumo_ros.cli.emulate
import pneumo_ros.daq.emulator.emulator  # noqa: F401
from pneumo_ros.daq.calibration_file import load_calibration
from pneumo_ros.daq.emulator.board import board_identity
from pneumo_ros.daq.emulator.simulation import RigSimulation, SimulationSettings
from pneumo_ros.effects.stepping import stepped_rig
from pneumo_ros.rig import load_rig
from pneumo_ros.road import build_road

rig, board = load_rig(), board_identity()
RigSimulation(
    rig, build_road({}, wheelbase=rig.wheelbase), board, load_calibration("appendix_c"), SimulationSettings(),
    stepped_rig(rig, board.sample_period_us * 1e-6),
).warm_up()  # fmt: skip
