# SPDX-License-Identifier: Apache-2.0
"""The driver's decisions, step by step in simulated time: core, board rules and plant, no port and no thread."""

from __future__ import annotations

import argparse
import math
import random
from collections.abc import Callable
from dataclasses import replace

import pytest
from helpers.folders import DOCS
from helpers.simulated_rig import MS, RIG, SAFE, START, Bench
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumo_ros.daq.actuation import Mode
from pneumo_ros.daq.calibration_file import load_calibration
from pneumo_ros.daq.core import DriverCore
from pneumo_ros.daq.emulator.board import board_identity
from pneumo_ros.daq.emulator.device import Device
from pneumo_ros.daq.frames import DeviceState, OutputRange, encode
from pneumo_ros.daq.intake import Measurement
from pneumo_ros.daq.limits import LimitMonitor
from pneumo_ros.daq.link import Phase
from pneumo_ros.daq.reasons import Reason
from pneumo_ros.daq.safety_config import MEASURED, Limit, load_safety


def test_handshake_arming_and_a_bumpless_start() -> None:
    bench = Bench()
    assert "the board has not been watched for long enough" in " ".join(bench.run(5).core.blockers(bench.now))
    bench.armed()
    driven = [counts for _, counts in bench.outputs if counts != SAFE]
    trim = bench.core.actuation.scale.counts(bench.simulation.trim.command)  # type: ignore[union-attr]
    steps = [abs(b[0] - a[0]) for a, b in zip([SAFE, *driven], driven, strict=False)]
    assert driven[-1] == trim and max(steps) < 0.05 * trim[0]  # ramped over 0.2 s, 100 commands
    assert bench.reasons()[:2] == [Reason.LINK_OPEN, Reason.ARMED]


def test_nothing_arms_without_supply() -> None:
    bench = Bench()
    bench.simulation.set_supply(2e5)
    bench.run(1500)
    assert any("supply" in why for why in bench.core.arm(bench.now))
    assert bench.run(100).device.state is DeviceState.SAFE


BAD_COMMANDS = {
    "nan": [math.nan, 1e-6, 1e-6, 1e-6],
    "infinite": [1e-6, math.inf, 1e-6, 1e-6],
    "negative": [1e-6, -1e-9, 1e-6, 1e-6],
    "too large": [1e-6, 1e-6, 2e-5, 1e-6],
}


@pytest.mark.parametrize("areas", BAD_COMMANDS.values(), ids=BAD_COMMANDS.keys())
def test_commands_that_cannot_be_never_reach_the_valves(areas: list[float]) -> None:
    bench = Bench().armed()
    before, count = bench.now, len(bench.outputs)
    bench.controller = lambda item: bench.core.command(areas, item.stamp_ns, bench.now)
    bench.run(100)
    trim = bench.core.actuation.scale.counts(bench.simulation.trim.command)  # type: ignore[union-attr]
    assert all(counts in (SAFE, trim) for _, counts in bench.outputs[count:])
    assert bench.safe_after(before) < 50
    assert {Reason.COMMAND_INVALID, Reason.COMMAND_STALE} <= set(bench.reasons())
    bench.controller = bench.hold_trim
    bench.refuses_to_move_until_armed()


@pytest.mark.parametrize("case", ["stale", "repeated"])
def test_stale_and_repeated_commands_never_reach_the_valves(case: str) -> None:
    bench = Bench().armed()
    before, count, frozen = bench.now, len(bench.outputs), bench.core.actuation._last_stamp

    def controller(item: Measurement) -> None:
        stamp = item.stamp_ns - 31 * MS if case == "stale" else frozen
        bench.core.command([1e-6] * 4, stamp, bench.now)

    bench.controller = controller
    bench.run(100)
    assert all(counts == SAFE for _, counts in bench.outputs[count:])
    assert bench.safe_after(before) < 50 and Reason.COMMAND_STALE in bench.reasons()


def test_a_silent_controller_trips_the_driver() -> None:
    bench = Bench().armed()
    before, bench.controller = bench.now, None
    bench.run(100)
    assert 28 <= bench.safe_after(before) < 36
    assert bench.reasons()[-1] is Reason.COMMAND_STALE and bench.core.mode is Mode.SAFE


def test_a_dead_driver_trips_the_firmware_and_is_told() -> None:
    bench = Bench().armed()
    before = bench.now
    bench.down = lambda data: b""
    bench.run(100)
    assert 38 <= bench.safe_after(before) <= 42
    assert Reason.BOARD_WATCHDOG in bench.reasons()
    bench.down = lambda data: data
    bench.refuses_to_move_until_armed()
    assert bench.core.arm(bench.now) == []
    assert bench.run(200).core.mode is Mode.ARMED


