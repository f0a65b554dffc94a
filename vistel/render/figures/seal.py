"""Seals of files that only this user's processes may have written: a message authentication code under a key of the user's own.

The key lies in the user's state folder, apart from what it seals, so that writing where the files lie is not enough. The code is
GMAC (AES-256-GCM that encrypts nothing, NIST SP 800-38D), which takes 2 ms for a figure of 41 MB where BLAKE2b takes 80.
"""

import logging
import os
import stat
from collections.abc import Iterable, Sequence
from pathlib import Path

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers import Cipher
from cryptography.hazmat.primitives.ciphers.algorithms import AES256
from cryptography.hazmat.primitives.ciphers.modes import GCM

from vistel.arrays import U8
from vistel.figure.avatar.cache_folder import default_state, file_lock
from vistel.whole_file import whole_file

log = logging.getLogger("vistel.renderer")

_KEY_BYTES = 32
_NONCE_BYTES = 12
_SEAL_BYTES = _NONCE_BYTES + 16
"""A nonce, drawn anew for each seal, and GCM's tag."""


def own_key(folder: Path | None = None) -> bytes | None:
    """The key of this user, made where there is none; None, with a line in the log, where none can be kept. folder: where it lies,
    `default_state()` by default."""
    path = (default_state() if folder is None else folder) / "figures.key"
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if (key := _read_key(path)) is not None:
            return key
        with file_lock(path.with_suffix(".lock")):
            if (key := _read_key(path)) is None:
                with whole_file(path, private=True) as stream:
                    stream.write(key := os.urandom(_KEY_BYTES))
        return key
    except OSError as fault:
        log.warning("event=no_key_for_figures path=%s reason=%r action=none_kept", path, str(fault))
        return None


def _read_key(path: Path) -> bytes | None:
    """None where there is none, or one that others know or have put there."""
    try:
        with path.open("rb") as file:
            found = os.fstat(file.fileno())
            alone = not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & (stat.S_IRWXG | stat.S_IRWXO))
            key = file.read(_KEY_BYTES + 1)
    except FileNotFoundError:
        return None
    return key if alone and len(key) == _KEY_BYTES else None


def seal(key: bytes, name: str, pieces: Iterable[bytes | memoryview]) -> bytes:
    """What to write behind the pieces of a file called `name`."""
    nonce = os.urandom(_NONCE_BYTES)
    sealing = Cipher(AES256(key), GCM(nonce)).encryptor()
    for piece in _named(name, pieces):
        sealing.authenticate_additional_data(piece)
    sealing.finalize()
    return nonce + sealing.tag


def unsealed(key: bytes, name: str, data: U8) -> U8 | None:
    """The bytes before the seal of a file; None where they, or their name, are not as they were sealed."""
    body, end = data[:-_SEAL_BYTES], data[-_SEAL_BYTES:].tobytes()
    if len(end) < _SEAL_BYTES:
        return None
    opening = Cipher(AES256(key), GCM(end[:_NONCE_BYTES], end[_NONCE_BYTES:])).decryptor()
    for piece in _named(name, [body.data]):
        opening.authenticate_additional_data(piece)
    try:
        opening.finalize()
    except InvalidTag:
        return None
    return body


def _named(name: str, pieces: Iterable[bytes | memoryview]) -> Sequence[bytes | memoryview]:
    """With the name before them, so that no file passes for another."""
    text = name.encode()
    return [len(text).to_bytes(8, "little"), text, *pieces]
