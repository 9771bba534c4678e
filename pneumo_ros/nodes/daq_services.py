# SPDX-License-Identifier: Apache-2.0
"""What an operator asks of the hardware: emergency stop, reset, zero, span."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date
from pathlib import Path

from std_msgs.msg import String
from std_srvs.srv import Trigger

from pneumo_ros.daq.calibration import Calibration
from pneumo_ros.daq.calibration_file import calibration_to_yaml, save_calibration
from pneumo_ros.daq.driver import SerialDriver
from pneumo_ros.daq.field_calibration import Point, span, zero
from pneumo_ros.daq.stop_latch import StopLatch, address_key, board_key, described
from pneumo_ros.errors import InputError
from pneumo_ros.log import topics
from pneumo_ros.nodes.base import ERROR, RigNode
from pneumo_ros.nodes.emergency_stop import RESET_SERVICE, TRIP_SERVICE, hear_stops
from pneumo_ros.rig import Rig

ZERO_SERVICE, SPAN_SERVICE = "rig/zero", "rig/span"
SAMPLES = 500  # averaged for zero and span; Appendix C took 100 readings
TIMEOUT = 3.0  # s for them


class RigServices:
    """Services and the e-stop topic of the node that drives the hardware.

    Parameters
    ----------
    node : offers them; its parameters zero_what, span_channel, span_reference, calibration_output are read at the call
    driver : gives the driver, None while unconfigured
    rig : parameters

    Attributes
    ----------
    latch : the emergency stop as it outlives this node
    """

    def __init__(self, node: RigNode, driver: Callable[[], SerialDriver | None], rig: Rig) -> None:
        self._node, self._driver, self._rig = node, driver, rig
        self._points: dict[str, Point] = {}
        self._publish = node.publisher(topics.CALIBRATION).publish
        domain = node.context.get_domain_id()
        self.latch = StopLatch([address_key(domain, node.get_namespace())])
        hear_stops(node, self.trip)
        node.create_service(Trigger, TRIP_SERVICE, self._on_trip)
        node.create_service(Trigger, RESET_SERVICE, self._on_reset)
        node.create_service(Trigger, ZERO_SERVICE, self._on_zero)
        node.create_service(Trigger, SPAN_SERVICE, self._on_span)

    def publish(self, calibration: Calibration) -> None:
        """Say which calibration is in use."""
        self._publish(String(data=calibration_to_yaml(calibration)))

    # -- emergency stop --------------------------------------------------------------------------------------------

    def trip(self, by: str) -> None:
        """Emergency stop, from any state; without a driver it waits for one."""
        driver = self._driver()
        if driver is not None:
            driver.estop(by)
        elif not self.latch.found():
            self._node.event(ERROR, "estop", f"emergency stop by {by}: the valves will not be armed", {"by": by})
        self.keep(by)

    def keep(self, by: str) -> None:
        """The stop outlives this node."""
        self.latch.set(described(by))
        self._tell_trouble()

    def released(self) -> None:
        """The board has left its emergency stop, because a person asked for it."""
        self.latch.clear()
        self._tell_trouble()

    def meet(self, driver: SerialDriver, serial_number: str) -> None:
        """A board is there: a stop of before holds, whoever ran it then."""
        self.latch.know(board_key(serial_number))
        found = self.latch.found()
        if found:
            driver.estop(f"an earlier one {found}")

    def _tell_trouble(self) -> None:
        if self.latch.trouble:
            self._node.event(ERROR, "estop_not_kept", self.latch.trouble)
            self.latch.trouble = ""

    def _on_trip(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.trip("service")
        return _answer(response, "", "emergency stop is latched")

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        driver = self._driver()
        why = (
            driver.reset() if driver is not None else ["the driver is not configured, so nobody knows the rig's state"]
        )
        return _answer(response, "; ".join(why), "released; activate to arm")

    def _on_zero(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        what = str(self._node.values["zero_what"])

        def change(driver: SerialDriver) -> Calibration:
            changed, points = zero(driver.core.calibration, driver.averages(SAMPLES, TIMEOUT), what, self._rig)
            self._points.update(points)
            return changed

        return self._change(change, response, f"{what} sensors set to their known values")

    def _on_span(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        channel = str(self._node.values["span_channel"])
        reference = float(self._node.values["span_reference"])

        def change(driver: SerialDriver) -> Calibration:
            readings = driver.averages(SAMPLES, TIMEOUT)
            today = date.today().isoformat()
            point = self._points.get(channel)
            return span(driver.core.calibration, readings, channel, reference, point, self._rig, today)

        return self._change(change, response, f"{channel} spans its zero point and {reference:.6g} (SI)")

    def _change(
        self, change: Callable[[SerialDriver], Calibration], response: Trigger.Response, done: str
    ) -> Trigger.Response:
        driver = self._driver()
        if driver is None:
            return _answer(response, "the driver is not configured")
        try:
            changed = change(driver)
            output = str(self._node.values["calibration_output"])
            if output:
                save_calibration(changed, Path(output))
        except (InputError, OSError) as error:
            return _answer(response, str(error))
        driver.use(changed)
        self.publish(changed)
        return _answer(response, "", done)


def _answer(response: Trigger.Response, why_not: str, done: str = "") -> Trigger.Response:
    response.success, response.message = not why_not, why_not or done
    return response
