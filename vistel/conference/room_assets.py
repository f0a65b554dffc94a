"""Meshes and pictures of rooms whose files are at another site, kept on this machine under their digests."""

import logging
from pathlib import Path

from vistel.arrays import U8
from vistel.conference.kept import make_room, read_kept, write_whole
from vistel.figure.avatar.cache_folder import default_cache
from vistel.space.files.model import Polymesh
from vistel.space.files.travel import pictures_in, unpack_model, unpack_picture
from vistel.wire.parcels import MOST_BYTES, is_digest

log = logging.getLogger("vistel.rooms")

MOST_KEPT = 512 << 20
"""Size of all assets on this machine [bytes]; the least recently used are removed first."""
_ENDING = ".asset"


def kept_asset(digest: str) -> bytes | None:
    """The packed polymesh or picture, if it is kept here; unpacking it shows whether it is whole."""
    return read_kept(_path(digest), MOST_BYTES)


def keep_asset(digest: str, data: bytes) -> None:
    """Write it, whole or not at all; a line in the log where it cannot be written."""
    path = _path(digest)
    try:
        write_whole(path, data)
    except OSError as fault:
        log.warning("event=room_asset_not_kept path=%s reason=%r", path, fault.strerror or str(fault))
        return
    make_room(path.parent, f"*{_ENDING}", MOST_KEPT)


def forget_asset(digest: str) -> None:
    """Remove one that is damaged."""
    _path(digest).unlink(missing_ok=True)


def kept_model(digest: str, pictures: dict[str, U8]) -> Polymesh | None:
    """The polymesh with its pictures, if all of it is kept here and whole. pictures: those read before; new ones are added."""
    if not is_digest(digest) or (data := kept_asset(digest)) is None:
        return None
    try:
        for name in pictures_in(data):
            packed = kept_asset(name) if is_digest(name) and name not in pictures else None
            if packed is not None:
                pictures[name] = unpack_picture(packed, name)
            if name not in pictures:
                return None
        return unpack_model(data, digest, pictures)
    except ValueError as fault:
        log.warning("event=room_asset_damaged digest=%s reason=%r action=fetched_again", digest, str(fault))
        forget_asset(digest)
        return None


def _path(digest: str) -> Path:
    if not is_digest(digest):
        raise ValueError(f"asset: expected 32 hexadecimal digits, got {digest!r}")
    return default_cache().parent / "assets" / f"{digest}{_ENDING}"
