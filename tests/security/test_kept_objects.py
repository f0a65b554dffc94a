"""Somebody puts a file where figures are kept. What it needs: to write as the user, which is why it must not run what it holds."""

from __future__ import annotations

import contextlib
import json
import pickle
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.figure.avatar.avatar import Target
from vistel.figure.face.rules import builtin_rules
from vistel.render.figures.object_file import ObjectFileError, from_bytes, to_bytes


def kept(value: Any) -> np.ndarray[Any, Any]:
    return np.frombuffer(bytearray(b"".join(bytes(p) for p in to_bytes(value))), np.uint8)


def headed(*values: Any) -> np.ndarray[Any, Any]:
    """A file whose values are these, the first of all."""
    head = json.dumps([0, list(values)]).encode()
    return np.frombuffer(b"VISTEL objects 1\n" + len(head).to_bytes(8, "little") + head + bytes(64), np.uint8)


def test_what_is_kept_comes_back_to_the_last_bit_and_what_was_shared_is_shared() -> None:
    target = Target("smile", np.arange(3, dtype=np.int32), np.asfortranarray(np.random.default_rng(1).random((3, 4)) * np.pi))
    made = {"a": target, 1: (target, None, True, 0.1, {2, 3}, frozenset({"b"})), "n": [np.float32(1 / 3), np.empty((0, 3))]}
    made["self"] = made
    back: Any = from_bytes(kept(made))
    assert back["a"] is back[1][0] and back["self"] is back
    assert back["a"].offset.tobytes() == target.offset.tobytes() and back["a"].offset.flags.f_contiguous
    assert back["a"].vertex.dtype == np.int32 and back["a"].vertex.flags.writeable and back["a"].vertex.flags.aligned
    assert back[1][1:] == (None, True, 0.1, {2, 3}, frozenset({"b"}))
    assert back["n"][0] == np.float32(1 / 3) and type(back["n"][0]) is np.float32 and back["n"][1].shape == (0, 3)


def test_rules_of_a_face_come_back_with_all_their_fields() -> None:
    unit = builtin_rules().units[0].unit
    back: Any = from_bytes(kept(unit))
    assert back == unit and back.name == unit.name


@pytest.mark.parametrize(
    "values",
    [
        [["object", "os", "system"]],
        [["object", "subprocess", "Popen"]],
        [["object", "vistel.render.figures.cache", "os"]],
        [["object", "vistel.render.figures.cache", "Path"]],
        [["object", "vistel.render.figures.cache", "cached_figure"]],
        [["object", "vistel.nowhere", "Nothing"]],
        [["method", 1, "__class__"], ["object", "vistel.figure.avatar.avatar", "Target"]],
        [["method", 1, "system"], "os"],
        [["reduce", 1], "os"],
        [["array", "|O", 0, 1]],
        [["array", "<f8", 0, 10**12]],
        [["array", "<f8", -8, 1]],
        [["array", "<f8", 0, -1]],
        [["list", 7]],
        [["tuple", 0]],
    ],
)
def test_a_file_that_names_what_it_may_not_is_damaged(values: list[Any]) -> None:
    with pytest.raises(ObjectFileError):
        from_bytes(headed(*values))


def test_a_pickle_is_not_read(tmp_path: Path) -> None:
    class Attack:
        def __reduce__(self) -> Any:
            return (Path.touch, (tmp_path / "attacked",))

    with pytest.raises(ObjectFileError):
        from_bytes(np.frombuffer(pickle.dumps(Attack()), np.uint8))
    assert not (tmp_path / "attacked").exists()


@given(st.binary(max_size=300))
def test_any_bytes_are_read_or_damaged(data: bytes) -> None:
    for start in (b"", bytes(kept([1, "a", np.arange(3.0)]))[: 25 + len(data) % 60]):
        with contextlib.suppress(ObjectFileError):
            from_bytes(np.frombuffer(start + data, np.uint8))


@dataclass
class _Foreign:
    value: list[int] = field(default_factory=list)


@pytest.mark.parametrize("value", [_Foreign(), np.array([object()]), open, b"bytes"])
def test_what_could_not_be_read_again_is_not_kept(value: Any) -> None:
    with pytest.raises(ObjectFileError, match="cannot be kept"):
        to_bytes(value)
