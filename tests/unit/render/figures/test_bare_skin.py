"""Hair, collars and cuffs on head, neck and hands are not lit as skin; faces, lips and fingers are, whatever their colour."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from avatar_fixture import closed_person

from vistel.figure import builtin
from vistel.figure.avatar.avatar import Avatar, flesh
from vistel.render.figures.bare_skin import bare_skin, is_bare


@pytest.fixture(scope="module")
def avatar() -> Avatar:
    return closed_person()


def _at(avatar: Avatar, low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    """Drawn vertices in a box, as if the person were 1.75 m tall [m]."""
    places = avatar.mesh.vertices[avatar.mesh.corner_vertex] * (1.75 / avatar.skeleton.height)
    return ((places > low) & (places < high)).all(axis=1)


def test_the_forehead_the_cheeks_and_the_lips_are_skin(avatar: Avatar) -> None:
    bare = bare_skin(avatar)
    forehead = _at(avatar, (-0.03, 1.672, 0.07), (0.03, 1.690, 0.2))
    cheeks = _at(avatar, (-0.06, 1.585, 0.06), (0.06, 1.62, 0.2))
    lips = _at(avatar, (-0.012, 1.556, 0.094), (0.012, 1.566, 0.2))
    for place in forehead, cheeks, lips:
        assert place.sum() > 3
        assert bare[place].mean() > 0.8


def test_hair_is_not(avatar: Avatar) -> None:
    crown = _at(avatar, (-0.2, 1.725, -0.2), (0.2, 2.0, 0.2))
    assert crown.sum() > 50
    assert bare_skin(avatar)[crown].mean() < 0.02


def test_a_collar_is_not_though_it_lies_on_the_neck(avatar: Avatar) -> None:
    names = np.array(avatar.body.names)[avatar.mesh.limb[avatar.mesh.corner_vertex]]
    low = (names == "neck") & _at(avatar, (-0.2, 1.3, -0.2), (0.2, 1.47, 0.2))
    assert low.sum() > 15
    assert bare_skin(avatar)[low].mean() < 0.1


def test_hands_are_and_sleeves_are_not(avatar: Avatar) -> None:
    names = np.array(avatar.body.names)[avatar.mesh.limb[avatar.mesh.corner_vertex]]
    bare = bare_skin(avatar)
    assert bare[np.char.endswith(names, "index_proximal")].mean() > 0.95
    assert not bare[[not is_bare(n) for n in names]].any()


def test_gloves_are_not(avatar: Avatar) -> None:
    names = np.array(avatar.body.names)[avatar.mesh.limb[avatar.mesh.corner_vertex]]
    hands = [is_bare(n) and n not in ("neck", "skull", "face") for n in names]
    green = avatar.albedo.copy()
    height, width = green.shape[:2]
    rows = ((1.0 - avatar.mesh.uv[hands, 1]) * height).astype(int).clip(0, height - 1)
    green[rows, (avatar.mesh.uv[hands, 0] * width).astype(int).clip(0, width - 1)] = (40, 120, 60)
    assert not bare_skin(replace(avatar, albedo=green))[hands].any()


def test_a_face_of_one_colour_is_skin_through_and_through(avatar: Avatar) -> None:
    plain = bare_skin(replace(avatar, albedo=np.full((8, 8, 3), (200, 150, 120), np.uint8)))
    names = np.array(avatar.body.names)[avatar.mesh.limb[avatar.mesh.corner_vertex]]
    assert np.array_equal(plain, [is_bare(n) for n in names])


@pytest.mark.parametrize("who", ["carla", "erik"])
def test_cards_of_hair_are_not_whatever_their_colour(who: str) -> None:
    person = builtin(who).avatar
    hair = ~flesh(person)[person.mesh.corner_vertex]
    assert hair.sum() > 1000
    assert not bare_skin(person)[hair].any()
    assert bare_skin(person).sum() > 3000
