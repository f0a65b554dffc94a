"""The looks: scenes in fine light are compared with pictures that somebody has looked at.

    make looks                                     # compares; what differs is put beside what was expected in /tmp
    VISTEL_ACCEPT_LOOKS=1 make looks               # takes what is drawn now; look at it before it is committed

MEAN and WORST (see picture_difference) were set between what the same scene gives under changes nobody minds and what real
faults give; `test_the_measure_...` holds both sides, so that the thresholds cannot be moved past either:

    of hands, a face, three at the table                  mean            worst tile
    noise of 2 levels, colours rounded to 7 bits          0.0019          0.0025
    JPEG of quality 90                                    0.0035          0.0092
    moved by a fifth of a pixel (the table, full of lines) 0.0058         0.0187
    limit                                                 0.009           0.030
    light dimmer by 15 %                                  0.028           0.051
    red 8 % up and blue 6 % down                          0.017           0.029
    moved by three pixels                                 0.023           0.108
    figures throw no shadows                              0.006           0.209
    nothing throws a shadow                               0.008           0.209

    a wall drawn for an eye 5 cm beside its viewer's      0.034           0.167
    a wall with one screen's edge faded at the seam       0.0035          0.115
"""

from __future__ import annotations

import os
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest
from picture_difference import difference
from PIL import Image

from docs.pictures.conferences.scenes import SCENES, Moment, photograph
from docs.pictures.conferences.wall import wall_seen
from vistel.render.gl.context import NoOpenGlError, open_surface
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.stage.stage import PersonNow

pytestmark = [pytest.mark.gl, pytest.mark.slow]

GOLDEN = Path(__file__).parent / "golden"
LOOKED_AT = sorted(p.stem for p in GOLDEN.glob("*.png"))
WIDTH, HEIGHT = 320, 180
MEAN, WORST = 0.009, 0.030


def expected(name: str) -> np.ndarray:
    return np.asarray(Image.open(GOLDEN / f"{name}.png").convert("RGB"), np.uint8)


def _scene(name: str, width: int, height: int, light: str, prepare=None) -> np.ndarray:
    return photograph(SCENES[name](), width, height, light, prepare)


PICTURES = {name: partial(_scene, name) for name in SCENES} | {"v-wall": wall_seen}


def drawn(name: str, light: str = "fine", **change) -> np.ndarray:
    try:
        surface = open_surface()
    except NoOpenGlError as e:
        pytest.skip(str(e))
    software = surface.capability.software
    surface.close()
    if not software:
        pytest.skip("what was looked at was drawn by software OpenGL")
    return PICTURES[name](WIDTH, HEIGHT, light, **change)


@pytest.mark.parametrize("name", list(PICTURES) if os.environ.get("VISTEL_ACCEPT_LOOKS") else LOOKED_AT)
def test_a_scene_looks_as_it_did_when_somebody_looked_at_it(name: str) -> None:
    picture = drawn(name)
    if os.environ.get("VISTEL_ACCEPT_LOOKS"):
        Image.fromarray(picture).save(GOLDEN / f"{name}.png", optimize=True)
        pytest.skip("accepted")
    found = difference(picture, expected(name))
    if found.mean > MEAN or found.worst > WORST:
        shown = Path(tempfile.gettempdir()) / f"vistel-look-{name}.png"
        Image.fromarray(np.hstack((expected(name), picture))).save(shown)
        pytest.fail(f"{name} looks different: {found}; expected and drawn are in {shown}")


def without_shadows(studio: SceneRenderer) -> None:
    draw = studio.painter.shadow.draw
    studio.painter.shadow.draw = lambda limbs, solids: draw([], [])  # type: ignore[method-assign]


def without_limbs_shadows(studio: SceneRenderer) -> None:
    draw = studio.painter.shadow.draw
    studio.painter.shadow.draw = lambda limbs, solids: draw([], solids)  # type: ignore[method-assign]


