"""Pictures that other programs of this machine read from memory: a file that both map, in which a ring of pictures lies.

All numbers are little-endian. The file begins with a head of 64 bytes:

    0   8 bytes   "VISTEL1" and a zero
    8   u32       pictures in the ring
    12  u32       bytes of each with its own head
    16  u32 u32   width and height, pixels
    24  u32       what a pixel is: 1, bytes red green blue alpha
    28  u32       bytes of a row; the first one is the picture's top
    32  u64       number of the newest whole picture, counted from 1; 0: none yet
    40  u64       1 while somebody writes; 0 when they have ended

and picture n lies in place n mod the ring's length, with a head of 64 bytes before its pixels:

    0   u64       odd while it is being written (a seqlock): read it before and after, and again if it was odd or has changed
    8   u64       its number
    16  u64       conference time at which it was drawn [ns]
"""

import contextlib
import mmap
import os
import struct
import tempfile
import threading
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vistel.arrays import U8, U64

MAGIC = b"VISTEL1\0"
RGBA = 1
HEAD = struct.Struct("<8sIIIIII")
HEAD_BYTES = 64
# Places in the file's head, counted in u64.
_NEWEST = 32 // 8
_OPEN = 40 // 8
# Places in a picture's head, counted in u64.
_LOCK = 0
_NUMBER = 1
_TIME = 2
_PICTURES = 3
_TRIES = 8
_PAGE = 4096
_U64: np.dtype[np.uint64] = np.dtype("<u8")


def shared_path(conference: str, site: str) -> Path:
    """Where the pictures of a site lie: in memory where the system has files in memory (the POSIX shared memory object
    /vistel-CONFERENCE-SITE of Linux), else in the folder of temporary files."""
    memory = Path("/dev/shm")
    return (memory if memory.is_dir() else Path(tempfile.gettempdir())) / f"vistel-{conference}-{site}"


@dataclass(frozen=True, eq=False)
class SharedPicture:
    """number: counted from 1; t_ns: conference time at which it was drawn; rgba: (height, width, 4), first row at the top."""

    number: int
    t_ns: int
    rgba: U8


class PictureWriter:
    """Puts pictures where `PictureReader`s see them; never waits for one."""

    def __init__(self, path: Path, width: int, height: int) -> None:
        """What lies at `path` is replaced; who reads that goes on doing so, and finds it `gone`. Raises OSError."""
        self.path = path
        stride = 4 * width
        place = -(-(HEAD_BYTES + stride * height) // _PAGE) * _PAGE
        size = _PAGE + _PICTURES * place
        # Everybody may write into that folder: a new file of a random name, which nobody can have put there before.
        fd, name = tempfile.mkstemp(prefix=f"{path.name}.", dir=path.parent)
        unfinished = Path(name)
        try:
            if hasattr(os, "posix_fallocate"):  # a full memory is told here, and not by a signal while drawing
                os.posix_fallocate(fd, 0, size)
            os.ftruncate(fd, size)
            self._memory = mmap.mmap(fd, size)
            self._memory[: HEAD.size] = HEAD.pack(MAGIC, _PICTURES, place, width, height, RGBA, stride)
            self._ring = _Ring(self._memory, _PICTURES, place, width, height, stride)
            self._ring.head[_OPEN] = 1
            os.replace(unfinished, path)
            self._inode = os.fstat(fd).st_ino
        except OSError:
            unfinished.unlink(missing_ok=True)
            raise
        finally:
            os.close(fd)
        self._number = 0

    def next_place(self) -> U8:
        """Where the next picture is to be written, (height, width, 4), first row at the top; then `done`."""
        head = self._ring.heads[(self._number + 1) % _PICTURES]
        head[_LOCK] |= np.uint64(1)
        _fence()
        return self._ring.pixels[(self._number + 1) % _PICTURES]

    def done(self, t_ns: int) -> None:
        """The picture drawn at `t_ns` is whole."""
        self._number += 1
        head = self._ring.heads[self._number % _PICTURES]
        head[_NUMBER], head[_TIME] = self._number, t_ns
        _fence()
        head[_LOCK] += np.uint64(1)
        _fence()
        self._ring.head[_NEWEST] = self._number

    def close(self) -> None:
        """No more come; the file goes, unless somebody else has put theirs there."""
        self._ring.head[_OPEN] = 0
        with contextlib.suppress(OSError):
            if self.path.stat().st_ino == self._inode:
                self.path.unlink()
        del self._ring
        self._memory.close()


class PictureReader:
    """Sees the pictures that lie at a path."""

    def __init__(self, path: Path) -> None:
        """Raises OSError when nothing is there; ValueError when it is something else, or somebody else's."""
        self.path = path
        with path.open("rb") as file:
            found = os.fstat(file.fileno())
            if hasattr(os, "getuid") and os.getuid() not in (0, found.st_uid):
                raise ValueError(f"{path}: belongs to another user of this machine")
            self._inode, size = found.st_ino, found.st_size
            head = file.read(HEAD.size).ljust(HEAD.size, b"\0")
            magic: bytes = HEAD.unpack(head)[0]
            numbers: tuple[int, ...] = HEAD.unpack(head)[1:]
            pictures, place, self.width, self.height, form, stride = numbers
            whole = magic == MAGIC and form == RGBA and stride >= 4 * self.width and size >= _PAGE + pictures * place
            if not whole or place < HEAD_BYTES + stride * self.height or not pictures:
                raise ValueError(f"{path}: holds no pictures of VISTEL")
            self._memory = mmap.mmap(file.fileno(), 0, prot=mmap.PROT_READ)
        self._count = pictures
        self._ring = _Ring(self._memory, pictures, place, self.width, self.height, stride)

    @property
    def gone(self) -> bool:
        """No more pictures come: whoever wrote has ended, or has begun anew, for which another reader is to be opened."""
        try:
            return not self._ring.head[_OPEN] or self.path.stat().st_ino != self._inode
        except OSError:
            return True

    def newest(self, after: int = 0) -> SharedPicture | None:
        """A copy of the newest picture, if its number is above `after`; None too while all are being overwritten as they are
        read, which takes a reader that is slower than two pictures."""
        for _ in range(_TRIES):
            number = int(self._ring.head[_NEWEST])
            if number <= after:
                return None
            head = self._ring.heads[number % self._count]
            before = int(head[_LOCK])
            _fence()
            picture = SharedPicture(int(head[_NUMBER]), int(head[_TIME]), self._ring.pixels[number % self._count].copy())
            _fence()
            if before % 2 == 0 and int(head[_LOCK]) == before:
                return picture
        return None

    def close(self) -> None:
        """Let go of it."""
        del self._ring
        self._memory.close()


class _Ring:
    """Views of the mapped file. Numbers of 8 bytes are read and written whole."""

    def __init__(self, memory: mmap.mmap, count: int, place: int, width: int, height: int, stride: int) -> None:
        every: U8 = np.frombuffer(memory, np.uint8)
        self.head: U64 = every[:HEAD_BYTES].view(_U64)
        self.heads: list[U64] = []
        self.pixels: list[U8] = []
        for k in range(count):
            begin = _PAGE + k * place
            self.heads.append(every[begin : begin + HEAD_BYTES].view(_U64))
            rows = every[begin + HEAD_BYTES : begin + HEAD_BYTES + height * stride].reshape(height, stride)
            self.pixels.append(rows[:, : 4 * width].reshape(height, width, 4))


_BARRIER = threading.Lock()


def _fence() -> None:
    """What was written before is seen before what is written after; what is read, likewise (taking a lock orders memory)."""
    for _ in range(2):
        with _BARRIER:
            pass
