# SPDX-License-Identifier: Apache-2.0
"""A hostile line between driver and board: nothing false is published, nothing old moves a valve."""

from __future__ import annotations

import pytest
from helpers.line_proxy import KINDS, LATE_MS, Witness
from helpers.simulated_rig import MS, SAFE

from pneumo_ros.daq.actuation import Mode
from pneumo_ros.daq.emulator.device import Device
from pneumo_ros.daq.frames import Command, CommandFlag, DeviceState, Hello, HelloRequest, decode, encode
from pneumo_ros.daq.reasons import Reason


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_hostile_line_publishes_nothing_false_and_moves_nothing(kind: str) -> None:
    """A sample of ``bench/line_proxy.py``: both directions at once, after a whole session was recorded."""
    first = Witness(1)
    assert first.arm()
    first.run(200)
    witness = Witness(2, first.recorded)
    assert witness.arm()
    witness.attack(kind, "both", 250)
    witness.up.start("")
    witness.down.start("")
    witness.run(200)
    assert witness.faults == [] and witness.values > 1000
    said = witness.bench.reasons()
    if kind in ("silence", "delay", "other_version"):
        assert witness.trips == 1 and witness.bench.core.mode is Mode.SAFE
        assert {Reason.SAMPLES_STALE, Reason.FRAMES_LOST, Reason.BOARD_WATCHDOG} & set(said)
    if kind in ("old_session", "other_session"):
        assert Reason.LINK_SHARED in said


def test_an_old_session_played_to_the_board_arms_nothing() -> None:
    """Its handshake opens a session of the board's own choosing, to which none of the old commands belongs."""
    first = Witness(3)
    assert first.arm()
    sent: list[bytes] = []
    outputs: list[tuple[int, ...]] = []
    device = Device(first.bench.hello._replace(boot_id=77), sent.append, outputs.append)
    device.boot(0)
    for k, frame in enumerate(first.recorded[1]):
        device.receive(frame, 1000 * k)
    assert device.state is DeviceState.SAFE and set(outputs) == {SAFE} and device.refused_commands > 100
    assert any(isinstance(decode(frame[:-1]), HelloRequest) for frame in first.recorded[1])


def test_a_line_that_holds_everything_up_moves_no_valve() -> None:
    """In order, in session, only seconds late: the board tells by the sample that the command answers."""
    witness = Witness(4)
    sent: list[bytes] = []
    outputs: list[tuple[int, ...]] = []
    device = Device(witness.bench.hello, sent.append, outputs.append)
    device.boot(0)
    for k in range(1, 101):
        device.tick(1000 * k, (0,) * 7)
    hello = decode(sent[0][:-1])
    assert isinstance(hello, Hello)
    for k in range(1, 50):
        flags = CommandFlag.ARM if k > 1 else CommandFlag(0)
        device.receive(encode(Command(hello.session, k, 50, flags, (9, 9, 9, 9))), 100_000 + 2000 * k)
    assert device.state is DeviceState.SAFE and set(outputs) == {SAFE} and device.refused_commands == 48


def test_two_hosts_on_one_board_arm_nothing_and_say_so() -> None:
    witness = Witness(5)
    assert witness.arm()
    begin = witness.bench.now
    witness.bench.device.receive(encode(HelloRequest(12345)), witness.bench.us)
    witness.run(60)
    assert Reason.LINK_SHARED in witness.bench.reasons() and witness.bench.core.mode is Mode.SAFE
    assert witness.bench.safe_after(begin) <= LATE_MS and witness.faults == []
    witness.run(400)
    assert witness.bench.core.arm(witness.bench.now + 0 * MS) == [] or witness.arm()


def test_the_nonce_of_a_handshake_is_not_that_of_another_session() -> None:
    nonces: list[int] = []
    for seed in range(8):
        witness = Witness(seed)
        witness.run(3)
        nonces += {r.nonce for f in witness.recorded[1] if isinstance(r := decode(f[:-1]), HelloRequest)}
    assert len(nonces) >= 8 and len(set(nonces)) == len(nonces)