def test_a_silent_board_trips_and_the_link_comes_back_unarmed() -> None:
    bench = Bench().armed()
    before, bench.up = bench.now, lambda data: b""
    bench.run(1000)
    assert bench.safe_after(before) < 50 and Reason.SAMPLES_STALE in bench.reasons()
    assert bench.core.phase is Phase.HANDSHAKE
    bench.up = lambda data: data
    bench.refuses_to_move_until_armed()
    assert bench.core.phase is Phase.RUNNING and bench.reasons().count(Reason.LINK_OPEN) == 2


def test_stamps_survive_a_stall_and_a_new_handshake() -> None:
    """Everything held back for 0.8 s comes at once: the stamps are those of the samples, not of their arrival."""
    bench, held = Bench().run(1500), bytearray()
    count = len(bench.measurements)
    bench.up = lambda data: (held.extend(data), b"")[1]
    bench.run(800)
    assert bench.core.phase is Phase.HANDSHAKE
    bench.up = lambda data: data
    bench.to_host[:0] = held
    bench.run(300)
    late = bench.measurements[count:]
    assert len(late) > 200
    true = [START + (m.sequence + 1) * MS for m in late]
    assert max(abs(m.stamp_ns - t) for m, t in zip(late, true, strict=True)) < MS / 2


def test_a_board_that_restarts_is_met_again_and_not_armed() -> None:
    bench = Bench().armed()
    before = bench.now
    bench.hello = bench.hello._replace(boot_id=99)
    bench.boot()
    bench.run(20)
    assert bench.safe_after(before) <= 1 and Reason.BOARD_RESET in bench.reasons()
    bench.refuses_to_move_until_armed()
    assert bench.core.phase is Phase.RUNNING


def test_a_board_that_counts_its_boots_wrongly_gets_a_new_clock() -> None:
    """Unplugged, started again and the same boot id: its clock is behind, which is no wrap of 71 minutes."""
    bench = Bench().armed()
    bench.core.closed("unplugged", bench.now)
    bench.now += 800 * MS
    bench.zero = bench.now
    bench.boot()
    bench.core.opened(bench.now)
    count = len(bench.measurements)
    bench.refuses_to_move_until_armed()
    assert bench.core.phase is Phase.RUNNING
    fresh = bench.measurements[count:]
    assert len(fresh) > 1000 and max(abs(m.stamp_ns - m.arrival_ns) for m in fresh) < MS


def test_a_restart_whose_announcement_is_lost_is_noticed() -> None:
    bench = Bench().armed()
    bench.to_host.clear()
    bench.hello = bench.hello._replace(boot_id=99)
    bench.boot()
    bench.to_host.clear()
    bench.run(400)
    assert Reason.BOARD_RESET in bench.reasons() and Reason.LINK_SHARED in bench.reasons()
    assert bench.core.intake is not None and bench.core.intake.hello.boot_id == 99


def test_emergency_stop_is_latched_and_reset_only_with_healthy_inputs() -> None:
    bench = Bench().armed()
    before = bench.now
    bench.core.estop("operator", bench.now)
    bench.run(5)
    assert bench.safe_after(before) <= 1 and bench.device.state is DeviceState.ESTOP
    assert bench.core.arm(bench.now)
    bench.refuses_to_move_until_armed()
    bench.spoil = lambda counts: counts.__setitem__(0, 32767)  # a sensor at the rail
    assert bench.run(50).core.reset(bench.now)
    bench.spoil = lambda counts: None
    assert bench.run(100).core.reset(bench.now)  # not healthy for long enough
    assert bench.run(1000).core.reset(bench.now) == []
    bench.run(50)
    assert bench.core.mode is Mode.SAFE and bench.device.state is DeviceState.SAFE
    bench.refuses_to_move_until_armed()
    assert bench.core.arm(bench.now) == []


def test_the_boards_own_button_stops_and_must_be_released() -> None:
    bench = Bench().armed()
    before, bench.pressed = bench.now, True
    bench.run(1000)
    assert bench.safe_after(before) <= 1 and bench.core.mode is Mode.ESTOP
    assert bench.core.reset(bench.now)
    bench.pressed = False
    bench.run(1000)
    assert bench.core.mode is Mode.ESTOP
    assert bench.core.reset(bench.now) == []
    assert bench.run(50).core.mode is Mode.SAFE


