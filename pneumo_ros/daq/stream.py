# SPDX-License-Identifier: Apache-2.0
"""Bytes in, records out: splits a stream at the delimiters, drops what fails a check and counts why."""

from __future__ import annotations

from collections import Counter

from pneumo_ros.daq.frames import DELIMITER, MAX_FRAME, FrameError, Record, Reject, decode


class StreamDecoder:
    """Decoder of one direction of a line.

    Noise costs at most one good frame, the one it runs into: the next delimiter puts the decoder back in step.
    ``good`` counts records given out, ``rejected`` dropped frames by reason, ``bytes`` everything fed.
    """

    def __init__(self) -> None:
        self.good = 0
        self.bytes = 0
        self.rejected: Counter[Reject] = Counter()
        self._pending = bytearray()
        self._overlong = False

    @property
    def bad(self) -> int:
        """Frames dropped, all reasons together."""
        return sum(self.rejected.values())

    def feed(self, data: bytes) -> list[Record]:
        """The records completed by ``data``, in order."""
        self.bytes += len(data)
        *complete, rest = data.split(DELIMITER)
        records = []
        for piece in complete:
            record = self._finish(piece)
            if record is not None:
                records.append(record)
        self._collect(rest)
        return records

    def reset(self) -> None:
        """Forget a half-received frame (the port was opened again); the counters stay."""
        self._pending.clear()
        self._overlong = False

    def _collect(self, piece: bytes) -> None:
        self._pending += piece
        if len(self._pending) > MAX_FRAME:
            # Keep the memory bounded however long the line stays without a delimiter.
            self._overlong = True
            self._pending.clear()

    def _finish(self, piece: bytes) -> Record | None:
        self._collect(piece)
        frame, overlong = bytes(self._pending), self._overlong
        self.reset()
        if overlong:
            self.rejected[Reject.OVERLONG] += 1
            return None
        if not frame:
            return None
        try:
            record = decode(frame)
        except FrameError as error:
            self.rejected[error.reason] += 1
            return None
        self.good += 1
        return record
