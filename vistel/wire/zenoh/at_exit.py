"""Closes what is open when the main thread ends.

Zenoh calls back on Python threads of its own, and the interpreter waits for such threads before it runs `atexit` handlers: a
process that forgot to close its session would never end. So a thread waits for the main thread's end.
"""

import contextlib
import threading
from collections.abc import Callable

_lock = threading.Lock()
_open: dict[int, Callable[[], object]] = {}
_watcher: threading.Thread | None = None


def close_at_exit(owner: object, close: Callable[[], object]) -> None:
    """Call `close` when the main thread ends, unless `closed(owner)` is said before."""
    global _watcher  # noqa: PLW0603
    with _lock:
        _open[id(owner)] = close
        if _watcher is None:
            _watcher = threading.Thread(target=_watch, name="vistel-at-exit")
            _watcher.start()


def closed(owner: object) -> None:
    """`owner` needs no closing any more."""
    with _lock:
        _open.pop(id(owner), None)


def _watch() -> None:
    threading.main_thread().join()
    while _open:
        with contextlib.suppress(Exception):
            _open.popitem()[1]()
