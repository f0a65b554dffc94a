"""A lease among the worlds of one machine: a lock of the operating system, which goes with the process that holds it.

FILE.lock is locked, FILE has what is known of the holder. A process that hangs holds it until it is killed. A disk that refuses
ends no room: then the lock, if it can be had, keeps others out, and nothing is noted.
"""

from __future__ import annotations

import json
import logging
import math
import os
import sys
import tempfile
from dataclasses import asdict, replace
from pathlib import Path

from vistel.whole_file import whole_file
from vistel.wire.lease.lease import Holder, LeaseStoreError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl


log = logging.getLogger("vistel.world")


class FileLease:
    """See `Lease`. Its folder must be on a disk of this machine; None, or one that cannot be written: one of its own, so that it is
    shared with nobody."""

    lasts_s = math.inf

    def __init__(self, path: Path | None, place: str) -> None:
        path = path if path is not None and _writable(path) else None
        self._own = tempfile.TemporaryDirectory(prefix="vistel-lease-") if path is None else None
        self._path, self._place = path or Path(self._own.name if self._own else "", "lease"), place
        self._lock = _lock_of(self._path)
        self._handle = -1
        self._known = Holder()

    async def holder(self) -> Holder:
        """As `Lease.holder`."""
        if self._handle >= 0:
            return self._known
        try:
            handle = self._locked()
            if handle >= 0:
                os.close(handle)
            return replace(self._read(), held=handle < 0)
        except OSError as e:
            raise self._error(e) from e

    async def acquire(self, seen: Holder, term: int) -> bool:
        """As `Lease.acquire`."""
        if self._handle >= 0:
            return False
        taken = False
        try:
            self._handle = self._locked()
            if self._handle >= 0 and (known := self._read()).term == seen.term:
                self._write(replace(known, term=term, held=True))
                taken = True
        except OSError as e:
            raise self._error(e) from e
        finally:
            if not taken:
                await self.release()
        return taken

    async def renew(self) -> bool:
        """As `Lease.renew`. A lock whose file has been taken away keeps nobody out any more."""
        try:
            return self._handle >= 0 and os.path.samestat(os.fstat(self._handle), self._lock.stat())
        except OSError:
            return False

    async def note_led(self) -> bool:
        """As `Lease.note_led`."""
        if not await self.renew():
            return False
        self._write(replace(self._known, led_term=self._known.term, led_place=self._place))
        return True

    async def release(self) -> None:
        """As `Lease.release`."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1

    close = release

    def _locked(self) -> int:
        """The lock's file, locked; -1 if somebody else has it."""
        self._lock.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(self._lock, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            if sys.platform == "win32":
                msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
            else:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):
            os.close(handle)
            return -1
        return handle

    def _read(self) -> Holder:
        try:
            return Holder(**json.loads(self._path.read_bytes()))
        except FileNotFoundError:
            return Holder()
        except (ValueError, TypeError) as e:
            raise LeaseStoreError(f"{self._path} holds no lease; remove it") from e

    def _write(self, known: Holder) -> None:
        self._known = known
        try:
            with whole_file(self._path, private=True, sync=True) as out:
                out.write(json.dumps(asdict(known)).encode())
        except OSError as e:
            log.error("leader not noted path=%s reason=%r", self._path, e.strerror)

    def _error(self, error: OSError) -> LeaseStoreError:
        return LeaseStoreError(f"{self._path}: {error.strerror}")


def _lock_of(path: Path) -> Path:
    return path.with_name(path.name + ".lock")


def _writable(path: Path) -> bool:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _lock_of(path).touch(0o600)
    except OSError as e:
        log.error("lease not shared path=%s reason=%r; worlds beside this one do not know of it", path, e.strerror)
        return False
    return True
