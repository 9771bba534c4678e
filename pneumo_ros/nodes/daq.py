# SPDX-License-Identifier: Apache-2.0
"""The real rig (or an emulated one) on a serial port: a life cycle node over :mod:`pneumo_ros.daq`.

configure: open the port, shake hands, load the calibration; raw counts flow, zero and span work. activate: arm the
valves, starting from the safe command. deactivate: safe command. A trip deactivates; only an operator (or the start of
a session) activates. Nothing here decides about safety: the driver does, and the board behind it.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn
from std_msgs.msg import String

from pneumo_ros.daq.calibration import DEFAULT
from pneumo_ros.daq.calibration_file import load_calibration
from pneumo_ros.daq.driver import BAUD, SerialDriver
from pneumo_ros.daq.link import Phase
from pneumo_ros.daq.reasons import Event, Level, Reason
from pneumo_ros.daq.report import LinkReport
from pneumo_ros.daq.safety_config import load_safety
from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.log.cdr import JointDecoder
from pneumo_ros.nodes.base import ERROR, OK, WARN, RigNode
from pneumo_ros.nodes.daq_output import MeasurementOutput, WallClock
from pneumo_ros.nodes.daq_services import RigServices
from pneumo_ros.nodes.daq_session import HardwareNode, HardwareSession
from pneumo_ros.nodes.emergency_stop import RESET_SERVICE
from pneumo_ros.nodes.sources import SoleSource
from pneumo_ros.nodes.spin import node_main
from pneumo_ros.parameters import Parameter, Value
from pneumo_ros.rig import load_rig

PARAMETERS: tuple[Parameter, ...] = (
    Parameter("port", "/dev/ttyACM0", "", "serial port of the board, or a link to it", read_only=True),
    Parameter("baud", BAUD, "baud", "of a UART; USB CDC ignores it", 9600, 12_000_000, read_only=True),
    Parameter("calibration", DEFAULT, "", "name in config/calibration, or a YAML file", read_only=True),
    Parameter("safety", "", "", "safety file (YAML); empty for config/safety.yaml", read_only=True),
    Parameter("duration", 20.0, "s", "length of the session from arming; 0 runs until stopped", 0.0, 86400.0,
              read_only=True),
    Parameter("autostart", True, "", "configure at once and activate when the session is ready", read_only=True),
    Parameter("arm_patience", 15.0, "s", "an autostart that cannot arm for so long ends the session", 1.0, 3600.0,
              read_only=True),
    Parameter("report_progress", False, "", "print the session's time on standard output", read_only=True),
    Parameter("zero_what", "displacement", "", "what /rig/zero sets: displacement (rig levelled at rest) or pressure "
              "(vented)", choices=("displacement", "pressure")),
    Parameter("span_channel", "sprung_front", "", "sensor that /rig/span works on"),
    Parameter("span_reference", 0.0, "m, Pa", "known value the sensor has at /rig/span, SI", -1.0, 2e6),
    Parameter("calibration_output", "", "", "file (YAML) that zero and span write; empty for none"),
)  # fmt: skip
HANDSHAKE_PATIENCE = 3.0  # s for the board's answer when configuring
LEVELS = {Level.OK: OK, Level.WARN: WARN, Level.ERROR: ERROR}
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class DaqNode(HardwareNode):
    """Thin shell over :class:`pneumo_ros.daq.driver.SerialDriver`."""

    def __init__(self, context: Context | None = None, overrides: Mapping[str, Value] | None = None) -> None:
        RigNode.__init__(self, "daq", PARAMETERS, context=context, overrides=overrides, owns_time=True)
        if self.lockstep:
            raise InputError("hardware does not wait", where="daq", key="mode", value="lockstep", allowed="realtime")
        self.rig = load_rig(self.values["rig"] or None)
        self.safety = load_safety(self.values["safety"] or None)
        self.calibration = load_calibration(self.values["calibration"])
        self.driver = None
        self.report: LinkReport | None = None
        self.wall = WallClock()
        self.output = MeasurementOutput(self, self.rig, self.wall)
        self.operator = RigServices(self, lambda: self.driver, self.rig)
        self.publisher(topics.CONFIG).publish(String(data=self.rig.to_yaml()))
        self._read_command = JointDecoder(topics.COMMAND.name, topics.COMMAND.names).decode
        self.commands = self.subscribe(topics.COMMAND, self._on_command)
        self._closed = tuple(self.safety.safe_command)
        self.reason = ""
        LifecycleNodeMixin.__init__(self)
        self.session = HardwareSession(self)

    @property
    def hardware_id(self) -> str:
        """The board's serial number once it has answered: which hardware a status is about (REP 107)."""
        driver = getattr(self, "driver", None)
        intake = driver.core.intake if driver is not None else None
        return intake.hello.serial_number if intake is not None else super().hardware_id

    # -- life cycle ------------------------------------------------------------------------------------------------

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the port and shake hands."""
        driver = SerialDriver(
            self.values["port"], self.safety, self.calibration, self.rig, self.output.send, self._on_event,
            self.values["baud"], self.output.send_applied,
        )  # fmt: skip
        try:
            driver.open()
            self._meet(driver)
        except InputError as error:
            driver.close()
            return self._refuse("configure_refused", str(error))
        self.driver, self.report = driver, LinkReport(driver)
        self.operator.publish(self.calibration)
        assert driver.core.intake is not None
        self.operator.meet(driver, driver.core.intake.hello.serial_number)
        return SUCCESS

    def _meet(self, driver: SerialDriver) -> None:
        """Wait for the board's answer and check that its rate fits the session's."""
        where = self.values["port"]
        driver.wait_for(lambda core: core.phase in (Phase.RUNNING, Phase.REFUSED), HANDSHAKE_PATIENCE)
        intake = driver.core.intake
        if driver.core.phase is not Phase.RUNNING or intake is None:
            raise InputError(f"no handshake: link is {driver.core.phase.value}", where=where, remedy="see /rig/events")
        ratio = self.period_ns / (intake.hello.sample_period_us * 1000)
        if ratio < 1.0 or not ratio.is_integer():
            raise InputError(
                "the control rate does not divide the board's", where=where, key="rate_hz",
                value=self.values["rate_hz"], allowed=f"{1e6 / intake.hello.sample_period_us:g} Hz over a whole number",
            )  # fmt: skip
        self.output.decimation = int(ratio)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Arm the valves, for commands of the one publisher that is there now."""
        why = self.blockers()
        if not why and self.driver is not None:
            self.commands.held = True
            why = self.driver.arm()
            self.commands.held = not why
        return self._refuse("arm_refused", "; ".join(why)) if why else SUCCESS

    def blockers(self) -> list[str]:
        """Why the valves cannot be armed; empty if they can."""
        if self.driver is None:
            return ["not configured"]
        why = self.driver.core.blockers(time.monotonic_ns())
        if self.operator.latch.found():
            why.append(f"emergency stop {self.operator.latch.found()}; a person resets it ({RESET_SERVICE})")
        if self.commands.count > 1:
            why.append(f"{self.commands.count} nodes publish {topics.COMMAND.name}")
        return why

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Safe command."""
        self.commands.held = bool(self.values["session_id"])
        if self.driver is not None:
            self.driver.disarm()
        return SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Close the port."""
        driver, self.driver, self.report = self.driver, None, None
        if driver is not None:
            driver.close()
        return SUCCESS

    on_shutdown = on_error = on_cleanup

    def _refuse(self, code: str, why: str) -> TransitionCallbackReturn:
        self.event(ERROR, code, why)
        self.reason = why
        return FAILURE

    def on_stop(self, executor: Executor) -> None:
        """Valves safe and port closed before the last messages are delivered."""
        if self.driver is not None:
            self.driver.disarm()
        self.session.tell_end()
        self.on_cleanup(LifecycleState("", 0))
        super().on_stop(executor)

    def on_begin(self) -> None:
        """Arm by itself, if that is wished."""
        self.session.begin()

    # -- data ------------------------------------------------------------------------------------------------------

    def _on_command(self, data: bytes) -> None:
        start = time.monotonic_ns()
        stamp, areas = self._read_command(data)
        if self.driver is not None and (self.output.gave(stamp) or areas == self._closed):
            self.driver.command(areas, self.wall.monotonic(stamp))
        self.timed(start)

    def on_other_publisher(self, source: SoleSource, text: str) -> None:
        """A second voice trips armed valves at once; without a session around it the node lives on, disarmed."""
        if self.driver is not None:
            self.driver.trip(Reason.COMMAND_FOREIGN, text)
        if self.values["session_id"]:
            super().on_other_publisher(source, text)

    def _on_event(self, event: Event) -> None:
        if event.reason is Reason.ESTOP and event.level is Level.ERROR:
            self.operator.keep(event.values.get("subject", "the driver"))
        elif event.reason is Reason.ESTOP_RESET:
            self.operator.released()
        self.event(LEVELS[event.level], event.reason.code, event.message, event.values)

    def health(self) -> dict[str, str]:
        """Loop figures and the link's."""
        ahead = self.wall.follow()
        link = self.report.values(time.monotonic_ns()) if self.report is not None else {}
        own = {"state": self.state_label, "samples withheld": str(self.output.withheld),
               "system clock ahead of stamps (us)": f"{ahead / 1e3:.0f}"}  # fmt: skip
        return {**super().health(), **own, **link}

    def health_level(self) -> tuple[bytes, str]:
        """The link's level once configured."""
        if self.report is None:
            return WARN, self.state_label
        level, message = self.report.level()
        return LEVELS[level], message


def main(args: list[str] | None = None) -> int:
    """Entry point of ``daq``."""
    return node_main(DaqNode, args)


if __name__ == "__main__":
    raise SystemExit(main())
