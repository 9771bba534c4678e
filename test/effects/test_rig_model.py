# SPDX-License-Identifier: Apache-2.0
"""What of a simulation is kept for the next one, and when it is not."""

from __future__ import annotations

import numpy as np
from helpers.own_logs import driven
from helpers.rig_logs import excitation, signals_of

from pneumo_ros.diagnosis.fit.problem import COARSE_BELOW
from pneumo_ros.effects.nuisance import COMMAND_DELAY
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import COARSEST, DRIVEN, FIT_STEP, RigModel
from pneumo_ros.plant.integrator import substeps
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import load_rig


def test_what_commands_come_to_is_kept_only_for_the_same_log_delay_and_effects() -> None:
    used = RigModel(load_rig())
    road, commands = excitation(3.0, 1)
    state = trim(used.rig).state
    clean = used.simulate(driven(road, commands), None, state)
    logs = [signals_of(clean, road, commands, 1, "steps"), signals_of(clean, road[::-1].copy(), commands, 1, "back")]
    nominal = np.array([p.nominal for p in used.parameters])
    late = nominal + 2e-3 * (np.array([p.name for p in used.parameters]) == COMMAND_DELAY)
    lags = [(), (Active("valve_lag", "front", (0.02, 0.5)),), (Active("valve_lag", "front", (0.03, 0.5)),)]
    asked = [(log, values, lag) for log in logs for values in (nominal, late) for lag in lags]
    expected = [RigModel(load_rig()).predict(log, values, state, lag) for log, values, lag in asked]
    assert len({one.tobytes() for one in expected}) == len(asked)
    for log, values, lag in asked * (2 + DRIVEN // len(asked)):  # more often than it keeps
        (wanted,) = (e for e, (a, b, c) in zip(expected, asked, strict=True) if a is log and b is values and c == lag)
        assert np.array_equal(used.predict(log, values, state, lag), wanted)


def test_a_log_that_is_halved_by_a_clock_that_runs_slow_still_takes_one_step_a_row() -> None:
    # Three of the finer steps a row would make the coarse log dearer than the whole one.
    assert FIT_STEP * 1.002 < COARSE_BELOW and substeps(2.0 * COARSE_BELOW, COARSEST) == 1
