# SPDX-License-Identifier: Apache-2.0
"""A mistake in the law of a user's effect, which shows when it is compiled: one line with the file's and its line."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pneumo_ros.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from pneumo_ros.effects.composition import PlantTerm

# What the kernel calls each function with: pneumo_ros.effects.composition.PlantTerm.
TAKEN = {
    "start": "strut, air, tyre, p", "advance": "z, strut, air, tyre, dt, p", "force": "strut, z, p",
    "tyre": "tyre, z, p", "air": "air, z, p", "supply": "z, p", "body": "strut_front, strut_rear, z, p",
    "struts": "strut_front, strut_rear, z, p", "ground": "tyre_front, tyre_rear, z, p",
    "airs": "air_front, air_rear, z, p",
}  # fmt: skip
TAKEN_SHARED = {"start": "front, rear, p", "advance": "z, front, rear, dt, p"}
COMPILED = 'write @njit(cache=True, error_model="numpy") above it'
USABLE = "mend the law; what it may use: docs/diagnosis.md and pneumo_ros/effects/hooks.py"
_LINE = re.compile(r'File "[^"]*?(pneumo_effect_\w+_[0-9a-f]{20})\.py", line (\d+)')
_CALL = re.compile(r'File "[^"]*?(kernel_[0-9a-f]{20})\.py".*?\b([a-z]+_\d+)\(', re.DOTALL)
_ATTRIBUTE = re.compile(r"Unknown attribute '(\w+)' of type (Strut|Air|Tyre)\(")
_FRAME = "Failed in nopython mode"


@contextmanager
def own_laws(files: Sequence[Path]) -> Iterator[None]:
    """While laws of the user's effect files are compiled and run.

    Raises
    ------
    InputError
        where one of them cannot be compiled; what has another cause passes as it is.
    """
    from pneumo_ros.effects.loading import effect_in

    terms = [(file, term) for file in files if (term := effect_in(file).term) is not None]
    for file, term in terms:
        _check_form(file, term)
    try:
        yield
    except Exception as error:
        mistake = _mistake_in(error, terms)
        if mistake is None:
            raise
        raise mistake from error


def _check_form(file: Path, term: PlantTerm) -> None:
    """Each function is compiled and takes what it is called with."""
    taken = {**TAKEN, **(TAKEN_SHARED if term.shared else {})}
    for hook, function in term.functions.items():
        plain = getattr(function, "py_func", None)
        if plain is None:
            raise InputError("the law is an ordinary function", where=_place(file, function), key=hook, remedy=COMPILED)
        given = list(inspect.signature(plain).parameters)
        if len(given) != taken[hook].count(",") + 1:
            raise InputError("the law has another form", where=_place(file, plain), key=hook,
                             value=f"({', '.join(given)})", allowed=f"({taken[hook]})")  # fmt: skip


def _place(file: Path, function: Any) -> str:
    """File and line of a function; of the file alone for what is none."""
    code = getattr(function, "__code__", None)
    return str(file) if code is None else f"{file}:{code.co_firstlineno}"


def _mistake_in(error: Exception, terms: Sequence[tuple[Path, PlantTerm]]) -> InputError | None:
    """What is wrong with which line of which file; None for an error that is not of one of them."""
    from numba.core.errors import NumbaError

    from pneumo_ros.effects import hooks

    where = _where(str(error), terms) if isinstance(error, NumbaError) else None
    if where is None:
        return None
    attribute = _ATTRIBUTE.search(str(error))
    if attribute is not None:
        fields = getattr(hooks, attribute[2])._fields
        return InputError(f"{attribute[2]} has no such field", where=where, key=attribute[1],
                          allowed=", ".join(fields), remedy=did_you_mean(attribute[1], fields))  # fmt: skip
    said = (line.strip() for line in str(error).splitlines())
    reason = next((line for line in said if line and not line.startswith(_FRAME)), type(error).__name__)
    return InputError(f"the law cannot be compiled ({reason})", where=where, remedy=USABLE)


def _where(text: str, terms: Sequence[tuple[Path, PlantTerm]]) -> str | None:
    """Numba names the line inside the law, or, of the composed kernel, the one that calls it."""
    laws = {f.py_func.__module__: (file, f.py_func) for file, term in terms for f in term.functions.values()}
    line, call = _LINE.search(text), _CALL.search(text)
    if line is not None and line[1] in laws:
        return f"{laws[line[1]][0]}:{line[2]}"
    function = getattr(sys.modules.get(call[1]), call[2], None) if call is not None else None
    plain = getattr(function, "py_func", None)
    known = plain is not None and plain.__module__ in laws
    return _place(laws[plain.__module__][0], plain) if known else None
