"""How the kernels of the deformation are compiled, and when a compiled one on disk is too old.

Numba takes a cached kernel for current as long as its own file has not changed, although it holds the code and
the constants of the files it calls. These kernels share a layout and leaves across files, so each is stamped
with the state of all of them.
"""

# pyright: basic

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba as nb

_PATTERNS = (
    "kernel*.py", "ghost_effects*.py", "deform_table.py", "addresses.py", "pointers.py", "contact_set.py", "wide.py",
    "lanes.py",
)  # fmt: skip
_FLAGS = {"nsz", "arcp", "contract", "afn", "reassoc"}


def _stamp(folder: Path, *patterns: str) -> tuple[tuple[str, int, int], ...]:
    files = sorted({f for pattern in patterns for f in folder.glob(pattern)})
    return tuple((f.name, f.stat().st_mtime_ns, f.stat().st_size) for f in files)


_HERE = Path(__file__).parent
_STAMP = _stamp(_HERE, *_PATTERNS)


@cache
def _stamp_of(folder: Path) -> tuple[tuple[str, int, int], ...]:
    """The state of what kernels of a folder are compiled from: in rooms inside this one, theirs and all of ours."""
    return _STAMP if folder == _HERE else _stamp(_HERE, "*.py") + _stamp(folder, "kernel*.py")


def _compile(function: Callable[..., Any], flags: Any, inline: bool = False) -> Any:
    kernel: Any = nb.njit(cache=True, fastmath=flags, error_model="numpy", nogil=True, forceinline=inline)(function)
    file = getattr(kernel._cache, "_cache_file", None)
    if file is not None:
        folder = Path(function.__code__.co_filename).parent
        file._source_stamp = (file._source_stamp, _stamp_of(folder))
    return kernel


def fast(function: Callable[..., Any]) -> Any:
    """A kernel or leaf: quick arithmetic, but NaN and infinities are what they are."""
    return _compile(function, _FLAGS)


def leaf(function: Callable[..., Any]) -> Any:
    """As `fast` for a leaf that calls `wide`: LLVM estimates reciprocals only where it need not think of
    infinities."""
    return _compile(function, _FLAGS | {"ninf"})


def inlined(function: Callable[..., Any]) -> Any:
    """A part of leaves that works on `Lanes`: it becomes code of its caller, so that values stay in registers."""
    return _compile(function, _FLAGS | {"ninf"}, inline=True)


def reduction(function: Callable[..., Any]) -> Any:
    """A leaf that finds a largest value, which LLVM only vectorises where it need not think of NaN."""
    return _compile(function, True)
