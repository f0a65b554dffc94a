"""What Python's parser raises for no fault of a file is no fault of the file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vistel.figure.formats.avatar_file import load_avatar
from vistel.figure.people.builtin import builtin_avatar
from vistel.undisturbed import undisturbed


def test_reading_is_begun_again_where_the_parser_was_disturbed_and_fails_where_it_always_is() -> None:
    tries: list[int] = []

    @undisturbed
    def read(least: int) -> str:
        tries.append(least)
        if len(tries) < least:
            raise SystemError("AST constructor recursion depth mismatch (before=51, after=42)")
        return "read"

    assert read(3) == "read"
    tries.clear()
    with pytest.raises(SystemError, match="AST"):
        read(99)


def test_an_avatar_comes_where_another_thread_disturbs_the_reading_of_its_third_array(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    builtin_avatar("builtin:person=ben", name="ben", height=1.8, cache=tmp_path)
    path = next(tmp_path.rglob("*.avatar"), None) or max(tmp_path.rglob("*.*"), key=lambda p: p.stat().st_size)
    wanted, read, tries = load_avatar(path), np.lib.format.read_array, []

    def disturbed(*given: Any, **named: Any) -> Any:
        tries.append(1)
        if len(tries) == 3:
            raise SystemError("AST constructor recursion depth mismatch (before=51, after=42)")
        return read(*given, **named)

    monkeypatch.setattr(np.lib.format, "read_array", disturbed)
    monkeypatch.setattr("numpy.lib._npyio_impl.format.read_array", disturbed)
    again = load_avatar(path)
    assert len(tries) > 3
    assert np.array_equal(again.mesh.vertices, wanted.mesh.vertices)
