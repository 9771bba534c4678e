# SPDX-License-Identifier: Apache-2.0
"""An emergency stop that outlives the program: a file for each place it must be found again. Knows no ROS.

Only a person ends an emergency stop. A node that is restarted, or the session after it, must therefore find the stop of
the one before: by the rig's address in the graph (a stop may come while no board is known) and by the board's serial
number (the same board under another domain, namespace or port is still the rig somebody stopped). A file that cannot
be read counts as a stop: it is there because somebody pressed the button.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from contextlib import suppress
from datetime import datetime
from pathlib import Path

FOLDER = "emergency-stops"


def state_folder() -> Path:
    """Where this user's programs keep what must survive them: XDG_STATE_HOME, by default ~/.local/state."""
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "pneumo_ros" / FOLDER


def address_key(domain: int, namespace: str) -> str:
    """Key of a rig by its DDS domain and namespace."""
    return f"domain-{domain}{namespace.rstrip('/').replace('/', '.')}"


def board_key(serial_number: str) -> str:
    """Key of a rig by the serial number its board tells."""
    return "board-" + re.sub(r"[^A-Za-z0-9_-]", "_", serial_number)


class StopLatch:
    """The stops of one rig, on disk.

    Parameters
    ----------
    keys : under which the rig is known; :meth:`know` adds one
    folder : of the files; the user's state folder by default

    Attributes
    ----------
    trouble : why a file could not be written or removed ('' while all is well); the caller says so
    """

    def __init__(self, keys: Iterable[str], folder: Path | None = None) -> None:
        self._folder = folder or state_folder()
        self._keys = list(keys)
        self.trouble = ""

    def know(self, key: str) -> None:
        """The rig is known under another key as well; a stop under one of them holds under all."""
        if key in self._keys:
            return
        found = self.found()
        self._keys.append(key)
        if found:
            self.set(found)

    def found(self) -> str:
        """Who stopped the rig and when, or '' if nobody did."""
        for key in self._keys:
            path = self._path(key)
            if os.path.lexists(path):
                return _read(path)
        return ""

    def set(self, by: str) -> None:
        """Write the stop down under every key; an older one keeps its words."""
        for key in self._keys:
            path = self._path(key)
            try:
                self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                with suppress(FileExistsError), path.open("x", encoding="utf-8") as file:
                    file.write(by + "\n")
                    file.flush()
                    os.fsync(file.fileno())
            except OSError as error:
                self.trouble = f"the emergency stop cannot be kept over a restart ({error})"

    def clear(self) -> None:
        """A person has reset the stop."""
        for key in self._keys:
            try:
                self._path(key).unlink(missing_ok=True)
            except OSError as error:
                self.trouble = f"the emergency stop stays for the next session ({error})"

    def _path(self, key: str) -> Path:
        return self._folder / key


def described(by: str) -> str:
    """The words a stop is kept in."""
    return f"by {by} at {datetime.now().astimezone().isoformat(timespec='seconds')}"


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip() or f"of unknown origin ({path} is empty)"
    except (OSError, UnicodeDecodeError) as error:
        return f"of unknown origin ({path} cannot be read: {error})"
