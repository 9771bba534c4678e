# SPDX-License-Identifier: Apache-2.0
"""What a node published reaches its subscribers before the node ends."""

from __future__ import annotations

import time
from collections.abc import Iterable

from rclpy.duration import Duration
from rclpy.publisher import Publisher

DELIVERY_PATIENCE = 7.0  # s: a lost last message is repaired by the writer's heartbeat, every 3 s in Fast DDS; twice


def delivered(publishers: Iterable[Publisher], patience: float = DELIVERY_PATIENCE) -> bool:
    """Wait until every reliable subscriber has confirmed everything; whether they did within ``patience`` s in all."""
    end = time.monotonic() + patience
    return all(made.wait_for_all_acked(Duration(seconds=max(0.0, end - time.monotonic()))) for made in publishers)
