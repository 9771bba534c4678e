# SPDX-License-Identifier: Apache-2.0
"""Finding effects: the package's own, a user's file, or an installed entry point.

A file is loaded only because the user named it on the command line. What runs is the copy of it in the user's cache
that was hashed, so that neither an edit in between nor compiled remains beside the file can take its place.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import pkgutil
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from pneumo_ros.effects import library
from pneumo_ros.effects.cache import kept
from pneumo_ros.effects.mistakes import in_effect_file
from pneumo_ros.effects.parameters import is_law
from pneumo_ros.errors import InputError

if TYPE_CHECKING:
    from pneumo_ros.effects.contract import Effect

ENTRY_POINT_GROUP = "pneumo_ros.effects"
HOOKS = {
    "inputs": "inputs, period, ends, values, memory",
    "outputs": "outputs, period, channels, values, memory",
}


@dataclass(frozen=True)
class Origin:
    """Where an effect of the user's own came from: its file, and the SHA-256 of its source in hexadecimal."""

    file: Path
    digest: str


_ORIGINS: dict[str, Origin] = {}  # by module, as they are loaded


def origin_of(effect: Effect) -> Origin | None:
    """The file an effect was loaded from; None for the package's own and installed ones."""
    found = (name for name in _ORIGINS if getattr(sys.modules.get(name), "EFFECT", None) is effect)
    return next((_ORIGINS[name] for name in found), None)


def origins(library: Mapping[str, Effect]) -> list[str]:
    """One line for each effect that came from a file, for people: nothing from outside takes part unseen."""
    found = ((name, origin_of(effect)) for name, effect in library.items())
    return [f"effect {name} is loaded from {o.file} (SHA-256 {o.digest[:16]})" for name, o in found if o is not None]


def load_library(paths: Sequence[str | Path] = ()) -> dict[str, Effect]:
    """All effects by id: the package's, those of installed entry points, then those in the given files.

    Parameters
    ----------
    paths : Python files that define ``EFFECT``; an id that exists already is replaced by the user's

    Raises
    ------
    InputError
        if a file cannot be loaded, or defines no effect.
    """
    from pneumo_ros.effects.shapes.families import SHAPES

    names = sorted(m.name for m in pkgutil.iter_modules(library.__path__))
    found = [importlib.import_module(f"{library.__name__}.{name}").EFFECT for name in names]
    found += SHAPES.values()
    found += [_installed(point) for point in entry_points(group=ENTRY_POINT_GROUP)]
    found += [effect_in(Path(path)) for path in paths]
    return {effect.id: effect for effect in found}


def own_ids(effects: Mapping[str, Effect]) -> list[str]:
    """Effects that are not the package's own: a reader must know who competed, and what became of them."""
    folder = Path(str(library.__file__)).parent
    return [name for name in effects if is_law(name) and not (folder / f"{name}.py").exists()]


def laws_of(effects: Mapping[str, Effect]) -> dict[str, Effect]:
    """What a verdict may name: the library without the shapes of families and of places."""
    return {name: effect for name, effect in effects.items() if is_law(name)}


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


def effect_in(path: Path) -> Effect:
    """The effect that a Python file of the user's defines; the file is executed.

    Raises
    ------
    InputError
        if it cannot be loaded or defines no effect of this form.
    """
    from pneumo_ros.effects.contract import Effect

    remedy = "give a Python file that defines EFFECT = Effect(...), like those in pneumo_ros/effects/library"
    try:
        source = path.read_bytes()
        digest = hashlib.sha256(source).hexdigest()
        module = f"pneumo_effect_{re.sub(r'[^0-9A-Za-z_]', '_', path.stem)[:40]}_{digest[:20]}"
        copy = kept(f"{module}.py", source)
        effect = getattr(module_at(module, str(copy)), "EFFECT", None)
        _ORIGINS[module] = Origin(path.resolve(), digest)
    except OSError as error:
        raise InputError(f"cannot load the effect ({error})", where=path, remedy=remedy) from error
    except Exception as error:
        raise in_effect_file(error, path, copy) from error
    if not isinstance(effect, Effect):
        raise InputError("defines no EFFECT", where=path, remedy=remedy)
    for hook, wanted in HOOKS.items():
        function = getattr(effect, hook)
        if function is not None and len(inspect.signature(function).parameters) != wanted.count(",") + 1:
            raise InputError("hook of another form", where=path, key=hook, allowed=f"{hook}({wanted})", remedy=remedy)
    return effect
