"""An avatar as bytes that travel: the same on both ends, and nothing else is taken for one."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from avatar_fixture import long_armed
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.figure.avatar.check import AvatarFileError
from vistel.figure.avatar.proportions import Proportions
from vistel.figure.formats import parcel
from vistel.figure.formats.parcel import pack, unpack
from vistel.figure.skeleton import JOINTS


def test_what_is_unpacked_is_what_was_packed() -> None:
    avatar = long_armed()
    again = unpack(pack(avatar), "it")
    assert np.array_equal(again.mesh.vertices, avatar.mesh.vertices)
    assert np.array_equal(again.mesh.corner_triangles, avatar.mesh.corner_triangles)
    assert np.array_equal(again.skeleton.rest, avatar.skeleton.rest)
    assert again.body.names == avatar.body.names and np.array_equal(again.body.radius_b, avatar.body.radius_b)
    assert again.albedo.shape == avatar.albedo.shape
    assert np.abs(again.albedo.astype(float) - avatar.albedo).mean() < 6.0


def test_the_same_avatar_gives_the_same_bytes() -> None:
    assert pack(long_armed()) == pack(replace(long_armed(), name="another name"))


@settings(max_examples=60, deadline=None)
@given(at=st.floats(0, 1, exclude_max=True), value=st.integers(0, 255), cut=st.booleans())
def test_damage_is_reported_in_one_line_or_harms_nothing(at: float, value: int, cut: bool) -> None:
    data = bytearray(pack(long_armed()))
    k = int(at * len(data))
    if cut:
        del data[k:]
    else:
        data[k] = value
    try:
        avatar = unpack(bytes(data), "theirs")
    except AvatarFileError as fault:
        assert str(fault).startswith("theirs: ") and "\n" not in str(fault)
    else:
        assert len(avatar.mesh.vertices) == len(long_armed().mesh.vertices)


def test_a_small_file_that_unpacks_to_a_huge_one_is_refused() -> None:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("level0.mesh0.vertices.npy", bytes(parcel.MOST_UNPACKED + 1))
    arrays = out.getvalue()
    data = parcel._HEAD.pack(b"VISTELAV", 1, len(arrays)) + arrays
    with pytest.raises(AvatarFileError, match=r"theirs: 268 MB of arrays, expected at most 268 MB"):
        unpack(data, "theirs")


def test_triangles_that_point_beyond_the_vertices_are_refused() -> None:
    avatar = long_armed()
    wild = avatar.mesh.triangles.copy()
    wild[5, 1] = len(avatar.mesh.vertices)
    with pytest.raises(AvatarFileError, match="points beyond"):
        pack(replace(avatar, mesh=replace(avatar.mesh, triangles=wild)))


@pytest.mark.parametrize(
    "wrong",
    [
        lambda n: np.full(n, np.nan, np.float32),
        lambda n: np.full(n, -0.1, np.float32),
        lambda n: np.full(n, 1e9, np.float32),
        lambda n: np.zeros(n - 1, np.float32),
        lambda n: np.zeros((n, 2), np.float32),
        lambda n: np.zeros(n, np.int32),
        lambda n: np.full(n, "far"),
    ],
    ids=["nan", "upwards", "far", "too few", "too many", "whole", "words"],
)
def test_what_hangs_in_no_way_that_there_is_is_refused(monkeypatch: pytest.MonkeyPatch, wrong: Callable[[int], Any]) -> None:
    avatar = long_armed()
    hung = replace(avatar, mesh=replace(avatar.mesh, hangs=wrong(len(avatar.mesh.vertices))))
    with monkeypatch.context() as patched:
        patched.setattr(parcel, "check_avatar", lambda *_: None)
        data = pack(hung)
    with pytest.raises(AvatarFileError, match="theirs: how far each vertex hangs"):
        unpack(data, "theirs")


def test_levels_of_detail_that_do_not_agree_whether_something_hangs_are_refused() -> None:
    avatar = long_armed()
    hung = replace(avatar.mesh, hangs=np.zeros(len(avatar.mesh.vertices), np.float32))
    with pytest.raises(AvatarFileError, match="some levels of detail say what hangs"):
        pack(replace(avatar, mesh=hung, coarser=(avatar,)))


def test_a_parcel_of_a_later_format_says_what_to_do() -> None:
    data = bytearray(pack(long_armed()))
    data[8] = 9
    with pytest.raises(AvatarFileError, match="parcel format 9, expected 1; update"):
        unpack(bytes(data), "theirs")


def test_proportions_are_those_of_the_avatar_and_can_be_compared() -> None:
    avatar = long_armed()
    limbs = Proportions.of(avatar.skeleton, avatar.body)
    assert np.allclose(limbs.skeleton.rest, avatar.skeleton.rest, atol=1e-6)
    assert np.allclose(limbs.body.radius_a, avatar.body.radius_a, atol=1e-6)
    assert limbs == Proportions.from_arrays(limbs.names, limbs.joint, *limbs.arrays)
    assert hash(limbs) == hash(Proportions.of(avatar.skeleton, avatar.body))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"rest": [float("nan")] * 180}, "not finite"),
        ({"rest": [9.0] * 180}, "3.5 m across"),
        ({"rest": [0.0] * 3}, "numbers"),
        ({"radius_a": [0.0]}, "radii"),
        ({"radius_b": [5.0]}, "radii"),
        ({"joint": [len(JOINTS)]}, "joint beyond"),
        ({"names": []}, "0 primitives"),
        ({"names": ["x" * 99]}, "letters"),
        ({"tip": [0.0] * 180, "rest": [0.0] * 180}, "0.00 m tall"),
    ],
)
def test_proportions_nobody_can_have_are_refused(change: dict[str, list[float]], reason: str) -> None:
    avatar = long_armed()
    limbs = {
        "names": ["one"],
        "joint": [0],
        "rest": avatar.skeleton.rest,
        "tip": avatar.skeleton.tip,
        "a": [0.0] * 3,
        "b": [0.0, 0.1, 0.0],
        "radius_a": [0.1],
        "radius_b": [0.1],
    }
    Proportions.from_arrays(**limbs)
    with pytest.raises(ValueError, match=reason):
        Proportions.from_arrays(**(limbs | change))
