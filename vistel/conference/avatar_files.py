"""Where avatar files are on this machine: a participant's own file, and parcels received from other sites."""

import logging
from pathlib import Path

from vistel.conference.kept import make_room, read_kept, write_whole
from vistel.conference.model import Participant
from vistel.figure.avatar.cache_folder import default_cache
from vistel.figure.formats.parcel import ENDING
from vistel.wire.parcels import MOST_BYTES, digest_of, is_digest

log = logging.getLogger("vistel.avatars")

MOST_KEPT = 512 << 20
"""Size of all parcels in the avatar folder [bytes]; the least recently used are removed first."""


def avatar_file(participant: Participant) -> Path | None:
    """The file, whether it is there or not: beside the conference file, or in the avatar folder; None for a built-in person."""
    if participant.avatar.startswith("builtin"):
        return None
    path = Path(participant.avatar)
    return path if path.is_absolute() else default_cache() / path.name


def parcel_path(digest: str) -> Path:
    """Where the parcel of that digest is kept. Raises ValueError where it is not a digest."""
    if not is_digest(digest):
        raise ValueError(f"parcel: expected 32 hexadecimal digits, got {digest!r}")
    return default_cache() / f"parcel-{digest}{ENDING}"


def kept_parcel(digest: str) -> bytes | None:
    """The parcel, if it is kept here and whole."""
    path = parcel_path(digest)
    data = read_kept(path, MOST_BYTES)
    if data is None:
        return None
    if digest_of(data) != digest:
        log.warning("event=parcel_damaged path=%s action=fetched_again", path)
        return None
    return data


def keep_parcel(digest: str, data: bytes) -> bool:
    """Write a parcel into the avatar folder, whole or not at all. False, and a line in the log, where it cannot be written."""
    path = parcel_path(digest)
    try:
        write_whole(path, data)
    except OSError as fault:
        log.warning("event=parcel_not_kept path=%s reason=%r", path, fault.strerror or str(fault))
        return False
    make_room(path.parent, f"parcel-*{ENDING}", MOST_KEPT)
    return True
