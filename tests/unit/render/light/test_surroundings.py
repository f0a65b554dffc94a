"""The room as things mirror it, from pictures with known light."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.render.light.surroundings import HEIGHT, MEAN, SIDE, WIDTH, Surroundings, _sphere, open_air, surroundings
from vistel.render.view.camera import Camera


def ways(camera: Camera) -> np.ndarray:
    """(SIDE, SIDE, 3) where each pixel of a camera looks."""
    at = (np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0
    x, y = np.meshgrid(at, at)
    out = np.stack((x, y, -np.ones_like(x)), axis=2) @ camera.rotation.T
    return out / np.linalg.norm(out, axis=2, keepdims=True)


def lamp(camera: Camera) -> np.ndarray:
    """Bright towards +x, dark elsewhere."""
    return np.where(ways(camera)[..., :1] > 0.9, 6.0, 0.2) * np.ones(3)


def diffuse(around: Surroundings, n: np.ndarray) -> np.ndarray:
    """As `around()` in fine_light.glsl."""
    x, y, z = n
    basis = np.array((1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y))
    return basis @ around.irradiance


def test_in_even_light_everything_mirrors_the_same() -> None:
    around = surroundings(lambda camera: np.full((SIDE, SIDE, 3), 0.3, np.float32))
    assert around.mirrors == pytest.approx(MEAN, rel=1e-3)
    for n in np.eye(3):
        assert diffuse(around, n) == pytest.approx(MEAN, rel=1e-3)


def test_diffuse_light_is_the_half_spheres_mean_by_cosine() -> None:
    """Against the sum over the sphere itself; nine numbers keep smooth light but for some hundredths."""
    around = surroundings(open_air)
    towards = _sphere(256, 128)
    share = np.repeat(np.sin((np.arange(128) + 0.5) / 128 * np.pi), 256)
    share /= share.sum()
    up = towards[:, 1:2]
    light = np.where(up > 0.0, np.array((0.5, 0.56, 0.66)) + 0.25 * up, (0.30, 0.26, 0.21))
    light *= MEAN / (light.mean(axis=1) * share).sum()
    for n in (np.array((0.0, 1.0, 0.0)), np.array((0.6, 0.0, 0.8)), np.array((0.0, -0.8, 0.6))):
        exact = 4.0 * (np.maximum(towards @ n, 0.0) * share) @ light
        assert diffuse(around, n) == pytest.approx(exact, abs=0.03)


def test_a_polished_surface_shows_the_lamp_a_matt_one_its_glow() -> None:
    mirrors = surroundings(lamp).mirrors.reshape(5, HEIGHT, WIDTH, 3)[..., 0]
    towards = _sphere(WIDTH, HEIGHT).reshape(HEIGHT, WIDTH, 3)
    at_lamp, away = towards[..., 0] > 0.97, towards[..., 0] < -0.5
    peaks = [m[at_lamp].mean() for m in mirrors]
    assert peaks == sorted(peaks, reverse=True)
    assert peaks[0] > 2.0 * peaks[-1]
    assert mirrors[0][away] == pytest.approx(mirrors[0][away][0], rel=0.02)
    assert mirrors.mean(axis=(1, 2)) == pytest.approx(mirrors[0].mean(), rel=0.5)