def test_an_emergency_stop_outlives_a_lost_link() -> None:
    bench = Bench().armed()
    bench.core.estop("operator", bench.now)
    bench.core.closed("unplugged", bench.now)
    assert bench.core.reset(bench.now)
    bench.run(100).core.opened(bench.now)
    bench.run(1200)
    assert bench.core.mode is Mode.ESTOP and bench.device.state is DeviceState.ESTOP


def stuck(bench: Bench) -> Callable[[list[int]], None]:
    held = bench.measurements[-1].counts[1]
    return lambda counts: counts.__setitem__(1, held)


SPOILED: dict[str, tuple[Callable[[Bench], Callable[[list[int]], None]], Reason]] = {
    "rail": (lambda bench: lambda counts: counts.__setitem__(4, 32767), Reason.SENSOR_RAIL),
    "range": (lambda bench: lambda counts: counts.__setitem__(0, -20000), Reason.SENSOR_RANGE),
    "rate": (lambda bench: lambda counts: counts.__setitem__(2, counts[2] + 4000), Reason.SENSOR_RATE),
    "stuck": (stuck, Reason.SENSOR_STUCK),
}


@pytest.mark.parametrize(("spoil", "reason"), SPOILED.values(), ids=SPOILED.keys())
def test_a_sensor_that_cannot_be_believed_trips_and_is_withheld(
    spoil: Callable[[Bench], Callable[[list[int]], None]], reason: Reason
) -> None:
    bench = Bench().armed()
    before, count = bench.now, len(bench.measurements)
    bench.spoil = spoil(bench)
    bench.run(100)
    assert bench.safe_after(before) < 50 and reason in bench.reasons()
    late = bench.measurements[count + 30 : count + 40] if reason is Reason.SENSOR_STUCK else bench.measurements[count:]
    assert not any(m.usable for m in late[:5])
    bench.refuses_to_move_until_armed()


def test_displacement_and_pressure_must_agree_about_the_load() -> None:
    bench = Bench().armed()
    shift = round(1.2e5 / abs(bench.core.intake.scale.slopes[4]))  # type: ignore[union-attr]
    ramp = iter(range(10**6))
    bench.spoil = lambda counts: counts.__setitem__(4, counts[4] + min(shift, next(ramp)))
    bench.run(6000)
    assert Reason.SENSOR_DISAGREE in bench.reasons() and bench.core.mode is Mode.SAFE


def test_a_converter_that_fails_trips() -> None:
    bench = Bench().armed()
    before, bench.converter_fails = bench.now, True
    count = len(bench.measurements)
    bench.run(50)
    assert bench.safe_after(before) < 50 and len(bench.measurements) == count
    assert Reason.CONVERTER in bench.reasons()


@pytest.mark.parametrize("estop", [False, True])
def test_limits_warn_then_trip_after_their_persistence(estop: bool) -> None:
    safety = load_safety()
    limit = Limit(1e5, 4.5e5, 1e5, 5.0e5, 0.02, estop)
    bench = Bench(safety=replace(safety, limits={**safety.limits, "rear_pressure": limit})).armed()
    bench.controller = lambda item: bench.core.command([1e-6, 1.6e-5, 0.0, 0.0], item.stamp_ns, bench.now)
    count = len(bench.measurements)
    bench.run(1000)
    told = bench.reasons()
    assert told.index(Reason.LIMIT_WARN) < told.index(Reason.LIMIT_TRIP) and told.count(Reason.LIMIT_TRIP) == 1
    assert bench.core.mode is (Mode.ESTOP if estop else Mode.SAFE)
    outside = [m.stamp_ns for m in bench.measurements[count:] if m.values[5] > 5.0e5]
    assert 15 <= bench.safe_after(outside[0]) < 50


def test_a_quantity_that_hovers_at_its_limit_is_one_warning() -> None:
    limits = LimitMonitor({name: Limit(-math.inf, math.inf, -math.inf, math.inf, 0.0, False) for name in MEASURED}
                          | {"front_pressure": Limit(1e5, 4e5, -math.inf, math.inf, 0.0, False)})  # fmt: skip
    rng, told = random.Random(1), []
    for i in range(4000):
        pressure = 4e5 + rng.gauss(0.0, 1e3) if i < 2000 else 3.9e5
        told += limits.step([0.03, 0.03, -0.016, -0.016, pressure, 4e5, 7.9e5], 1e-3)
    assert [finding.reason for finding in told] == [Reason.LIMIT_WARN, Reason.LIMIT_CLEAR]


