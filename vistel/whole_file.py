"""Files that are written whole or not at all."""

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def whole_file(path: Path, *, private: bool = False, sync: bool = False) -> Generator[BinaryIO]:
    """A stream into a new file beside `path`. At the end of the block the file takes the place of `path`; after an error it is
    removed and `path` stays as it was.

    private: only its owner may read it; sync: it is on the disk before it takes its place, and its name is before this returns.
    Raises OSError, also where the folder is missing.
    """
    part = path.with_name(f"{path.stem}{os.urandom(4).hex()}.part")
    handle = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o600 if private else 0o666)
    try:
        with os.fdopen(handle, "wb") as stream:
            yield stream
            if sync:
                stream.flush()
                os.fsync(stream.fileno())
        os.replace(part, path)
        if sync:
            sync_folder(path.parent)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def sync_folder(path: Path) -> None:
    """See to it that what was made, renamed or removed in a folder outlives the machine's power. Raises OSError."""
    if sys.platform == "win32":  # cannot open folders
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
