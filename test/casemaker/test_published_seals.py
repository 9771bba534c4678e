# SPDX-License-Identifier: Apache-2.0
"""The answers that were published after each full set are those that were sealed before it."""

from __future__ import annotations

import hashlib
import json
import tarfile
from pathlib import Path

import pytest
from helpers.folders import ROOT

from pneumo_ros.casemaker.seal import opened, seal

BLIND = ROOT / "docs" / "blind"
SUMS = {name: digest for digest, name in (line.split() for line in (BLIND / "SHA256SUMS").read_text().splitlines())}
LABELS = "labels.tar.xz"


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("labels")
    with tarfile.open(BLIND / LABELS) as archive:
        for member in archive:
            content = archive.extractfile(member)
            assert content is not None and Path(member.name).name == member.name
            (folder / member.name).write_bytes(content.read())
    return folder


def test_the_archive_holds_what_its_checksums_say(unpacked: Path) -> None:
    assert hashlib.sha256((BLIND / LABELS).read_bytes()).hexdigest() == SUMS[LABELS]
    found = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in unpacked.iterdir()}
    assert found == {name: digest for name, digest in SUMS.items() if name != LABELS}


@pytest.mark.parametrize(
    ("release", "count"),
    [("0.1", 86), ("0.2", 240), ("0.3", 240), ("0.4", 280), ("0.5", 279), ("0.6", 279), ("0.7", 280), ("0.8", 280)],
)
def test_every_published_answer_is_the_sealed_one(unpacked: Path, release: str, count: int) -> None:
    manifest = json.loads((BLIND / f"full-{release}-manifest.json").read_text())
    text = (unpacked / f"full-{release}-labels.json").read_text()
    entries = {entry["label"]["case"]: entry for entry in json.loads(text)}
    digests = {case["name"]: case["label_sha256"] for case in manifest["cases"] if case["name"] in entries}
    assert len(digests) == len(entries) == count
    labels = opened(unpacked / f"full-{release}-labels.json", digests)
    name, label = next(iter(labels.items()))
    assert seal({**label, "kind": "none of these"}, entries[name]["salt"]) != digests[name]
