"""Pictures in shared memory: another process sees whole ones, whoever is faster and however either ends."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from vistel.wire.shared_pictures import HEAD, PictureReader, PictureWriter, shared_path

WIDTH, HEIGHT = 320, 200


def put(writer: PictureWriter, number: int) -> None:
    """A picture all of whose bytes follow from its number."""
    writer.next_place()[:] = np.uint8(number % 251)
    writer.done(number * 1000)


def test_what_is_written_is_read_with_its_time(tmp_path: Path) -> None:
    writer = PictureWriter(tmp_path / "p", 17, 11)
    reader = PictureReader(tmp_path / "p")
    assert reader.newest() is None
    picture = np.random.default_rng(1).integers(0, 255, (11, 17, 4), np.uint8)
    writer.next_place()[:] = picture
    assert reader.newest() is None, "not before it is done"
    writer.done(123_456_789_012_345_678)
    got = reader.newest()
    assert got is not None
    assert (got.number, got.t_ns) == (1, 123_456_789_012_345_678)
    np.testing.assert_array_equal(got.rgba, picture)
    assert reader.newest(after=1) is None
    for k in range(2, 9):
        put(writer, k)
    got = reader.newest(after=1)
    assert got is not None
    assert got.number == 8
    reader.close()
    writer.close()


READ = """
import sys
from pathlib import Path
from vistel.wire.shared_pictures import PictureReader

reader = PictureReader(Path(sys.argv[1]))
print("ready", flush=True)
last = seen = 0
while True:
    gone = reader.gone
    picture = reader.newest(after=last)
    if picture is None:
        if gone:
            break
        continue
    assert picture.number > last, (picture.number, last)
    assert picture.t_ns == picture.number * 1000, (picture.number, picture.t_ns)
    assert (picture.rgba == picture.number % 251).all(), f"torn: {picture.number}"
    last, seen = picture.number, seen + 1
print(last, seen)
"""


def test_a_reader_in_another_process_never_sees_half_a_picture(tmp_path: Path) -> None:
    writer = PictureWriter(tmp_path / "p", WIDTH, HEIGHT)
    reader = subprocess.Popen([sys.executable, "-c", READ, tmp_path / "p"], stdout=subprocess.PIPE, text=True)
    assert reader.stdout is not None
    assert reader.stdout.readline() == "ready\n"
    for k in range(1, 4001):
        put(writer, k)  # as fast as it goes: pictures are overwritten under the reader
    writer.close()
    out, _ = reader.communicate(timeout=600)
    assert reader.returncode == 0
    last, seen = map(int, out.split())
    assert last == 4000
    assert seen >= 1


def test_a_writer_that_died_in_the_middle_leaves_the_newest_whole_picture(tmp_path: Path) -> None:
    writer = PictureWriter(tmp_path / "p", 8, 8)
    for k in range(1, 4):
        put(writer, k)
    writer.next_place()[:4] = 99
    reader = PictureReader(tmp_path / "p")
    got = reader.newest()
    assert got is not None
    assert got.number == 3
    assert (got.rgba == 3).all()


def test_who_begins_anew_takes_the_place_and_old_readers_find_out(tmp_path: Path) -> None:
    old = PictureWriter(tmp_path / "p", 8, 8)
    reader = PictureReader(tmp_path / "p")
    assert not reader.gone
    new = PictureWriter(tmp_path / "p", 16, 16)
    assert reader.gone
    old.close()
    assert PictureReader(tmp_path / "p").width == 16, "the old one took away what is not its own"
    new.close()
    assert not (tmp_path / "p").exists()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"VISTEL1\0",
        b"x" * 100_000,
        HEAD.pack(b"VISTEL1\0", 3, 1 << 30, 8, 8, 1, 32),
        HEAD.pack(b"VISTEL1\0", 0, 4096, 8, 8, 1, 32),
        HEAD.pack(b"VISTEL1\0", 1, 4096, 8, 8, 2, 32) + bytes(9000),
        HEAD.pack(b"VISTEL1\0", 1, 4096, 800, 800, 1, 3200) + bytes(9000),
    ],
)
def test_what_holds_no_pictures_is_refused_by_its_name(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "p").write_bytes(content)
    with pytest.raises(ValueError, match="holds no pictures"):
        PictureReader(tmp_path / "p")


def test_a_place_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="p"):
        PictureWriter(tmp_path / "no" / "p", 8, 8)


def test_sites_of_a_machine_have_places_of_their_own() -> None:
    assert shared_path("demo", "tokyo").name == "vistel-demo-tokyo"
    assert shared_path("demo", "tokyo") != shared_path("demo", "columbus")
