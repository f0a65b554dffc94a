"""Displacement maps: the golden numbers, against the definition, caps, jitter, wrapping."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wrinkle_fixture import bow, heights_at, placed, straight

from vistel.wrinkle.density_kernels import cross_section, hermite
from vistel.wrinkle.displacement import Map, blank, bump_normals, displacement_map
from vistel.wrinkle.instance import strokes
from vistel.wrinkle.shape import Layer
from vistel.wrinkle.shape_file import builtin_shapes

GOLDEN: list[dict[str, Any]] = [
    e for e in json.loads((Path(__file__).parents[2] / "golden.json").read_text())["values"] if e["group"] == "wrinkle"
]
PLAIN = np.array([[1.0, 0.0, 1.0, 0.0]])


@pytest.mark.parametrize("entry", GOLDEN, ids=lambda e: e["name"])
def test_golden_contributions(entry: dict[str, Any]) -> None:
    given = entry["inputs"]
    layers = PLAIN * np.array([given["intensity"] * given["iQ"], 1.0, 1.0, 1.0])
    if "dist" in given:
        found = cross_section(layers, given["dist"] / given["r"], 0.0, 0.0)
    else:
        found = _at_ratios(layers, given["dx"], given["dy"])
    assert found == pytest.approx(entry["expected"], abs=entry["tolerance"])


def _at_ratios(layers: np.ndarray, dx: float, dy: float) -> float:
    """The cap at the place whose intercepts give these distance ratios, found by iteration; length 2 radii."""
    x, y = 0.0, 0.0
    for _ in range(200):
        x, y = dx * 2.0 * hermite(y), dy * hermite(x / 2.0)
    return float(cross_section(layers, y, x, 2.0))


def test_golden_values_are_there() -> None:
    assert len(GOLDEN) == 2


@settings(max_examples=12)
@given(st.floats(0.0, 6.3), st.floats(0.15, 0.3), st.floats(0.04, 0.12), st.booleans())
def test_a_map_is_the_densities_of_its_definition(turn: float, unit: float, thickness: float, mirrored: bool) -> None:
    instance = placed(bow(), unit=unit, thickness=thickness, turn=turn, mirrored=mirrored)
    of = displacement_map([instance], (1.0, 1.0), 200)
    rows, columns = np.random.default_rng(0).integers(0, 200, (2, 60))
    places = np.stack(((columns + 0.5) * of.step, (200 - rows - 0.5) * of.step), axis=1)
    assert np.allclose(of.height[rows, columns], heights_at(instance, places), atol=4e-5)


@pytest.mark.parametrize("end", ["round", "taper", "vanish"])
def test_a_wrinkle_is_smooth_where_its_end_begins(end: Any) -> None:
    # Texels of a thousandth of the radius round the line across the end (1, 0): slopes must not jump (mathematics M9.2).
    instance = placed(straight(start=end, end=end), at=(-0.395, 0.05), unit=0.4, thickness=0.1)
    of = displacement_map([instance], (0.01, 0.1), 1000)
    slope = np.diff(of.height.astype(np.float64), axis=1) / of.step
    assert np.abs(np.diff(slope[:, 30:70], axis=1)).max() < 0.01


def test_a_tapering_end_is_as_long_as_said_and_a_round_one_a_radius() -> None:
    for end, length in (("taper", 0.2), ("round", 0.1)):
        of = displacement_map([placed(straight(end=end))], (1.0, 1.0), 500)  # type: ignore[arg-type]
        last = (np.flatnonzero(of.height.max(axis=0) > 0.0)[-1] + 0.5) * of.step
        assert last == pytest.approx(0.8 + length, abs=0.02)


def test_valleys_are_negative_and_wrinkles_add_up() -> None:
    ridge = placed(straight())
    both = displacement_map([ridge, replace(ridge, intensity=-0.5 * ridge.intensity)], (1.0, 1.0), 100)
    alone = displacement_map([ridge], (1.0, 1.0), 100)
    assert np.allclose(both.height, 0.5 * alone.height, atol=1e-8)
    assert displacement_map([replace(ridge, intensity=-0.02)], (1.0, 1.0), 100).height.min() == pytest.approx(-0.02, rel=0.01)


def test_a_layer_beside_the_curve_stays_on_its_side_when_turned_and_mirrored() -> None:
    shape = straight(start="taper", end="taper", profile=(Layer(offset=2.0, thickness=0.5),))
    for turn, mirrored, height in ((0.0, False, 0.7), (np.pi, False, 0.3), (0.0, True, 0.7)):
        of = displacement_map([placed(shape, mirrored=mirrored, turn=turn)], (1.0, 1.0), 200)
        row = int(np.argmax(of.height[:, 100]))
        assert 1.0 - (row + 0.5) * of.step == pytest.approx(height, abs=0.006)


def test_a_lean_makes_one_side_steeper() -> None:
    of = displacement_map([placed(straight(start="taper", end="taper", profile=(Layer(lean=0.5),)))], (1.0, 1.0), 400)
    column = of.height[:, 200]
    rows = np.flatnonzero(column > 0)
    assert 0.5 - rows[0] * of.step == pytest.approx(0.15, abs=0.004)
    assert rows[-1] * of.step - 0.5 == pytest.approx(0.05, abs=0.004)


def test_wrinkledness_moves_points_by_at_most_half_the_way_to_their_neighbours_and_by_the_seed() -> None:
    shape = builtin_shapes()["armpit_pull"]
    plain = placed(shape)
    jittered = replace(plain, wrinkledness=1.0, seed=5)
    for a, b in zip(plain.control_points(), jittered.control_points(), strict=True):
        length = np.linalg.norm(np.diff(a, axis=0), axis=1)
        near = np.minimum(np.append(length, np.inf), np.insert(length, 0, np.inf))
        assert (np.linalg.norm(a - b, axis=1) <= 0.5 * near + 1e-12).all()
    assert not np.allclose(plain.control_points()[0], jittered.control_points()[0])
    again, other = replace(jittered), replace(jittered, seed=6)
    assert np.array_equal(again.control_points()[0], jittered.control_points()[0])
    assert not np.allclose(other.control_points()[0], jittered.control_points()[0])


def test_branches_that_begin_on_another_stay_on_it_when_jittered() -> None:
    shape = builtin_shapes()["armpit_pull"]
    plain = [b.places for b in shape.branches]
    moved = placed(shape, wrinkledness=1.0, seed=2).control_points()
    joints = [
        (i, j, k, m)
        for i in range(len(plain))
        for j in range(i)
        for k, p in enumerate(plain[i])
        for m, q in enumerate(plain[j])
        if np.array_equal(p, q)
    ]
    assert joints
    assert all(np.array_equal(moved[i][k], moved[j][m]) for i, j, k, m in joints)


def test_a_plane_that_wraps_has_no_seam() -> None:
    middle = displacement_map([placed(bow(), at=(0.5, 0.5))], (1.0, 1.0), 200, wraps=True)
    edge = displacement_map([placed(bow(), at=(1.0, 0.5))], (1.0, 1.0), 200, wraps=True)
    assert np.allclose(np.roll(middle.height, 100, axis=1), edge.height, atol=1e-6)


def test_wrinkles_off_the_plane_leave_it_flat() -> None:
    assert not displacement_map([placed(bow(), at=(5.0, 0.5))], (1.0, 1.0), 64).height.any()
    assert not displacement_map([placed(bow(), at=(0.5, -5.0))], (1.0, 1.0), 64, wraps=True).height.any()


@pytest.mark.parametrize("name", sorted(builtin_shapes()))
def test_every_shape_is_as_high_as_its_instance_at_most_and_fades_to_nothing(name: str) -> None:
    shape = builtin_shapes()[name]
    of = displacement_map([placed(shape, unit=0.2, thickness=0.035, wrinkledness=0.3, seed=1)], (1.0, 1.0), 256)
    deepest = sum(abs(layer.intensity) for layer in shape.profile)
    assert 0.004 < np.abs(of.height).max() <= 0.02 * deepest + 1e-6
    assert np.isfinite(of.height).all()
    assert not (of.height[0].any() or of.height[-1].any() or of.height[:, 0].any() or of.height[:, -1].any())


def test_normals_of_a_bump_map_are_those_of_the_slope() -> None:
    x = np.linspace(0.0, 1.0, 50, dtype=np.float32)
    rising = Map(np.tile(0.5 * x, (50, 1)), 1.0 / 49.0)
    normals = bump_normals(rising)
    assert np.allclose(normals, np.array((-0.5, 0.0, 1.0)) / np.sqrt(1.25), atol=1e-4)
    up = Map(np.tile(0.5 * x[::-1, None], (1, 50)), 1.0 / 49.0)
    assert np.allclose(bump_normals(up), np.array((0.0, -0.5, 1.0)) / np.sqrt(1.25), atol=1e-4)


def test_a_plane_has_the_size_it_was_asked_for() -> None:
    assert blank((0.4, 0.5), 100).height.shape == (100, 80)
    assert blank((0.337, 0.5), 101, wraps=True).size[0] == pytest.approx(0.337)


def test_segments_are_short_beside_the_radius() -> None:
    made = strokes(placed(bow()))
    length = np.linalg.norm(made.line[:, 2:] - made.line[:, :2], axis=1)
    assert (length <= 0.15 * made.values[:, 2:].min(axis=1)).all()
