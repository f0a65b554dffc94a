"""A file is written whole or stays as it was."""

from __future__ import annotations

from pathlib import Path

import pytest

from vistel.whole_file import whole_file


def test_what_is_written_takes_the_place_of_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "kept"
    for data in (b"first", b"second"):
        with whole_file(path, sync=True) as stream:
            stream.write(data)
            assert not path.exists() or path.read_bytes() == b"first"
        assert path.read_bytes() == data
    assert [*tmp_path.iterdir()] == [path]


def test_after_an_error_the_old_file_is_all_there_is(tmp_path: Path) -> None:
    path = tmp_path / "kept"
    path.write_bytes(b"old")

    def fail() -> None:
        with whole_file(path) as stream:
            stream.write(b"half of the n")
            raise ValueError("no more")

    with pytest.raises(ValueError, match="no more"):
        fail()
    assert path.read_bytes() == b"old" and [*tmp_path.iterdir()] == [path]


def test_only_a_private_file_is_closed_to_others(tmp_path: Path) -> None:
    with whole_file(tmp_path / "mine", private=True), whole_file(tmp_path / "ours"):
        pass
    mine, ours = ((tmp_path / name).stat().st_mode & 0o077 for name in ("mine", "ours"))
    assert mine == 0 and ours != 0
