# SPDX-License-Identifier: Apache-2.0
"""A mistake in a user's effect file as one line: file, line, what, and what there is instead."""

from __future__ import annotations

import re
import traceback
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from pneumo_ros.errors import InputError, did_you_mean

REMEDY = "give a Python file that defines EFFECT = Effect(...), like those in pneumo_ros/effects/library"
_UNEXPECTED = re.compile(r"(\w+)\.__init__\(\) got an unexpected keyword argument '(\w+)'")
_MISSING = re.compile(r"(\w+)\.__init__\(\) missing \d+ required .*arguments?: (.*)")


def in_effect_file(error: Exception, path: Path, copy: Path) -> InputError:
    """What is wrong with the file, from what loading its copy raised."""
    line = line_of(error, copy)
    where = f"{path}:{line}" if line is not None else path
    unexpected, missing = _UNEXPECTED.search(str(error)), _MISSING.search(str(error))
    if unexpected is not None:
        known = fields_of(unexpected[1])
        return InputError(f"{unexpected[1]} has no such field", where=where, key=unexpected[2],
                          allowed=", ".join(known), remedy=did_you_mean(unexpected[2], known))  # fmt: skip
    if missing is not None:
        return InputError(f"{missing[1]} lacks {missing[2]}", where=where, allowed=", ".join(fields_of(missing[1])),
                          remedy="add it")  # fmt: skip
    return InputError(f"cannot load the effect ({type(error).__name__}: {_said(error)})", where=where, remedy=REMEDY)


def line_of(error: BaseException, path: Path) -> int | None:
    """The innermost line of the file that the error passed through, or that cannot be parsed."""
    if isinstance(error, SyntaxError):
        return error.lineno
    own = path.resolve()
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).resolve() == own]
    return lines[-1] if lines else None


def fields_of(name: str) -> list[str]:
    """Fields of the contract's class of this name."""
    from pneumo_ros.effects import composition, contract, guide, parameters

    modules = (contract, parameters, composition, guide)
    kind: Any = next((getattr(module, name) for module in modules if hasattr(module, name)), None)
    return [field.name for field in fields(kind)] if is_dataclass(kind) else list(getattr(kind, "_fields", ()))


def _said(error: Exception) -> str:
    return error.msg if isinstance(error, SyntaxError) else str(error)
