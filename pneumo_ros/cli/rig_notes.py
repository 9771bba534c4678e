# SPDX-License-Identifier: Apache-2.0
"""What a rig file leaves out, said where the file is used."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console

    from pneumo_ros.rig import Rig


def tell_assumed(console: Console, rig: Rig, path: Path | None) -> None:
    """One line with the keys that come from the thesis's rig; nothing for a whole file."""
    if path is None or not rig.assumed:
        return
    text = f"note: {path} leaves these out, so they are the thesis's rig's: {', '.join(rig.assumed)}"
    console.print(text, highlight=False, markup=False, soft_wrap=True)
