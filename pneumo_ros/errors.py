# SPDX-License-Identifier: Apache-2.0
"""What the user did wrong, said on one line: what, where, the value, what is allowed, the remedy."""

from __future__ import annotations

from collections.abc import Iterable

from pneumo_ros.printable import printable


class PneumoError(Exception):
    """Base of every error this package raises on purpose; the command line turns it into exit code 2."""


def is_interruption(error: BaseException) -> bool:
    """Whether it is Ctrl-C, also one that met compiled code, which hands it on as the cause of a SystemError."""
    found: BaseException | None = error
    while found is not None and not isinstance(found, KeyboardInterrupt):
        found = found.__cause__
    return found is not None


class InputError(PneumoError):
    """A file, key or value that cannot be used.

    Parameters
    ----------
    what : the problem, in words
    where : file, topic or option it was found in
    key : name of the entry, if there is one
    value : the offending value, shown as it was read
    allowed : what would have been accepted, with its unit
    remedy : what to do next
    """

    def __init__(
        self,
        what: str,
        *,
        where: object = None,
        key: str | None = None,
        value: object = None,
        allowed: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.what, self.where, self.key = what, where, key
        self.value, self.allowed, self.remedy = value, allowed, remedy
        super().__init__(self._line())

    def _line(self) -> str:
        parts = [f"{self.where}: " if self.where is not None else "", self.what]
        if self.key is not None:
            parts.append(f", key '{self.key}'")
        if self.value is not None:
            parts.append(f", value {_short(self.value)}")
        if self.allowed is not None:
            parts.append(f"; allowed: {self.allowed}")
        if self.remedy is not None:
            parts.append(f"; {self.remedy}")
        return printable(" ".join("".join(parts).split()))


def not_one_of(
    what: str, value: str, choices: Iterable[str], *, where: object = None, key: str | None = None, also: str = ""
) -> InputError:
    """A name that is none of ``choices``: the whole list, ``also`` what else would do, and the nearest as a remedy."""
    names = list(choices)
    allowed = ", ".join([*names, also] if also else names)
    return InputError(what, where=where, key=key, value=value, allowed=allowed, remedy=did_you_mean(value, names))


def did_you_mean(value: str, choices: Iterable[str]) -> str | None:
    """``did you mean 'x'?`` for the choice that is spelt most like ``value``; None if none is like it."""
    from difflib import get_close_matches

    plain = {name.lower(): name for name in choices}
    near = get_close_matches(value.lower(), plain, n=1) or [name for name in plain if value and name.startswith(value)]
    return f"did you mean '{plain[near[0]]}'?" if near else None


def _short(value: object, limit: int = 80) -> str:
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 3] + "..."
