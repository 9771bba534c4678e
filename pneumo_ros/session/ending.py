# SPDX-License-Identifier: Apache-2.0
"""How a session ended, from what its nodes said: over, or cut short and why. Knows no ROS."""

from __future__ import annotations

from collections.abc import Mapping

RIG_NODES = frozenset(("plant", "daq"))
"""Nodes of which a session has one; it says when the session begins and when it is over."""


class Ending:
    """Listens to the events of a session."""

    def __init__(self) -> None:
        self._complete = self._started = False
        self._stopped = self._error = ""

    def hear(self, error: bool, values: Mapping[str, str], message: str) -> None:
        """One event; ``values`` carry its reason code, ``error`` its level."""
        code = values.get("code", "")
        self._started |= code == "session_started"
        self._complete |= code == "session_complete"
        if code == "session_stopped":
            self._stopped = message
        elif error:
            self._error = message

    def verdict(self, rigs: frozenset[str] | set[str], failure: str) -> tuple[bool, str]:
        """(whether the session is complete, why not), when everything has been heard.

        Parameters
        ----------
        rigs : nodes of the session that are the rig; without one nobody says that it is over, and stopping ends it
        failure : why somebody else ended it, '' if nobody did
        """
        if failure or not rigs:
            return not failure, failure
        if self._complete:
            return True, ""
        early = self._stopped or ("cut short" if self._started else "ended before the first sample")
        return False, f"{early}; {self._error}" if self._error else early
