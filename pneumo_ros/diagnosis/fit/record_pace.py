# SPDX-License-Identifier: Apache-2.0
"""The pace of records: a record may state its own; without one the half car's stands."""

from __future__ import annotations

from collections.abc import Sequence

from pneumo_ros.diagnosis.fit.pace import HALF_CAR, Pace
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.traits import HasPace


def pace_of(record: Record) -> Pace:
    """A record's own pace, or the half car's."""
    return record.pace if isinstance(record, HasPace) else HALF_CAR


def shared_pace(records: Sequence[Record]) -> Pace:
    """The pace that logs are fitted at: that of the longest."""
    return pace_of(max(records, key=lambda r: len(r.measured) * r.period))
