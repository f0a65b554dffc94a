"""The state of the scanline kernels' source, so that compiled code on disk is never older than it."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

_SHARED = ("pointers.py", "layout.py")


@cache
def stamp() -> Any:
    """An array whose *type* names the source: Numba looks compiled code up by the types of arguments."""
    here = Path(__file__).parent
    files = sorted(here.glob("*.py")) + [here.parent / name for name in _SHARED]
    source = b"".join(file.read_bytes() for file in files)
    return np.zeros(1, dtype=[("s" + hashlib.sha256(source).hexdigest()[:12], np.int8)])
