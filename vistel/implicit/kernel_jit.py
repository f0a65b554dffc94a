"""How the kernels of the deformation are compiled, and when a compiled one on disk is too old.

Numba takes a cached kernel for current as long as its own file has not changed, although it holds the code and
the constants of the files it calls. These kernels share a layout and leaves across files, so each is stamped
with the state of all of them.
"""

# pyright: basic

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba as nb

_PATTERNS = ("kernel*.py", "ghost_effects*.py", "deform_table.py", "addresses.py", "pointers.py", "contact_set.py", "wide.py")
_FLAGS = {"nsz", "arcp", "contract", "afn", "reassoc"}


def _stamp() -> tuple[tuple[str, int, int], ...]:
    files = sorted({f for pattern in _PATTERNS for f in Path(__file__).parent.glob(pattern)})
    return tuple((f.name, f.stat().st_mtime_ns, f.stat().st_size) for f in files)


_STAMP = _stamp()


def _compile(function: Callable[..., Any], flags: Any) -> Any:
    kernel: Any = nb.njit(cache=True, fastmath=flags, error_model="numpy", nogil=True)(function)
    file = getattr(kernel._cache, "_cache_file", None)
    if file is not None:
        file._source_stamp = (file._source_stamp, _STAMP)
    return kernel


def fast(function: Callable[..., Any]) -> Any:
    """A kernel or leaf: quick arithmetic, but NaN and infinities are what they are."""
    return _compile(function, _FLAGS)


def leaf(function: Callable[..., Any]) -> Any:
    """As `fast` for a leaf that calls `wide`: LLVM estimates reciprocals only where it need not think of
    infinities."""
    return _compile(function, _FLAGS | {"ninf"})


def reduction(function: Callable[..., Any]) -> Any:
    """A leaf that finds a largest value, which LLVM only vectorises where it need not think of NaN."""
    return _compile(function, True)
