"""Golden values of the dissertation's mathematics, by group (tests/golden.json)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

VALUES: list[dict[str, Any]] = json.loads((Path(__file__).parents[2] / "golden.json").read_text())["values"]


def group(name: str) -> list[dict[str, Any]]:
    """The entries of one group."""
    return [entry for entry in VALUES if entry["group"] == name]
