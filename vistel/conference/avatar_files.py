"""Where avatars from files lie on this machine: a participant's own file, and parcels that came from other sites."""

from __future__ import annotations

import contextlib
import logging
import os
import tempfile
from pathlib import Path

from vistel.conference.model import Participant
from vistel.figure.avatar_builtin import default_cache
from vistel.figure.parcel import ENDING
from vistel.wire.parcels import MOST_BYTES, digest_of, is_digest

log = logging.getLogger("vistel.avatars")

MOST_KEPT = 512 << 20
"""Bytes of parcels in the avatar folder; those not used for longest go first."""


def avatar_file(participant: Participant) -> Path | None:
    """The file, whether it is there or not: beside the conference file, or in the avatar folder; None for a built-in person."""
    if participant.avatar.startswith("builtin"):
        return None
    path = Path(participant.avatar)
    return path if path.is_absolute() else default_cache() / path.name


def parcel_path(digest: str) -> Path:
    """Where the parcel of that digest is kept. Raises ValueError for what is no digest."""
    if not is_digest(digest):
        raise ValueError(f"parcel: expected 32 hexadecimal digits, got {digest!r}")
    return default_cache() / f"parcel-{digest}{ENDING}"


def kept_parcel(digest: str) -> bytes | None:
    """The parcel, if it is kept here and whole."""
    path = parcel_path(digest)
    try:
        if path.stat().st_size > MOST_BYTES:
            return None
        data = path.read_bytes()
        os.utime(path)
    except OSError:
        return None
    if digest_of(data) != digest:
        log.warning("event=parcel_damaged path=%s action=fetched_again", path)
        return None
    return data


def keep_parcel(digest: str, data: bytes) -> bool:
    """Put a parcel into the avatar folder, whole or not at all; False, and a line in the log, when the disk refuses."""
    path = parcel_path(digest)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, part = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".part")
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.write(data)
            os.replace(part, path)
        except BaseException:
            Path(part).unlink(missing_ok=True)
            raise
    except OSError as fault:
        log.warning("event=parcel_not_kept path=%s reason=%r", path, fault.strerror or str(fault))
        return False
    _make_room(path.parent)
    return True


def _make_room(folder: Path) -> None:
    kept: list[tuple[int, int, Path]] = []
    total = 0
    with contextlib.suppress(OSError):  # another process makes room too
        kept += [(p.stat().st_mtime_ns, p.stat().st_size, p) for p in folder.glob(f"parcel-*{ENDING}")]
        for _, size, path in sorted(kept, reverse=True):
            total += size
            if total > MOST_KEPT:
                path.unlink(missing_ok=True)
