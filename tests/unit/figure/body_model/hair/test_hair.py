"""Hair: it fits every head, keeps its budget, and does not go through the body."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.spatial import KDTree  # pyright: ignore[reportMissingTypeStubs]

import vistel.figure
from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.avatar.check import check_avatar
from vistel.figure.body_model.assemble import assemble
from vistel.figure.body_model.hair.beard import BEARDS, beard
from vistel.figure.body_model.hair.ground_paint import paint_ground
from vistel.figure.body_model.hair.hair import hair
from vistel.figure.body_model.hair.natural import usual_style
from vistel.figure.body_model.hair.scalp import Scalp
from vistel.figure.body_model.hair.styles import STYLES
from vistel.figure.body_model.model import body_model
from vistel.figure.body_model.person import Person, drawn, fit, make
from vistel.figure.figure import Figure
from vistel.figure.part import Part, joined
from vistel.figure.posture.by_joint import with_joints
from vistel.figure.posture.posture import standing
from vistel.figure.skeleton import JOINT_INDEX

GROWN = tuple(name for name, style in STYLES.items() if style is not None)
PEOPLE = (Person("male", 8.0), Person("female", 3.0), *(drawn(seed, sex) for seed in range(4) for sex in ("female", "male")))
MOST = 3500, 1200, 350
"""Vertices of hair by level."""


@cache
def body(who: int) -> Avatar:
    """Bald and bare. A painted skin would take longer than all the rest."""
    return assemble(body_model(), fit(PEOPLE[who]).shape, name="person")


def grown(who: int, style: str, seed: int = 0) -> Part:
    part = hair(body(who), style, (60, 45, 35), np.random.default_rng(seed))
    assert part is not None
    return part


class Skin:
    """A closed skin of the body model."""

    def __init__(self, skin: F64) -> None:
        """skin: (V, 3) its vertices [m]."""
        corner = skin[body_model().closed]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        size = np.linalg.norm(normal, axis=1)
        self._corner, normal = corner[size > 1e-9], normal[size > 1e-9] / size[size > 1e-9][:, None]
        shares = np.array([(a, b, 1.0 - a - b) for a in (0.1, 1 / 3, 0.8) for b in (0.1, 1 / 3, 0.8) if a + b <= 0.95])
        self._on: F64 = np.einsum("sk,fki->sfi", shares, self._corner).reshape(-1, 3)
        self._normal: F64 = np.tile(normal, (len(shares), 1))
        self._tree: Any = KDTree(self._on)

    def depth(self, p: F64) -> F64:
        """(N,) how far places (N, 3) are inside [m]: behind the nearest of many places on it."""
        which = np.asarray(self._tree.query(p)[1])
        deep = -np.einsum("ni,ni->n", p - self._on[which], self._normal[which])
        # Beside sharp edges that may be the wrong side: the solid angle under which the skin is seen tells (Jacobson et al. 2013).
        for k in np.flatnonzero(deep > 0.002):
            a, b, c = np.moveaxis(self._corner - p[k], 1, 0)
            la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
            below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
            turns = np.arctan2((a * np.cross(b, c)).sum(1), below).sum() / (2.0 * np.pi)
            deep[k] = deep[k] if turns > 0.5 else 0.0
        return deep


@cache
def skin(who: int) -> Skin:
    """Of somebody as they were made."""
    return Skin(body(who).mesh.vertices.astype(np.float64))


@pytest.mark.parametrize("style", GROWN)
def test_hair_stays_outside_the_skin_of_everybody(style: str) -> None:
    for who in range(len(PEOPLE)):
        for level in grown(who, style).levels:
            inside = skin(who).depth(level.vertices.astype(np.float64))
            assert inside.max() < 0.002, f"{PEOPLE[who]}: {1e3 * inside.max():.1f} mm"


@pytest.mark.parametrize("style", GROWN)
def test_each_level_keeps_its_budget_and_can_be_drawn(style: str) -> None:
    for who in (0, 2, 3):
        part = grown(who, style)
        assert all(len(m.vertices) <= most for m, most in zip(part.levels, MOST, strict=True)), [
            len(m.vertices) for m in part.levels
        ]
        assert max(part.albedo.shape[:2]) <= 512
        check_avatar(joined(body(who), [part]), style)


@pytest.mark.parametrize("shaved", [False, True])
def test_the_ground_of_hair_is_painted_on_the_head_alone(shaved: bool) -> None:
    mesh = body(5).mesh
    picture = np.full((*body_model().masks["skin"].shape, 3), 200, np.uint8)
    paint_ground(picture, Scalp(body(5)), (20.0, 20.0, 20.0), 0.9, np.random.default_rng(0), shaved=shaved)
    high, wide = len(picture), len(picture[0])
    column, row = np.floor(mesh.uv * (wide, -high) + (0.0, high)).astype(int).clip(0, (wide - 1, high - 1)).T
    dark = picture[row, column].max(axis=1) < 190
    p, scalp = mesh.vertices[mesh.corner_vertex].astype(np.float64), Scalp(body(5))
    assert np.linalg.norm(p[dark] - scalp.middle, axis=1).max() < 1.6 * scalp.size
    assert dark[np.linalg.norm(p - (scalp.middle + scalp.size * np.eye(3)[1]), axis=1) < 0.4 * scalp.size].all()


def test_long_hair_lies_on_what_shoulders_wear() -> None:
    part = hair(body(3), "long", (60, 45, 35), np.random.default_rng(0), over=0.016)
    assert part is not None
    p = part.levels[0].vertices.astype(np.float64)
    low = p[p[:, 1] < body(3).skeleton.rest[JOINT_INDEX["neck"], 1] - 0.04]
    off = -skin(3).depth(low)
    assert len(low) > 50
    assert np.quantile(off, 0.05) > 0.010


@pytest.mark.parametrize("style", ["short", "side_parting"])
def test_short_hair_ends_at_the_hairline_beside_and_behind_the_face(style: str) -> None:
    for who in (3, 7):
        p = grown(who, style).levels[0].vertices.astype(np.float64)
        scalp = Scalp(body(who))
        past = -scalp.inside(p)[np.abs(scalp.angles(p)[0]) > 1.0]
        # The skin itself is lifted by a cap beyond it, and the ends of locks are wide.
        assert past.max() < 0.013 * scalp.size / 0.095


def test_the_same_seed_grows_the_same_hair_and_another_seed_other_hair() -> None:
    a, b, c = (grown(2, "bob", seed).levels[0].vertices for seed in (1, 1, 2))
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)


def test_an_unknown_style_is_refused_in_one_line() -> None:
    with pytest.raises(ValueError, match=r"^hair: expected one of shaved, .*, got 'mohawk'$"):
        vistel.figure.person(hair="mohawk")
    with pytest.raises(ValueError, match="'wig'"):
        hair(body(0), "wig", (0, 0, 0), np.random.default_rng(0))


def test_a_beard_moves_with_the_face_and_leaves_the_lips_free() -> None:
    for style in BEARDS:
        part = beard(body_model(), body(3), style, (60, 45, 35), np.random.default_rng(0))
        if part is None:
            assert style == "none"
            continue
        check_avatar(joined(body(3), [part]), style)
        finest = part.levels[0]
        opened = next(t for t in finest.targets if t.name == "jawOpen")
        assert style == "moustache" or np.linalg.norm(opened.offset, axis=1).max() > 0.01
        inside = skin(3).depth(finest.vertices.astype(np.float64))
        assert np.mean(inside > 0.002) < 0.012
    with pytest.raises(ValueError, match=r"^beard: expected one of none, .*, got 'goatee'$"):
        vistel.figure.person("male", beard="goatee")


def test_people_are_told_their_hair_or_have_a_usual_one() -> None:
    plain = make(Person(face_seed=1, hair="shaved"))
    for style in ("", "bun"):
        assert len(make(Person(face_seed=1, hair=style)).mesh.vertices) > len(plain.mesh.vertices)
    drawn_styles = {usual_style("male", 40.0, np.random.default_rng(seed)) for seed in range(60)}
    assert len(drawn_styles) >= 4 and drawn_styles <= set(STYLES)


@pytest.mark.parametrize("turn", [-60.0, 60.0])
def test_long_hair_stays_out_of_the_shoulders_of_a_head_that_turns(turn: float) -> None:
    part = grown(2, "long")
    bare = body(2)
    posture = with_joints(standing(), {"head": (0.0, turn, 0.0)})
    count = len(bare.mesh.vertices)
    turned = Skin(Figure(bare).pose(posture).vertices.astype(np.float64))
    moved = Figure(joined(bare, [part])).pose(posture).vertices[count:].astype(np.float64)
    inside = turned.depth(moved)
    assert np.mean(inside > 0.002) < 0.02
    assert np.mean(inside > 0.01) < 0.005
