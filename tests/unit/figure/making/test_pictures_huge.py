"""Pictures of 16,384 texels and more along a side: made smaller within a bound of memory, or refused before they are unpacked."""

from __future__ import annotations

import struct
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

from vistel.figure.making.pictures import alpha_of

SIDE = 16384
BLACK_IS_CLEAR = struct.pack(">I", 2) + b"tRNS\0\0" + struct.pack(">I", zlib.crc32(b"tRNS\0\0"))
"""A chunk of a PNG that makes its black transparent."""


def grey_png(width: int, height: int, more: bytes = b"") -> bytes:
    """A PNG of one bit a texel, left half black, right half white: a few kilobytes, however large. more: chunks before it."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    row = b"\0" + b"\0" * (width // 16) + b"\xff" * (-(-width // 8) - width // 16)
    packer = zlib.compressobj(1)
    packed = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    head = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + more + chunk(b"IDAT", packed) + chunk(b"IEND", b"")


_READ = """
import resource, sys
from pathlib import Path
from vistel.figure.making.pictures import read_picture
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
notes = []
picture = read_picture(Path(sys.argv[1]), notes)
took = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
print(took // 1024, "none" if picture is None else [*picture.shape, *picture[9, 9].tolist(), *picture[9, -9].tolist()], notes)
"""


def read(path: Path) -> tuple[int, str]:
    """Megabytes it took at most, and what came of it; in a process of its own, whose memory is its alone."""
    done = subprocess.run([sys.executable, "-c", _READ, str(path)], capture_output=True, text=True, check=True, timeout=600)
    took, _, rest = done.stdout.strip().partition(" ")
    return int(took), rest


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory is counted in kilobytes on Linux")
def test_one_of_16k_is_made_smaller_with_a_line_and_takes_no_more_memory_than_its_own_texels(tmp_path: Path) -> None:
    path = tmp_path / "huge.png"
    path.write_bytes(grey_png(SIDE, SIDE))
    assert path.stat().st_size < 1_000_000
    took, rest = read(path)
    assert rest == f"[2048, 2048, 3, 0, 0, 0, 255, 255, 255] ['texture huge.png: {SIDE} by {SIDE}, made 2048 by 2048']"
    assert took < SIDE * SIDE / 2**20 + 200


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory is counted in kilobytes on Linux")
def test_a_bomb_is_refused_before_it_goes_off(tmp_path: Path) -> None:
    path = tmp_path / "bomb.png"
    path.write_bytes(grey_png(60_000, 60_000))
    assert path.stat().st_size < 3_000_000  # 14 GB once unpacked
    took, rest = read(path)
    assert rest.startswith("none ['texture bomb.png: 60000 by 60000, expected at most 268,435,456 texels; make it smaller;")
    assert took < 60


def test_one_of_16k_keeps_its_opacity() -> None:
    opacity = alpha_of(grey_png(SIDE, 3 * SIDE // 4, BLACK_IS_CLEAR))
    assert opacity is not None
    assert opacity.shape == (1536, 2048)
    assert opacity[9, 9] == 0
    assert opacity[9, -9] == 255


def test_no_opacity_is_read_of_a_bomb_nor_of_a_picture_that_has_none() -> None:
    assert alpha_of(grey_png(60_000, 60_000, BLACK_IS_CLEAR)) is None
    assert alpha_of(grey_png(64, 64)) is None
    assert alpha_of(b"nothing") is None
