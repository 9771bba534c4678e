# SPDX-License-Identifier: Apache-2.0
"""What a session is asked to do, checked before anything starts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pneumo_ros.documents import parse_yaml
from pneumo_ros.errors import InputError
from pneumo_ros.parameters import Parameter, Value

Tables = Mapping[str, tuple[Parameter, ...]]
Values = dict[str, dict[str, Value]]
# Parameters that rclpy declares in every node; `ros2 param dump` writes them too. rclpy checks them.
ROS_OWN = ("use_sim_time", "start_type_description_service")
OVERRIDES = "qos_overrides."


def read_config(path: Path, tables: Tables) -> Values:
    """A ROS 2 parameter file (node -> ros__parameters -> name -> value), every entry checked against its table.

    ``/**`` gives a value to every node that knows the name; ``/**/plant`` and ``/rig1/plant`` mean ``plant``,
    for a file is read for one session, whatever its namespace.

    Raises
    ------
    InputError
        naming file, node and key, value, allowed range and remedy.
    """
    document = _load(path)
    out: Values = {node: {} for node in tables}
    for node, entry in document.items():
        own = entry.get("ros__parameters") if isinstance(entry, Mapping) else None
        if not isinstance(own, Mapping):
            raise InputError("needs a mapping ros__parameters", where=path, key=str(node), value=entry,
                             remedy=f"write {node}: {{ros__parameters: {{...}}}}")  # fmt: skip
        for key, value in _flat(own):
            assign(out, tables, _bare(str(node)), str(key), value, path)
    return out


def _flat(own: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Names and values; what is nested for quality of service gets names with dots, as ROS itself reads it."""
    for key, value in own.items():
        if f"{key}.".startswith(OVERRIDES) and isinstance(value, Mapping):
            yield from _flat({f"{key}.{inner}": one for inner, one in value.items()})
        else:
            yield str(key), value


def assign(out: Values, tables: Tables, node: str, key: str, raw: object, where: object) -> None:
    """Check one value and put it into ``out``; node ``**`` means every node that knows the key."""
    if node != "**" and node not in tables:
        raise InputError("unknown node", where=where, key=node, allowed=", ".join(tables), remedy="correct the name")
    if key in ROS_OWN or key.startswith(OVERRIDES):
        if not isinstance(raw, (bool, int, float, str)):
            raise InputError("not a single value", where=where, key=f"{node}.{key}", value=raw, remedy="correct it")
        for target in [node] if node != "**" else tables:
            out[target][key] = raw
        return
    targets = [node] if node != "**" else [n for n, t in tables.items() if any(p.name == key for p in t)]
    for target in targets or ["**"]:
        spec = next((p for p in tables.get(target, ()) if p.name == key), None)
        if spec is None:
            known = sorted({p.name for t in ([tables[node]] if node in tables else tables.values()) for p in t})
            raise InputError("unknown parameter", where=where, key=f"{node}.{key}", value=raw,
                             allowed=", ".join(known), remedy="correct the name or remove it")  # fmt: skip
        out[target][key] = spec.checked(raw, f"{where}: {target}")


def _bare(node: str) -> str:
    """A node's own name, or ``**`` for all, from a key of a parameter file."""
    return node.rpartition("/")[2] or "**"


def parse_setting(text: str) -> tuple[str, str, Any]:
    """``controller.pole=20`` -> (node, name, value read as YAML)."""
    name, equals, value = text.partition("=")
    node, dot, key = name.strip().partition(".")
    if not equals or not dot or not key:
        raise InputError("not of the form node.parameter=value", where="--set", value=text,
                         remedy="write for example --set controller.pole=20")  # fmt: skip
    return node, key, parse_yaml(value, f"--set {name}")


def _load(path: Path) -> Mapping[str, Any]:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the file ({error})", where=path, remedy="give a readable YAML file") from error
    document = parse_yaml(text, path)
    if not isinstance(document, Mapping):
        raise InputError("not a parameter file", where=path, remedy="start from config/session.yaml")
    return document
