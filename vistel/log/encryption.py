"""Logs at rest that only holders of a key read: files of age (age-encryption.org/v1), written and read by pyrage.

A key is one of age (AGE-SECRET-KEY-1..., public age1...) or of SSH (ed25519 or RSA). The program age reads and writes the same
files.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import pyrage

from vistel.whole_file import whole_file

if TYPE_CHECKING:
    from vistel.log.redact import Progress

MOST_KEY_BYTES = 65_536
"""Of a file with keys; a larger one is none."""
_SSH_PRIVATE = "-----BEGIN "
_AGE_PRIVATE = "AGE-SECRET-KEY-"


class EncryptionError(ValueError):
    """A key is none or not the right one, or the file is not whole; one line for a person."""


def new_key(path: Path) -> str:
    """Write a new key, which only its owner may read, and beside it its public part, as NAME.pub, which is returned. Raises
    OSError."""
    key = pyrage.x25519.Identity.generate()
    public = str(key.to_public())
    with whole_file(path, private=True) as stream:
        stream.write(f"# public key: {public}\n{key}\n".encode())
    with whole_file(public_file(path)) as stream:
        stream.write(f"{public}\n".encode())
    return public


def public_file(key: Path) -> Path:
    """Where the public part of a key is."""
    return key.with_name(f"{key.name}.pub")


def encrypt(source: Path, output: Path, keys: Sequence[str], progress: Progress) -> None:
    """Write `source` so that the holder of any of `keys` can read it. keys: public keys, or files with one a line.

    Raises EncryptionError or OSError; then nothing is written.
    """
    public = [_public(line) for key in keys for line in _lines(key)]
    if not public:
        raise EncryptionError("no key: nobody could read it; give a public key, or a file of them")
    with source.open("rb") as stream, whole_file(output) as written:
        pyrage.encrypt_io(_Counted(stream, source.stat().st_size, progress), written, public)


def decrypt(source: Path, output: Path, key: Path, progress: Progress) -> None:
    """Write what was encrypted for `key`, the file of a private key.

    Raises EncryptionError, also where a byte was changed or the end is missing, or OSError; then nothing is written.
    """
    private = _private(key)
    with source.open("rb") as stream, whole_file(output, private=True) as written:
        try:
            pyrage.decrypt_io(_Counted(stream, source.stat().st_size, progress), written, private)
        except pyrage.DecryptError as e:
            raise EncryptionError(f"{source}: cannot be decrypted with {key}: {e}") from e
        except OSError as e:
            if e.errno is not None:
                raise
            raise EncryptionError(f"{source}: is damaged: a byte was changed, or its end is missing") from e  # pyrage's own


class _Counted:
    """A stream that tells how much of it was read."""

    def __init__(self, stream: BinaryIO, size: int, progress: Progress) -> None:
        self._stream, self._size, self._progress = stream, max(1, size), progress

    def read(self, size: int = -1) -> bytes:
        data = self._stream.read(size)
        self._progress(min(1.0, self._stream.tell() / self._size))
        return data


def _lines(key: str) -> list[str]:
    """A key, or those of the file that `key` names."""
    if key.startswith(("age1", "ssh-", _AGE_PRIVATE, _SSH_PRIVATE)):
        return [key]
    if not Path(key).exists():
        raise EncryptionError(f"{key}: is no public key of age or SSH, and no such file; `vistel log new-key` makes a key")
    return [line for line in map(str.strip, _text(Path(key)).splitlines()) if line and not line.startswith("#")]


def _public(line: str) -> Any:
    if line.startswith((_AGE_PRIVATE, _SSH_PRIVATE)):
        raise EncryptionError("a private key was given; give its public part, which begins with age1 or ssh-")
    kind = pyrage.ssh if line.startswith("ssh-") else pyrage.x25519
    try:
        return kind.Recipient.from_str(line)
    except pyrage.RecipientError as e:
        raise EncryptionError(f"{line[:24]}: is no public key of age or SSH: {e}") from e


def _private(key: Path) -> list[Any]:
    text = _text(key)
    lines = [line for line in map(str.strip, text.splitlines()) if line.startswith(_AGE_PRIVATE)]
    try:
        if text.startswith(_SSH_PRIVATE):
            return [pyrage.ssh.Identity.from_buffer(text.encode())]
        if lines:
            return [pyrage.x25519.Identity.from_str(line) for line in lines]
    except (pyrage.IdentityError, ValueError) as e:
        raise EncryptionError(f"{key}: its key cannot be used: {e}") from e
    raise EncryptionError(f"{key}: holds no private key of age or SSH")


def _text(path: Path) -> str:
    with path.open("rb") as stream:
        data = stream.read(MOST_KEY_BYTES + 1)
    try:
        if len(data) <= MOST_KEY_BYTES:
            return data.decode()
    except UnicodeDecodeError:
        pass
    raise EncryptionError(f"{path}: is no file of keys")
