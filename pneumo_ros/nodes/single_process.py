# SPDX-License-Identifier: Apache-2.0
"""All nodes of a simulated session in one process and one executor."""

from __future__ import annotations

import sys

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.signals import SignalHandlerOptions

from pneumo_ros.errors import PneumoError
from pneumo_ros.nodes.base import SESSION_NODES
from pneumo_ros.nodes.controller import ControllerNode
from pneumo_ros.nodes.estimator import EstimatorNode
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.nodes.plant import PlantNode
from pneumo_ros.nodes.road_profile import RoadProfileNode
from pneumo_ros.nodes.session_recorder import SessionRecorderNode
from pneumo_ros.nodes.spin import BAD_INPUT, SignalStop, ask_no_more, spin

# The recorder comes last: it is stopped after the others have said their last.
NODES = (RoadProfileNode, PlantNode, EstimatorNode, ControllerNode, SessionRecorderNode)
ROLES = tuple(SESSION_NODES.split(","))


def main(args: list[str] | None = None) -> int:
    """Entry point of ``python -m pneumo_ros.nodes.single_process``."""
    stop = SignalStop()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        hand_over = HandOver(ROLES)
        return spin([build(hand_over=hand_over) for build in NODES], stop)
    except PneumoError as error:
        print(f"error: {error}", file=sys.stderr)
    except ParameterException as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
    finally:
        ask_no_more()
        rclpy.try_shutdown()
    return BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
