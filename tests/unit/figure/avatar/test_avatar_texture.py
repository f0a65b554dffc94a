"""Texture registration: the picture of one island turns, grows and moves; all else stays, and it can be taken back."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from making_fixture import person

from vistel.figure.avatar.avatar import Avatar, Registration
from vistel.figure.avatar.texture import island_of, islands, registered, unregistered, with_picture
from vistel.figure.formats.gltf import save_gltf
from vistel.figure.formats.load import load_any
from vistel.figure.formats.usd import save_usd

ISLAND = 3


def _mine(avatar: Avatar, island: int) -> np.ndarray:
    return avatar.mesh.uv[island_of(avatar)[0] == island].astype(np.float64)


def test_islands_are_numbered_by_size_and_cover_the_surface() -> None:
    found = islands(person())
    skin = found[: int(island_of(person())[0].max()) + 1]
    assert [i.number for i in found] == list(range(len(found)))
    assert all(a.area >= b.area - 1e-9 for a, b in itertools.pairwise(skin))
    assert sum(i.triangles for i in skin) == len(person().mesh.triangles)
    assert {i.part for i in found[len(skin) :]} == {"left eye", "right eye"}


def test_only_the_island_meant_changes() -> None:
    out = registered(person(), Registration(ISLAND, (0.02, -0.01), 0.3, 1.2))
    changed = np.abs(out.mesh.uv - person().mesh.uv).max(axis=1) > 0.0
    assert set(island_of(person())[0][changed]) == {ISLAND}
    for eye, before in zip(out.eyeballs, person().eyeballs, strict=True):
        np.testing.assert_array_equal(eye.uv, before.uv)


def test_what_is_shown_moves_up_right_turns_left_and_grows() -> None:
    uv = _mine(person(), ISLAND)
    middle = 0.5 * (uv.min(axis=0) + uv.max(axis=0))
    # The place that shows what lay at q before: for a picture moved by t, q + t.
    moved = _mine(registered(person(), Registration(ISLAND, (0.02, 0.01))), ISLAND)
    np.testing.assert_allclose(moved, uv - (0.02, 0.01), atol=1e-6)
    larger = _mine(registered(person(), Registration(ISLAND, scale=2.0)), ISLAND)
    np.testing.assert_allclose(larger - middle, (uv - middle) / 2.0, atol=1e-6)
    # Square texture: a quarter turn to the left shows at the top what lay at the right.
    turned = _mine(registered(person(), Registration(ISLAND, turn=math.pi / 2)), ISLAND)
    p = uv - middle
    np.testing.assert_allclose(turned - middle, np.column_stack([p[:, 1], -p[:, 0]]), atol=1e-6)


@settings(max_examples=8, deadline=None)
@given(
    u=st.floats(-0.3, 0.3), v=st.floats(-0.3, 0.3), turn=st.floats(-3.0, 3.0), scale=st.floats(0.2, 5.0), island=st.integers(0, 30)
)
def test_it_can_be_taken_back(u: float, v: float, turn: float, scale: float, island: int) -> None:
    there = registered(person(), Registration(island, (u, v), turn, scale))
    again = registered(there, Registration(island, (v, u), -turn, 1.0))
    back = unregistered(again, island)
    assert back.registration == ()
    np.testing.assert_allclose(back.mesh.uv, person().mesh.uv, atol=3e-6)
    for level, before in zip(back.coarser, person().coarser, strict=True):
        np.testing.assert_allclose(level.mesh.uv, before.mesh.uv, atol=3e-6)


def test_coarser_levels_show_the_same() -> None:
    out = registered(person(), Registration(0, (0.05, 0.0)))
    for level, before in zip(out.coarser, person().coarser, strict=True):
        step = before.mesh.uv - level.mesh.uv
        np.testing.assert_allclose(np.unique(np.round(step[:, 0], 5)), (0.0, 0.05), atol=1e-5)


@pytest.mark.parametrize("ending", [".usda", ".usdz", ".glb"])
def test_the_file_keeps_it(tmp_path: Path, ending: str) -> None:
    slim = replace(person(), albedo=np.ascontiguousarray(person().albedo[::6, ::6]))
    out = registered(registered(slim, Registration(2, (0.01, 0.0), 0.1, 1.1)), Registration(1, turn=-0.4))
    path = tmp_path / f"eva{ending}"
    save_gltf(out, path) if ending == ".glb" else save_usd(out, path)
    again = load_any(path)
    assert again.registration == out.registration
    np.testing.assert_array_equal(again.mesh.uv, out.mesh.uv)
    np.testing.assert_allclose(unregistered(unregistered(again, 1), 2).mesh.uv, person().mesh.uv, atol=3e-6)


def test_another_picture_spans_its_island_and_the_rest_shows_what_it_showed() -> None:
    red = np.zeros((64, 32, 3), np.uint8)
    red[..., 0] = 255
    out = with_picture(registered(person(), Registration(1, (0.01, 0.0))), ISLAND, red)

    def colour(avatar: Avatar, rows: np.ndarray) -> np.ndarray:
        high, wide = avatar.albedo.shape[:2]
        x = np.clip((avatar.mesh.uv[rows, 0] * wide).astype(int), 0, wide - 1)
        y = np.clip(((1.0 - avatar.mesh.uv[rows, 1]) * high).astype(int), 0, high - 1)
        return avatar.albedo[y, x].astype(int)

    mine = island_of(person())[0] == ISLAND
    assert (colour(out, mine) == (255, 0, 0)).all()
    far = np.flatnonzero((island_of(person())[0] != ISLAND) & (island_of(person())[0] != 1))
    same = np.abs(colour(out, far) - colour(person(), far)).max(axis=1) <= 40
    assert same.mean() > 0.98
    assert [r.island for r in out.registration] == [1]
    np.testing.assert_allclose(
        unregistered(out, 1).mesh.uv[island_of(person())[0] == 1],
        with_picture(person(), ISLAND, red).mesh.uv[island_of(person())[0] == 1],
        atol=3e-6,
    )


def test_islands_and_scales_that_are_none_are_refused() -> None:
    for wrong in (Registration(9999), Registration(-1), Registration(0, scale=0.0), Registration(0, (math.nan, 0.0))):
        with pytest.raises(ValueError, match="expected"):
            registered(person(), wrong)
    with pytest.raises(ValueError, match="expected"):
        with_picture(person(), 9999, np.zeros((4, 4, 3), np.uint8))
