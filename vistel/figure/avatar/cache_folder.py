"""The user's folders on this machine, for what can be made again and what cannot; the lock under which processes write there."""

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


def default_state() -> Path:
    """The user's directory on this platform for what outlives a session and is no cache."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "vistel"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "vistel"
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "vistel"


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
