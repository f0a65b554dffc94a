"""Files kept on this machine so that they need not be received again."""

import contextlib
import os
from pathlib import Path

from vistel.whole_file import whole_file


def write_whole(path: Path, data: bytes) -> None:
    """Write a file, whole or not at all; its folder is made. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path, private=True) as stream:
        stream.write(data)


def read_kept(path: Path, most: int) -> bytes | None:
    """The file's bytes; it counts as used now. None where it cannot be read or has more than `most` bytes."""
    try:
        if path.stat().st_size > most:
            return None
        data = path.read_bytes()
        os.utime(path)
    except OSError:
        return None
    return data


def make_room(folder: Path, pattern: str, most: int) -> None:
    """Remove the least recently used files of a folder until at most `most` bytes remain."""
    found: list[tuple[int, int, Path]] = []
    total = 0
    with contextlib.suppress(OSError):  # another process removes files too
        found += [(p.stat().st_mtime_ns, p.stat().st_size, p) for p in folder.glob(pattern)]
        for _, size, path in sorted(found, reverse=True):
            total += size
            if total > most:
                path.unlink(missing_ok=True)
