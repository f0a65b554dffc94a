"""Whether the compiled kernels are on disk already."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def is_cold(machine: Any) -> bool:
    """True where the evaluators of `machine` have never been compiled on this machine."""
    cache = machine.evaluate_points.stats.cache_path
    return not cache or not any(Path(cache).glob("machine.evaluate_points*.nbi"))
