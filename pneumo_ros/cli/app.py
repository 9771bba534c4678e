# SPDX-License-Identifier: Apache-2.0
"""A Typer app that reads its commands' annotations itself, so that Ubuntu 24.04's Typer 0.9 takes them too.

Typer 0.9 reads neither an ``Annotated`` that ``from __future__ import annotations`` left as text nor ``X | None``; the
later ones do. Resolved hints with ``Optional`` mean the same to all of them.
"""

from __future__ import annotations

import inspect
import shutil
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

import typer
from typer.core import TyperGroup

from pneumo_ros.errors import not_one_of

Function = TypeVar("Function", bound=Callable[..., Any])


class Verbs(TyperGroup):
    """Verbs below a verb: a wrong one is told with all there are, on one line."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The verb that runs."""
        if not args[0].startswith("-") and args[0] not in self.commands:
            raise not_one_of("no such verb", args[0], self.commands, where=ctx.command_path)
        return super().resolve_command(ctx, args)


class App(typer.Typer):
    """Typer, with resolved annotations and paragraphs of help that fill the terminal's lines."""

    def __init__(self, *, cls: type[TyperGroup] = Verbs, **options: Any) -> None:
        super().__init__(cls=cls, **options)

    def command(self, *args: Any, **options: Any) -> Callable[[Function], Function]:
        """See ``typer.Typer.command``."""
        if options.get("help") is None:
            return lambda function: self.command(*args, **{**options, "help": paragraphs(function)})(function)
        register = super().command(*args, **options)
        return lambda function: register(resolved(function))

    def callback(self, *args: Any, **options: Any) -> Callable[[Function], Function]:
        """See ``typer.Typer.callback``."""
        register = super().callback(*args, **options)
        return lambda function: register(resolved(function))


def program() -> str:
    """What to type for ``pneumo``: its name, or the path it was called by where the shell does not find it."""
    called, found = Path(sys.argv[0]), shutil.which("pneumo")
    if called.name != "pneumo" or (found is not None and Path(found).resolve() == called.resolve()):
        return "pneumo"
    return str(called)


def paragraphs(function: Callable[..., Any]) -> str:
    """The docstring with a line a paragraph: typer keeps the source's line ends in all but the first."""
    text = inspect.cleandoc(function.__doc__ or "")
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))


def resolved(function: Function) -> Function:
    """The function, its annotations objects instead of text and its unions spelled the older way."""
    hints = get_type_hints(function, include_extras=True)
    function.__annotations__ = {name: _spelled(hint) for name, hint in hints.items()}
    return function


def _spelled(hint: Any) -> Any:
    within = [kind for kind in get_args(hint) if get_origin(kind) is Annotated] if get_origin(hint) is Union else []
    if within:  # Python 3.10 puts an Optional around the whole where the default is None
        return _spelled(within[0])
    if get_origin(hint) is Annotated:
        kind, *notes = get_args(hint)
        return Annotated[(_spelled(kind), *notes)]
    return Union[get_args(hint)] if isinstance(hint, types.UnionType) else hint  # noqa: UP007 (it is the point)
