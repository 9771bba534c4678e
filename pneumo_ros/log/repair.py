# SPDX-License-Identifier: Apache-2.0
"""Make a readable file of a damaged log. The original is only read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pneumo_ros.log.rewriting import refuse_target, write_log
from pneumo_ros.log.salvage import Loss, Salvaged, salvage


@dataclass(frozen=True)
class Recovery:
    """A recovered file and what is not in it."""

    output: Path
    kept: int
    salvaged: Salvaged

    @property
    def whole(self) -> bool:
        """Whether nothing was lost, and that can be told."""
        return not self.salvaged.losses and self.salvaged.lost == 0


def recover(source: Path, output: Path, overwrite: bool = False) -> Recovery:
    """Write the readable part of ``source`` to ``output``.

    The new file carries a metadata record ``recovery``: source, messages kept and lost, each stretch left out.

    Raises
    ------
    InputError
        if nothing can be read, or the output exists or cannot be written.
    """
    refuse_target(output, source, overwrite)
    found = salvage(source)
    account = {
        "source": source.name,
        "messages_kept": str(found.kept),
        "messages_lost": "unknown" if found.lost is None else str(found.lost),
        **{f"loss_{i}": describe(loss) for i, loss in enumerate(found.losses)},
        **{f"note_{i}": note for i, note in enumerate(found.notes)},
    }
    kept = write_log(found.log, output, {"recovery": account})
    return Recovery(output, kept, found)


def describe(loss: Loss) -> str:
    """One line about a stretch left out."""
    text = f"{loss.file.name}: {loss.length} bytes at byte {loss.offset}: {loss.what}"
    if loss.span_ns is not None:
        text += f"; log times {loss.span_ns[0] / 1e9:.3f} s to {loss.span_ns[1] / 1e9:.3f} s"
    return text
