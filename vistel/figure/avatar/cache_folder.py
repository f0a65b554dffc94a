"""Where people that were made are kept on this machine."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def default_cache() -> Path:
    """The user's cache directory for avatars on this platform."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "vistel" / "avatars"
