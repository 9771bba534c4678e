# SPDX-License-Identifier: Apache-2.0
"""Finding effects: the package's own, a user's file, or an installed entry point."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import pkgutil
import sys
from collections.abc import Iterable, Sequence
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from pneumo_ros.effects import library
from pneumo_ros.effects.mistakes import in_effect_file
from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.effects.contract import Effect

ENTRY_POINT_GROUP = "pneumo_ros.effects"
HOOKS = {
    "inputs": "inputs, period, ends, values, memory",
    "outputs": "outputs, period, channels, values, memory",
}


def load_library(paths: Sequence[str | Path] = (), without: Iterable[str] = ()) -> dict[str, Effect]:
    """All effects by id: the package's, those of installed entry points, then those in the given files.

    Parameters
    ----------
    paths : Python files that define ``EFFECT``; an id that exists already is replaced by the user's
    without : ids to leave out

    Raises
    ------
    InputError
        if a file cannot be loaded, defines no effect, or ``without`` names an unknown id.
    """
    names = sorted(m.name for m in pkgutil.iter_modules(library.__path__))
    found = [importlib.import_module(f"{library.__name__}.{name}").EFFECT for name in names]
    found += [_installed(point) for point in entry_points(group=ENTRY_POINT_GROUP)]
    found += [_effect_in(Path(path)) for path in paths]
    effects = {effect.id: effect for effect in found}
    for name in without:
        if name not in effects:
            raise InputError("unknown effect", key="without", value=name, allowed=", ".join(effects))
        del effects[name]
    return effects


def function_at(module: str, file: str, name: str) -> Any:
    """A function of an importable module, or of a loose file that is loaded under that module name."""
    try:
        return getattr(importlib.import_module(module), name)
    except ModuleNotFoundError:
        return getattr(module_at(module, file), name)


def module_at(module: str, file: str) -> ModuleType:
    """Load a loose file once under a module name of its own."""
    if module in sys.modules:
        return sys.modules[module]
    spec = importlib.util.spec_from_file_location(module, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"cannot load {file}")
    loaded = importlib.util.module_from_spec(spec)
    sys.modules[module] = loaded
    try:
        spec.loader.exec_module(loaded)
    except BaseException:
        del sys.modules[module]
        raise
    return loaded


def _installed(point: EntryPoint) -> Effect:
    from pneumo_ros.effects.contract import Effect

    where, remedy = f"entry point group {ENTRY_POINT_GROUP}", "mend or uninstall the package that brings it"
    try:
        effect = point.load()
    except Exception as error:
        raise InputError(f"cannot load the installed effect ({type(error).__name__}: {error})", where=where,
                         key=point.name, value=point.value, remedy=remedy) from error  # fmt: skip
    if not isinstance(effect, Effect):
        raise InputError("the installed effect is no Effect", where=where, key=point.name, value=point.value,
                         remedy=remedy)  # fmt: skip
    return effect


def _effect_in(path: Path) -> Effect:
    from pneumo_ros.effects.contract import Effect

    remedy = "give a Python file that defines EFFECT = Effect(...), like those in pneumo_ros/effects/library"
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()[:12]
        effect = getattr(module_at(f"pneumo_effect_{path.stem}_{digest}", str(path.resolve())), "EFFECT", None)
    except Exception as error:
        raise in_effect_file(error, path) from error
    if not isinstance(effect, Effect):
        raise InputError("defines no EFFECT", where=path, remedy=remedy)
    for hook, wanted in HOOKS.items():
        function = getattr(effect, hook)
        if function is not None and len(inspect.signature(function).parameters) != wanted.count(",") + 1:
            raise InputError("hook of another form", where=path, key=hook, allowed=f"{hook}({wanted})", remedy=remedy)
    return effect