def test_frames_that_pass_the_crc_by_chance_must_continue_the_counters() -> None:
    bench = Bench().run(100)
    count = len(bench.measurements)
    last = bench.core.intake._last  # type: ignore[union-attr]
    for forged in (last._replace(sequence=last.sequence + 77), last._replace(device_us=last.device_us + 500_000), last):
        bench.core.receive(encode(forged), bench.now)
    bench._take()
    assert len(bench.measurements) == count and bench.core.lost_frames == 3
    assert len(bench.run(10).measurements) == count + 10


def test_heavy_frame_loss_trips() -> None:
    bench = Bench().armed()
    number = iter(range(10**9))
    bench.up = lambda data: b"" if next(number) % 5 == 0 else data
    bench.run(2500)
    assert Reason.FRAMES_LOST in bench.reasons() and bench.core.mode is Mode.SAFE


def test_boards_that_do_not_fit_are_refused() -> None:
    good = board_identity()
    misfits = [
        good._replace(watchdog_us=80_000),
        good._replace(outputs=tuple(OutputRange(*entry[:3], 4095) for entry in good.outputs)),
        good._replace(inputs=(good.inputs[0], *good.inputs[:-1])),
    ]
    for hello in misfits:
        bench = Bench(hello).run(1500)
        assert bench.core.phase is Phase.REFUSED and Reason.BOARD_REFUSED in bench.reasons()
        assert bench.core.arm(bench.now) and bench.device.state is DeviceState.SAFE


def test_the_printed_calibration_is_flagged_at_load() -> None:
    bench = Bench(calibration="appendix_c").run(50)
    assert {Reason.CALIBRATION_DOUBTFUL, Reason.CHANNEL_UNWATCHED} <= set(bench.reasons())
    assert Reason.CALIBRATION_DOUBTFUL not in Bench().run(50).reasons()


def test_commands_stop_when_nobody_watches_the_timeouts() -> None:
    bench = Bench().armed()
    stamp = bench.measurements[-1].stamp_ns
    bench.core.command([1e-6] * 4, stamp + 100 * MS, bench.now + 110 * MS)
    bench._take()
    assert bench.core.mode is Mode.SAFE and bench.reasons()[-1] is Reason.DRIVER_FAILED


@settings(max_examples=150, deadline=None)
@given(st.lists(st.one_of(st.binary(max_size=80), st.integers(0, 200)), max_size=40), st.integers(0, 2**32 - 1))
def test_no_bytes_from_the_board_can_break_the_driver(steps: list[bytes | int], seed: int) -> None:
    """Noise, replayed, reordered and truncated frames, at any pace: no exception, and nothing arms."""
    rng, now, sent = random.Random(seed), START, bytearray()
    core = DriverCore(load_safety(), load_calibration(), RIG, sent.extend)
    core.opened(now)
    device = Device(board_identity(), sent.extend, lambda counts: None)
    device.boot(0)
    for step in steps:
        if isinstance(step, int):
            now += step * MS
            core.tick(now)
            device.receive(bytes(sent), now // 1000 % 2**32)
            continue
        device.tick(now // 1000 % 2**32, tuple(rng.randrange(-(2**31), 2**31) for _ in range(7)))
        frames = bytes(sent)
        core.receive(step + frames[rng.randrange(len(frames) + 1) :], now)
        core.command([rng.uniform(-1, 1)] * 4, now, now)
    core.drain()
    assert core.mode is not Mode.ARMED and device.state is not DeviceState.ARMED


def test_every_reason_is_documented() -> None:
    page = (DOCS / "hardware.md").read_text(encoding="utf-8")
    for reason in Reason:
        assert f"| `{reason.code}` | {reason.value} |" in page


@pytest.mark.slow
def test_the_ride_through_frames_and_converters_is_the_plants(capsys: pytest.CaptureFixture[str]) -> None:
    """Within 5 %, on a simulated clock: what the line's form and the converters cost, without what a computer adds."""
    from helpers.serial_rig import CALIBRATION, Loop
    from serial_loop import compare, reference, simulated

    loop = Loop()
    options = argparse.Namespace(duration=15.0, seed=1, calibration=CALIBRATION, adc_bits=16)
    assert compare(simulated(options, loop), reference(15.0, 1, loop)) < 0.05
    assert "mode armed, lost frames 0, refused commands 0" in capsys.readouterr().out
