"""Closes what is open when the main thread ends.

Zenoh calls back on Python threads of its own, and the interpreter waits for such threads before it runs `atexit` handlers: a
process that forgot to close its session would never end. So a thread waits for the main thread's end.

That thread also waits for the bus's own threads: one that comes back from Zenoh's native code while the interpreter goes
down makes the whole process abort (before Python 3.14).
"""

import contextlib
import threading
from collections.abc import Callable
from weakref import WeakSet

MOST_S = 3.0
"""So long a process that ends waits for the bus's threads [s]."""

_lock = threading.Lock()
_open: dict[int, Callable[[], object]] = {}
_watcher: threading.Thread | None = None
_threads = WeakSet[threading.Thread]()


def close_at_exit(owner: object, close: Callable[[], object]) -> None:
    """Call `close` when the main thread ends, unless `closed(owner)` is said before."""
    global _watcher  # noqa: PLW0603
    with _lock:
        _open[id(owner)] = close
        if _watcher is None:
            # A thread is by default a daemon if the one is that starts it, and nobody waits for daemons.
            _watcher = threading.Thread(target=_watch, name="vistel-at-exit", daemon=False)
            _watcher.start()


def closed(owner: object) -> None:
    """`owner` needs no closing any more."""
    with _lock:
        _open.pop(id(owner), None)


def started(thread: threading.Thread) -> threading.Thread:
    """Start a thread that calls Zenoh. A process that ends waits for it, once everything is closed."""
    with _lock:
        _threads.add(thread)
    thread.start()
    return thread


def _watch() -> None:
    threading.main_thread().join()
    while _open:
        with contextlib.suppress(Exception):
            _open.popitem()[1]()
    waiting = threading.Thread(target=_join, args=[list(_threads)], daemon=True)
    waiting.start()
    waiting.join(MOST_S)


def _join(threads: list[threading.Thread]) -> None:
    for thread in threads:
        thread.join()
