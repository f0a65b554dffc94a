"""The folder in which made people are cached on this machine, and the lock under which processes write there."""

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

if sys.platform != "win32":
    import fcntl


def default_cache() -> Path:
    """The user's cache directory for avatars on this platform."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "vistel" / "avatars"


@contextmanager
def file_lock(lock: Path) -> Generator[None, None, None]:
    """Holds a lock on the file `lock` where the platform and the folder allow it, so that processes of one machine take turns."""
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        stream = lock.open("ab")
    except OSError:
        yield
        return
    with stream:
        if sys.platform != "win32":
            fcntl.flock(stream, fcntl.LOCK_EX)
        yield
