# SPDX-License-Identifier: Apache-2.0
"""Texts from elsewhere, as they may be shown: what would steer a terminal or turn a line round is shown, not obeyed."""

from __future__ import annotations

import re

# C0 but newline and tab, DEL and C1 (terminal sequences), marks that turn the reading direction or hide, surrogates.
_UNSHOWN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u00ad\u061c\u180e\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb"
    "\ud800-\udfff\U000e0000-\U000e007f]"
)


def printable(text: str) -> str:
    """``text`` with control characters and direction marks written out (``\\x1b``, ``\\u202e``)."""
    return _UNSHOWN.sub(lambda found: found[0].encode("unicode_escape", "backslashreplace").decode("ascii"), text)


def one_line(text: str) -> str:
    """The same, with newlines and tabs written out too: a name cannot begin a line of its own."""
    return printable(text).replace("\n", "\\n").replace("\t", "\\t")


def shown(value: object) -> object:
    """For templates: texts made printable, numbers and finished markup as they are."""
    return printable(value) if type(value) is str else value
