"""Wrinkled textures: light, cloth that is drawn in, and what correspondence is lost."""

from __future__ import annotations

import numpy as np
import pytest
from wrinkle_fixture import bow, placed, straight

from vistel.wrinkle.displacement import Map, displacement_map
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.texture import Lighting, drawn_in, encoded, linear, shading, wrinkled_texture


def _bow() -> Map:
    return displacement_map([placed(bow(), intensity=0.03)], (1.0, 1.0), 160)


def test_a_texture_without_wrinkles_stays_as_it_is() -> None:
    flat = np.random.default_rng(0).integers(0, 256, (40, 50, 3), np.uint8)
    out, loss = wrinkled_texture(flat, Map(np.zeros((40, 50), np.float32), 0.01))
    assert np.array_equal(out, flat)
    assert loss.shift == 0.0
    assert not loss.limited


def test_what_faces_the_light_is_brighter_than_flat_cloth_and_the_other_side_darker() -> None:
    of = displacement_map([placed(straight())], (1.0, 1.0), 100)
    bright = shading(of, Lighting(towards=(0.0, 1.0, 1.0)))
    assert bright[45, 50] > 1.05
    assert bright[55, 50] < 0.95
    assert bright[5, 5] == pytest.approx(1.0, abs=1e-3)


def test_lengths_are_kept_where_nothing_limits_the_motion() -> None:
    # A wave along x: the cloth between two crests is as long as the wave's arc.
    x = np.arange(256) / 256.0
    wave = Map(np.tile(0.01 * np.sin(2 * np.pi * 4 * x), (64, 1)).astype(np.float32), 1.0 / 256.0, wraps=True)
    shift, _ = drawn_in(wave)
    steepest = 0.01 * 8 * np.pi
    arc = 0.25 * steepest**2 * np.sin(16 * np.pi * x) / (16 * np.pi)
    assert np.abs(shift[32, :, 0] - arc).max() < 0.05 * np.abs(arc).max()
    assert np.abs(shift[..., 1]).max() < 1e-6


@pytest.mark.parametrize("limit", [0.0005, 0.002])
def test_the_texture_moves_no_farther_than_the_limit_and_the_loss_is_reported(limit: float) -> None:
    of = _bow()
    grid = np.zeros((*of.height.shape, 3), np.uint8)
    grid[::8] = grid[:, ::8] = 255
    _, loss = wrinkled_texture(grid, of, limit=limit)
    shift, _ = drawn_in(of, limit)
    assert np.linalg.norm(shift, axis=2).max() <= limit * (1 + 1e-5)
    assert loss.shift == pytest.approx(limit)
    assert loss.limited
    assert loss.wanted > limit
    assert 0.0 < loss.mean < loss.shift


def test_a_print_stays_where_it_is_within_the_limit() -> None:
    # A bright stripe through the wrinkle: its middle is found again no farther away than the loss says.
    of = displacement_map([placed(bow(), intensity=0.08)], (1.0, 1.0), 160)
    texels = len(of.height)
    flat = np.full((texels, texels, 3), 60, np.uint8)
    flat[:, 48:52] = 250
    out, loss = wrinkled_texture(flat, of, limit=0.02)
    light = linear(out)[..., 0] / shading(of)
    mass = np.maximum(light - light.min(axis=1, keepdims=True) * 1.5, 0.0)
    middle = (mass * np.arange(texels)).sum(axis=1) / mass.sum(axis=1)
    assert np.abs(middle - 49.5).max() * of.step <= loss.shift + of.step
    assert np.abs(middle - 49.5).max() * of.step > 0.2 * loss.shift


def test_a_texture_of_another_size_is_reported() -> None:
    with pytest.raises(WrinkleError, match="texture: is 50 x 40, the displacement map 160 x 160; make the map"):
        wrinkled_texture(np.zeros((40, 50, 3), np.uint8), _bow())


def test_light_outside_the_mask_is_left_alone() -> None:
    of = _bow()
    flat = np.full((*of.height.shape, 3), 128, np.uint8)
    mask = np.zeros_like(of.height)
    mask[:, :80] = 1.0
    out, _ = wrinkled_texture(flat, of, mask=mask)
    assert (out[:, 80:] == 128).all()
    assert (out[:, :80] != 128).any()


def test_bytes_go_to_linear_light_and_back() -> None:
    every = np.arange(256, dtype=np.uint8)
    assert np.array_equal(encoded(linear(every)), every)
