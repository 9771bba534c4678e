# SPDX-License-Identifier: Apache-2.0
"""Where the parts of the repository are that tests read."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS, CONFIG, FIRMWARE, PACKAGE = ROOT / "docs", ROOT / "config", ROOT / "firmware", ROOT / "pneumo_ros"
