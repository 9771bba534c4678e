# SPDX-License-Identifier: Apache-2.0
"""Seals: a salted SHA-256 of every label, published before the diagnosis runs and checked when answers are opened."""

from __future__ import annotations

import hashlib
import json
import secrets
from pathlib import Path
from typing import Any

from pneumo_ros.errors import InputError

Label = dict[str, Any]


def seal(label: Label, salt: str) -> str:
    """Hex digest of the salt and the label in canonical JSON."""
    text = salt + json.dumps(label, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def sealed(labels: list[Label]) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """(labels each with a salt of its own, case -> digest)."""
    salted = [(secrets.token_hex(16), label) for label in labels]
    entries = [{"salt": salt, "label": label} for salt, label in salted]
    return entries, {str(label["case"]): seal(label, salt) for salt, label in salted}


def opened(labels_file: Path, digests: dict[str, str]) -> dict[str, Label]:
    """Labels by case, each checked against the digest published for it.

    Raises
    ------
    InputError
        if the file cannot be read, a case has no label, or a label is not the one that was sealed.
    """
    try:
        entries = json.loads(labels_file.read_text(encoding="utf-8"))
        found = {item["label"]["case"]: (item["label"], item["salt"]) for item in entries}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"cannot read the labels ({error})", where=labels_file, remedy="give the maker's file"
        ) from error
    for case, digest in digests.items():
        if case not in found:
            raise InputError("no label for this case", where=labels_file, key=case, remedy="give the maker's file")
        if seal(*found[case]) != digest:
            raise InputError("label differs from the one that was sealed", where=labels_file, key=case,
                             remedy="use the labels made together with this manifest")  # fmt: skip
    return {case: found[case][0] for case in digests}
