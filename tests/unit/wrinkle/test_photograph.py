"""Shapes from photographs: known curves are found again, in place, and with their weights."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from wrinkle_fixture import bow, placed, straight

from vistel.arrays import F64
from vistel.wrinkle.curve import sampled
from vistel.wrinkle.displacement import displacement_map
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.instance import Instance
from vistel.wrinkle.photograph import Looking, Traced, trace
from vistel.wrinkle.picture import CLOTH, typical
from vistel.wrinkle.shape import WrinkleShape
from vistel.wrinkle.shape_file import builtin_shapes
from vistel.wrinkle.skeleton_graph import paths
from vistel.wrinkle.texture import Lighting, wrinkled_texture

pytest.importorskip("cv2.ximgproc", reason="OpenCV without its contrib modules")


def _photograph(
    wrinkle: Instance, side: float, texels: int = 400, noise: float = 0.0, light: float = math.pi / 2
) -> NDArray[np.uint8]:
    of = displacement_map([wrinkle], (side, side), texels)
    plain = np.full((*of.height.shape, 3), CLOTH, np.uint8)
    lamp = Lighting((0.65 * math.cos(light), 0.65 * math.sin(light), 0.7))
    picture = wrinkled_texture(plain, of, lamp)[0].astype(np.float64)
    picture += np.random.default_rng(1).normal(0.0, noise, picture.shape[:2])[..., None]
    return np.clip(picture, 0, 255).astype(np.uint8)


def _pixels(traced: Traced) -> F64:
    """(N, 2) x, y from the bottom left of the curves that were found."""
    lines = [sampled(b.places, 16)[0] for b in traced.shape.branches]
    return np.concatenate(lines) * traced.unit + np.array((traced.middle[0], -traced.middle[1]))


def _known(wrinkle: Instance, side: float, texels: int = 400) -> F64:
    out = np.concatenate([sampled(p, 40)[0] for p in wrinkle.control_points()]) * texels / side
    return out - np.array((0.0, texels))


def _apart(a: F64, b: F64) -> F64:
    """(N,) from each of a to the nearest of b."""
    return np.linalg.norm(a[:, None] - b[None], axis=2).min(axis=1)


@pytest.mark.parametrize(("light", "noise"), [(90.0, 0.0), (90.0, 3.0), (60.0, 1.0), (130.0, 1.0)])
def test_a_known_curve_is_found_where_it_is(light: float, noise: float) -> None:
    wrinkle = placed(bow(), unit=0.33, thickness=0.07, intensity=0.03)
    found = trace(_photograph(wrinkle, 1.0, noise=noise, light=math.radians(light)), how=Looking(light=math.radians(light)))
    known, seen = _known(wrinkle, 1.0), _pixels(found)
    # In parts of the radius of 28 pixels. Slanting light makes the edge lie a little beside the crest.
    assert np.median(_apart(seen, known)) < 0.2 * 28
    assert np.quantile(_apart(seen, known), 0.95) < 0.5 * 28
    # What runs towards the lamp it does not bring out.
    assert np.mean(_apart(known, seen) < 0.3 * 28) > (0.95 if light == 90.0 else 0.6)


def test_weights_follow_the_height_of_the_wrinkle() -> None:
    wrinkle = placed(straight(), unit=0.35, thickness=0.06)
    steep = trace(_photograph(wrinkle, 1.0)).shape
    low_end = (
        bow()
        .branches[0]
        .model_copy(
            update={
                "points": [
                    p.model_copy(update={"intensity": i, "thickness": 1.0, "at": (x, 0.0)})
                    for p, i, x in zip(bow().branches[0].points, (0.45, 0.7, 1.0), (-1.0, 0.0, 1.0), strict=True)
                ]
            }
        )
    )
    rising = trace(_photograph(placed(WrinkleShape(name="rising", branches=[low_end]), unit=0.35, thickness=0.06), 1.0)).shape
    even, weights = steep.branches[0].intensities, rising.branches[0]
    assert even[1:-1].min() > 0.8
    x = weights.places[:, 0]
    left, right = ((x > -0.9) & (x < -0.3)), ((x > 0.3) & (x < 0.9))
    assert weights.intensities[right].mean() > 1.4 * weights.intensities[left].mean()


@pytest.mark.parametrize("name", ["sleeve_bend", "knee", "twist"])
def test_the_wrinkles_of_a_wrinkled_texture_are_found_again(name: str) -> None:
    wrinkle, side = typical(builtin_shapes()[name], wrinkledness=0.2, seed=3)
    found = trace(_photograph(wrinkle, side, 500, noise=1.0))
    known, seen = _known(wrinkle, side, 500), _pixels(found)
    radius = wrinkle.thickness / side * 500
    assert np.quantile(_apart(seen, known), 0.8) < 0.35 * radius
    assert np.mean(_apart(known, seen) < 0.5 * radius) > 0.6


def test_a_fork_is_found_as_curves_that_meet() -> None:
    skeleton = np.zeros((60, 60), np.uint8)
    skeleton[30, 5:31] = 1
    for k in range(1, 25):
        skeleton[30 - k, 30 + k] = skeleton[30 + k, 30 + k] = 1
    found = paths(skeleton, 8.0)
    assert len(found) == 3
    ends = [tuple(p) for line in found for p in (line[0], line[-1])]
    assert max(ends.count(e) for e in ends) == 3


def test_short_ends_are_pruned_and_the_curve_goes_on() -> None:
    skeleton = np.zeros((40, 60), np.uint8)
    skeleton[20, 5:55] = 1
    skeleton[15:20, 30] = 1
    (line,) = paths(skeleton, 10.0)
    assert len(line) >= 49


@pytest.mark.parametrize("grey", [0, 128, 255])
def test_a_picture_without_wrinkles_is_reported(grey: int) -> None:
    with pytest.raises(WrinkleError, match="no wrinkles are seen"):
        trace(np.full((120, 160, 3), grey, np.uint8))
