"""Tests run side by side on empty caches: one process compiles a kernel, the others wait for it and take it from the cache."""

from __future__ import annotations

import fcntl
import hashlib
from pathlib import Path
from typing import Any

from numba.core.dispatcher import Dispatcher

_compile = Dispatcher.compile


def _compiled_once(self: Any, sig: Any) -> Any:
    if not self.stats.cache_path:
        return _compile(self, sig)
    name = hashlib.blake2b(f"{self.py_func.__qualname__}{sig}".encode(), digest_size=12).hexdigest()
    folder = Path(self.stats.cache_path)
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return _compile(self, sig)


Dispatcher.compile = _compiled_once
