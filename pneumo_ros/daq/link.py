# SPDX-License-Identifier: Apache-2.0
"""The driver's link to the board: handshake, sessions, the device's clock, and what was lost on the way."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from enum import Enum

from pneumo_ros.daq.actuation import SECOND
from pneumo_ros.daq.admission import admit
from pneumo_ros.daq.calibration import Calibration
from pneumo_ros.daq.calibration_check import check_calibration
from pneumo_ros.daq.clock import DeviceClock
from pneumo_ros.daq.frames import Hello, HelloRequest, Status, encode
from pneumo_ros.daq.intake import Intake, Measurement
from pneumo_ros.daq.reactions import Reactions
from pneumo_ros.daq.reasons import Finding, Level, Reason
from pneumo_ros.daq.safety_config import SafetyConfig
from pneumo_ros.daq.stream import StreamDecoder
from pneumo_ros.errors import InputError
from pneumo_ros.plant.air_spring import effective_area, load_surface
from pneumo_ros.rig import Rig

HELLO_EVERY = SECOND // 5  # between handshake attempts
REFUSED_EVERY = 2 * SECOND  # between attempts after a refusal
SILENT_FOR = SECOND // 2  # of silence after which the handshake starts again
WINDOW = SECOND  # over which lost frames are judged
MIN_WINDOW_FRAMES = 100
COMPLAINT_EVERY = SECOND  # between events about refused commands
CLOCK_KEPT = 60 * SECOND  # without samples, after which the drift learnt before is too old


class Phase(Enum):
    """State of the link."""

    CLOSED = "closed"
    HANDSHAKE = "handshake"
    RUNNING = "running"
    REFUSED = "refused"


class Link(Reactions):
    """Who is at the other end, since when, and how much of what it sends arrives.

    Parameters
    ----------
    safety, calibration, rig : configuration
    send : writes bytes to the port without blocking
    discard : throws away bytes that have not left the host yet
    draw : the handshakes' nonces; another in each session, so that no answer recorded before fits
    """

    def __init__(
        self,
        safety: SafetyConfig,
        calibration: Calibration,
        rig: Rig,
        send: Callable[[bytes], None],
        discard: Callable[[], None] = lambda: None,
        draw: Callable[[], int] = lambda: secrets.randbits(32),
    ) -> None:
        super().__init__(safety, send, discard)
        self.safety, self.calibration, self.rig = safety, calibration, rig
        self._surface = load_surface()
        effective_area(rig.design_height.value, 1e5, self._surface)  # loads the compiled code before it is urgent
        self.phase = Phase.CLOSED
        self.decoder = StreamDecoder()
        self.intake: Intake | None = None
        self.status: Status | None = None
        self.last: Measurement | None = None
        self._send = send
        self._nonce = 0
        self._draw = draw
        self.foreign = 0  # frames of another session, dropped
        self._last_stray = -COMPLAINT_EVERY
        self._strays = 0  # samples of another session since the last own one
        self._last_hello = 0
        self._last_sample = 0
        self._silent = False
        self._window = (0, 0, 0)

    def opened(self, now: int) -> None:
        """The port is open: shake hands."""
        self.decoder.reset()
        self._shake_hands(now)

    def closed(self, why: str, now: int) -> None:
        """The port is gone; never armed again by itself."""
        if self.phase is Phase.CLOSED:
            return
        self._lose(Finding(Reason.LINK_LOST, "port", why), now)
        self.phase = Phase.CLOSED
        self.actuation.board(None)

    def _shake_hands(self, now: int) -> None:
        self.phase = Phase.HANDSHAKE
        self.actuation.board(None)
        self._last_hello = now
        # Unguessable: the answer to a handshake of another session must not pass for the answer to this one.
        self._nonce = self._draw() % 0xFFFFFFFF + 1
        self._send(encode(HelloRequest(self._nonce)))

    def _on_hello(self, hello: Hello, now: int) -> None:
        if self.phase is Phase.RUNNING and hello.nonce not in (0, self._nonce):
            self.foreign += 1
            self._lose(Finding(Reason.LINK_SHARED, "board", "it answers another host, or an old frame came again"), now)
            # Not at once: two hosts that take the board from each other must not flood the line.
            self.phase, self._last_hello = Phase.HANDSHAKE, now
            self.actuation.board(None)
            return
        known = self.intake.hello.boot_id if self.intake else hello.boot_id
        if hello.boot_id != known and self.phase is Phase.RUNNING:
            self._lose(Finding(Reason.BOARD_RESET, "board", f"boot {known} became {hello.boot_id}"), now)
        if hello.nonce == 0:
            self._shake_hands(now)
        elif hello.nonce == self._nonce and self.phase is Phase.HANDSHAKE:
            self._meet(hello, now)

    def _meet(self, hello: Hello, now: int) -> None:
        """The answer to our handshake: take the board or refuse it."""
        try:
            scale = admit(hello, self.calibration, self.safety)
        except InputError as error:
            self.phase = Phase.REFUSED
            self._finding_event(Finding(Reason.BOARD_REFUSED, "board", str(error)), now)
            return
        self.intake = Intake(
            hello, self.calibration, self.safety, self.rig, self._surface, self._known_clock(hello, now)
        )
        self.actuation.board(scale, hello.session)
        self.phase, self.status, self.last = Phase.RUNNING, None, None
        self._last_sample, self._silent, self._strays = now, False, 0
        self._window = (now, 0, 0)
        self.findings.reset(now)
        firmware = ".".join(map(str, hello.firmware))
        values = {"serial_number": hello.serial_number, "firmware": firmware, "boot_id": str(hello.boot_id),
                  "sample_period_us": str(hello.sample_period_us), "adc_bits": str(hello.adc_bits)}  # fmt: skip
        self.event(Level.OK, Reason.LINK_OPEN, f"board {hello.serial_number}, firmware {firmware}", values, now)
        self._say_doubts(hello, now)

    def _known_clock(self, hello: Hello, now: int) -> DeviceClock | None:
        """The clock as learnt before, if this board has run on since: late frames after a stall keep right stamps."""
        before = self.intake
        if before is None or now - self._last_sample > CLOCK_KEPT:
            return None
        same = (hello.serial_number, hello.boot_id) == (before.hello.serial_number, before.hello.boot_id)
        return before.clock if same and before.clock.runs_on(hello.device_us, now) else None

    def _say_doubts(self, hello: Hello, now: int) -> None:
        assert self.intake is not None
        for doubt in check_calibration(self.calibration, hello, self.rig.ambient_pressure.value):
            values = {"channel": doubt.channel, "finding": doubt.code, "calibration": self.calibration.name}
            text = f"{doubt.channel}: {doubt.text}"
            self.event(Level.WARN, Reason.CALIBRATION_DOUBTFUL, text, values, now)
        for channel in self.intake.plausibility.unwatched:
            text = f"a stuck {channel} cannot be told in time with {self.calibration.name}"
            self.event(Level.WARN, Reason.CHANNEL_UNWATCHED, text, {"channel": channel}, now)

    def _stray(self, now: int) -> None:
        """A frame of another session: old, or somebody else's. It is dropped, and said once a second."""
        self.foreign += 1
        if now - self._last_stray >= COMPLAINT_EVERY:
            self._last_stray = now
            text = f"{self.foreign} frames of another session dropped so far"
            self._finding_event(Finding(Reason.LINK_SHARED, "link", text, Level.WARN), now)

    def _watch_samples(self, now: int) -> None:
        silence = now - self._last_sample
        if silence > self.safety.timeouts.samples * SECOND and not self._silent:
            self._silent = True
            self._lose(Finding(Reason.SAMPLES_STALE, "board", f"no sample for {silence / 1e6:.1f} ms"), now)
        if silence > SILENT_FOR:
            self._shake_hands(now)

    def _watch_frames(self, now: int) -> None:
        """Trip when too many of a window's frames were lost or damaged."""
        start, expected_before, bad_before = self._window
        if self.intake is None or now - start < WINDOW:
            return
        expected = self.intake.samples + self.intake.lost
        share_of = expected - expected_before
        lost = self.lost_frames - bad_before
        if expected_before and share_of >= MIN_WINDOW_FRAMES:
            limit = self.safety.plausibility.lost_frames
            if lost > limit * share_of:
                self._handle(Finding(Reason.FRAMES_LOST, "link", f"{lost} of {share_of} frames lost in a second"), now)
        self._window = (now, expected, self.lost_frames)

    @property
    def lost_frames(self) -> int:
        """Samples that never came or came damaged, since the handshake."""
        return self.intake.lost + self.intake.out_of_step if self.intake else 0
