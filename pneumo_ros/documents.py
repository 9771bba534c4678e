# SPDX-License-Identifier: Apache-2.0
"""YAML and JSON that others wrote: bounded in size, depth and entries, and without aliases, before they are built.

A few hundred bytes of YAML aliases stand for 10^9 values, and a text nested a hundred thousand deep ends the process
rather than the parser. Nothing that this package writes uses aliases or nests deeper than a handful.
"""

from __future__ import annotations

import json
import re
from typing import Any

import yaml

from pneumo_ros.errors import InputError

MAX_TEXT = 4_000_000  # characters; the largest text this package writes, a diagnosis, has 100,000
MAX_DEPTH = 40
MAX_ENTRIES = 200_000
LARGEST = 1e300  # YAML has whole numbers of any length; a comparison refuses them, infinities and NaN alike
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times faster where libyaml is there
_BRACKETS = re.compile(r'"(?:[^"\\]|\\.)*"|[\[{\]}]', re.DOTALL)


def parse_yaml(text: str, where: object) -> Any:
    """The document of a YAML text; ``where`` names it in errors.

    Raises
    ------
    InputError
        if it is broken, too long, too deep, has aliases, or a name that stands twice in one table.
    """
    _check_length(text, where)
    try:
        _check_events(text, where)
        _check_names(yaml.compose(text, Loader=_LOADER), where)
        return yaml.load(text, Loader=_LOADER)  # the safe loader: plain values only
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f" at line {mark.line + 1}" if mark is not None else ""
        raise InputError(f"broken YAML{place}", where=where, remedy="mend the syntax") from error
    except (ValueError, TypeError, OverflowError, RecursionError, AttributeError) as error:
        # A date of the 99th month, a number of 10,000 digits: well-formed YAML that no Python value holds.
        raise InputError("a value of the YAML cannot be read", where=where, remedy="write plain numbers and texts") \
            from error  # fmt: skip


def parse_json(text: str, where: object) -> Any:
    """The value of a JSON text; ``where`` names it in errors.

    Raises
    ------
    InputError
        if it is broken, too long or too deep.
    """
    _check_length(text, where)
    depth = 0
    for found in _BRACKETS.finditer(text):
        depth += {"[": 1, "{": 1, "]": -1, "}": -1}.get(found[0], 0)
        if depth > MAX_DEPTH:
            raise _too("deep", where, depth, f"at most {MAX_DEPTH} levels")
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError("broken JSON", where=where, remedy="give a file as this package writes it") from error


def _check_length(text: str, where: object) -> None:
    if len(text) > MAX_TEXT:
        raise _too("long", where, len(text), f"at most {MAX_TEXT} characters")


def _check_events(text: str, where: object) -> None:
    depth = 0
    for entries, event in enumerate(yaml.parse(text, Loader=_LOADER)):
        if isinstance(event, yaml.AliasEvent):
            raise InputError("the YAML has an alias", where=where, key=str(event.anchor),
                             allowed="texts without aliases", remedy="write the value where it belongs")  # fmt: skip
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH:
            raise _too("deep", where, depth, f"at most {MAX_DEPTH} levels")
        if entries > MAX_ENTRIES:
            raise _too("large", where, entries, f"at most {MAX_ENTRIES} entries")


def _check_names(node: yaml.Node | None, where: object) -> None:
    """Of two entries of one name YAML keeps the last, without a word."""
    if isinstance(node, yaml.SequenceNode):
        for one in node.value:
            _check_names(one, where)
    elif isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for name, value in node.value:
            if isinstance(name, yaml.ScalarNode):
                if name.value in seen:
                    raise InputError("a name stands twice", where=where, key=name.value,
                                     value=f"line {name.start_mark.line + 1}", remedy="keep one of them")  # fmt: skip
                seen.add(name.value)
            _check_names(value, where)


def _too(how: str, where: object, value: int, allowed: str) -> InputError:
    return InputError(f"the text is too {how}", where=where, value=value, allowed=allowed,
                      remedy="it is no file of this package")  # fmt: skip