@pytest.mark.parametrize("fault", [without_shadows, without_limbs_shadows])
def test_the_measure_finds_that_shadows_are_missing(fault) -> None:
    found = difference(drawn("hand-on-ball", prepare=fault), expected("hand-on-ball"))
    assert found.mean > 1.3 * MEAN or found.worst > 1.3 * WORST, found


def test_the_measure_finds_the_other_light() -> None:
    found = difference(drawn("hand-on-ball", "fast"), expected("hand-on-ball"))
    assert found.mean > 1.3 * MEAN or found.worst > 1.3 * WORST, found


def tracked(way: tuple[float, float, float], moment: Moment) -> Moment:
    """The viewer as a head's tracker has them that is off by `way` [m]."""
    off = np.array(way)

    def moved(person: PersonNow) -> PersonNow:
        if person.about.name != moment.view.eyes:
            return person
        stance = person.posture.stance
        return replace(person, posture=replace(person.posture, stance=replace(stance, position=stance.position + off)))

    return replace(moment, instant=replace(moment.instant, people=tuple(moved(p) for p in moment.instant.people)))


def blended(moment: Moment) -> Moment:
    """A tenth of the left screen fades towards the seam, as if the right one lay over it."""
    left, right = moment.view.screens
    return replace(moment, view=replace(moment.view, screens=(replace(left, blend=(0.0, 0.1, 0.0, 0.0)), right)))


@pytest.mark.parametrize("fault", [partial(tracked, (0.05, 0.0, 0.0)), partial(tracked, (0.0, 0.05, 0.0)), blended])
def test_the_measure_finds_a_wall_that_is_drawn_for_another_eye_or_blends_where_nothing_overlaps(fault) -> None:
    found = difference(drawn("v-wall", change=fault), expected("v-wall"))
    assert found.mean > 1.3 * MEAN or found.worst > 1.3 * WORST, found


def dimmer(picture: np.ndarray) -> np.ndarray:
    return np.round(255.0 * (0.85 * (picture / 255.0) ** 2.2) ** (1 / 2.2)).astype(np.uint8)


def redder(picture: np.ndarray) -> np.ndarray:
    return np.clip(picture * (1.08, 1.0, 0.94), 0, 255).astype(np.uint8)


def moved(picture: np.ndarray) -> np.ndarray:
    return np.roll(picture, 3, axis=1)


@pytest.mark.parametrize("fault", [dimmer, redder, moved])
@pytest.mark.parametrize("name", LOOKED_AT)
def test_the_measure_finds_other_light_other_colours_and_another_place(name: str, fault) -> None:
    found = difference(fault(expected(name)), expected(name))
    assert found.mean > 1.3 * MEAN or found.worst > 1.3 * WORST, found


def noisy(picture: np.ndarray) -> np.ndarray:
    noise = np.random.default_rng(1).normal(0.0, 2.0, picture.shape)
    return np.clip(np.round(picture + noise), 0, 255).astype(np.uint8)


def coded(picture: np.ndarray) -> np.ndarray:
    return cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 90])[1], cv2.IMREAD_COLOR)


def shifted(picture: np.ndarray) -> np.ndarray:
    """By a fifth of a pixel each way: another rule of which pixels a triangle covers."""
    matrix = np.array(((1.0, 0.0, 0.2), (0.0, 1.0, 0.2)))
    return cv2.warpAffine(picture, matrix, (WIDTH, HEIGHT), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)


def rounded(picture: np.ndarray) -> np.ndarray:
    return (picture.astype(int) // 2 * 2).astype(np.uint8)


@pytest.mark.parametrize("harmless", [noisy, coded, shifted, rounded])
@pytest.mark.parametrize("name", LOOKED_AT)
def test_the_measure_does_not_mind_what_nobody_sees(name: str, harmless) -> None:
    found = difference(harmless(expected(name)), expected(name))
    assert found.mean < 0.7 * MEAN and found.worst < 0.7 * WORST, found
