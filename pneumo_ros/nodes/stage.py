# SPDX-License-Identifier: Apache-2.0
"""A node around one stage of the control period: what estimator and controller share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Generic, TypeVar

from rclpy.context import Context

from pneumo_ros.arrays import Array
from pneumo_ros.nodes.base import RigNode
from pneumo_ros.nodes.hand_over import HandOver
from pneumo_ros.parameters import Parameter, Value
from pneumo_ros.rig import Rig, load_rig
from pneumo_ros.session.stages import Output, Progress, Stage, advance

S = TypeVar("S", bound=Stage)


class StageNode(RigNode, Generic[S]):
    """The stage is built of the node's parameters, and built anew when they change.

    Parameters
    ----------
    name, table, context, overrides, hand_over : as of :class:`~pneumo_ros.nodes.base.RigNode`
    build : rig, control period in s, values of the parameters -> the stage
    """

    def __init__(
        self,
        name: str,
        table: Sequence[Parameter],
        build: Callable[[Rig, float, Mapping[str, Value]], S],
        context: Context | None = None,
        overrides: Mapping[str, Value] | None = None,
        hand_over: HandOver | None = None,
    ) -> None:
        super().__init__(name, table, context=context, overrides=overrides, hand_over=hand_over)
        self.rig = load_rig(self.values["rig"] or None)
        self._build = build
        self.stage = build(self.rig, self.period_ns * 1e-9, self.values)
        self.stage.warm_up()
        self.progress: Progress | None = None

    def on_parameters(self, changed: Mapping[str, Value]) -> None:
        """Rebuild with the new gains; the state goes on, so a change is bumpless."""
        self.stage = self._build(self.rig, self.period_ns * 1e-9, self.values)

    def advance(self, stamp_ns: int, given: Array) -> Output:
        """One sample of the session, stamped in ns."""
        self.progress, output = advance(self.stage, self.progress, stamp_ns, given, self.period_ns)
        return output
