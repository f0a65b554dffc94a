"""Clothes: they lie outside the body, end in clean rims, keep within the levels' vertices, and leave nothing uncovered."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.avatar.check import check_avatar
from vistel.figure.body_model.assemble import assemble
from vistel.figure.body_model.model import body_model
from vistel.figure.body_model.person import Person, fit
from vistel.figure.clothes.blazer import BLAZER, blazer
from vistel.figure.clothes.build import Build
from vistel.figure.clothes.cut import loops
from vistel.figure.clothes.outfit import outfit
from vistel.figure.clothes.shell import shell
from vistel.figure.clothes.tops import T_SHIRT, above, hem_height, neckline, sleeves, top_pattern
from vistel.figure.clothes.wardrobe import BOTTOMS, SHOES, TOPS, Outfit, drawn_outfit
from vistel.figure.clothes.weave import Weave
from vistel.figure.figure import Figure, vertex_normals
from vistel.figure.making.assembly.piece import closest
from vistel.figure.part import Part, joined
from vistel.figure.posture.standard import standard_postures

PEOPLE = {
    "thin": Person("female", 28.0, 1.66, 52.0),
    "heavy": Person("male", 45.0, 1.76, 108.0),
    "child": Person("male", 7.0),
    "old": Person("female", 70.0, 1.58, 78.0),
}
MOST = (13_000, 4_750, 1_970)
"""Vertices of a dressed person on each level."""


@cache
def body(name: str) -> Avatar:
    """Bald and bare. A painted skin would take longer than all the rest."""
    return assemble(body_model(), fit(PEOPLE[name]).shape, name=name)


@cache
def worn(name: str, top: str, bottom: str) -> tuple[Part, ...]:
    return outfit(body(name), Outfit(top=top, bottom=bottom))


@pytest.mark.parametrize("name", PEOPLE)
@pytest.mark.parametrize("top", TOPS)
def test_everybody_can_wear_everything_within_the_vertices_of_each_level(name: str, top: str) -> None:
    bottom = {"dress": "skirt", "shirt": "skirt", "blazer": "jeans"}.get(top, "trousers")
    dressed = joined(body(name), worn(name, top, bottom))
    check_avatar(dressed, name)
    for level, most in zip((dressed, *dressed.coarser), MOST, strict=True):
        assert len(level.mesh.vertices) <= most
        assert np.isfinite(level.mesh.vertices).all()
    assert all(max(part.albedo.shape) <= 512 for part in worn(name, top, bottom))


@pytest.mark.parametrize("name", PEOPLE)
def test_a_shell_lies_outside_the_skin_and_ends_in_one_closed_rim_at_each_border(name: str) -> None:
    build = Build.of(body(name))
    borders = {"neck": neckline(build, *T_SHIRT.neck), "hem": above(hem_height(build, T_SHIRT.hem)), "cuff": sleeves(build, 0.35)}
    made = shell(build, top_pattern(build, T_SHIRT, borders))
    assert {rim: len(rings) for rim, rings in made.rims.items()} == {"neck": 1, "hem": 1, "cuff": 2}
    assert sorted(len(r) for r in loops(made.cloth.triangles)) == sorted(len(r) for rings in made.rims.values() for r in rings)
    skin = build.levels[0].vertices.astype(np.float64)
    nearest = np.array([np.argmin(np.square(skin - p).sum(axis=1)) for p in made.cloth.points])
    out = ((made.cloth.points - skin[nearest]) * build.normals[0][nearest]).sum(axis=1)
    assert np.quantile(out, 0.01) > 0.002
    # A hem is a clean line: as high all round, to some millimetres.
    hem = made.cloth.points[made.rims["hem"][0], 1]
    assert np.ptp(hem) < 0.012


@pytest.mark.parametrize("name", ["thin", "heavy", "old"])
def test_a_hem_stays_inside_the_cloth_that_it_is_folded_from(name: str) -> None:
    jacket = blazer("blazer", Build.of(body(name)), BLAZER, Weave(), 0)
    # Lapels are folded outwards, and face the cloth beneath them.
    cover = jacket.cloth.points[jacket.cloth.triangles[jacket.cloth.panel != jacket.cloth.panels.index("lapel")]]
    face = np.cross(cover[:, 1] - cover[:, 0], cover[:, 2] - cover[:, 0])
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    shares = np.array([(a, b, 8 - a - b) for a in range(9) for b in range(9 - a)]) / 8.0
    assert len(jacket.hems) == 3
    for folded in jacket.hems:
        places = np.einsum("kc,fcx->fkx", shares, folded.points[folded.triangles]).reshape(-1, 3)
        on, share, _ = closest(places, cover)
        out = ((places - np.einsum("nk,nkc->nc", share, cover[on])) * face[on]).sum(axis=1)
        # What lies beside the cloth's border is not over it.
        assert out[share.min(axis=1) > 0.02].max() < 0.0004
        assert out.min() < -0.004


def test_cuffs_are_round() -> None:
    jacket = blazer("blazer", Build.of(body("thin")), BLAZER, Weave(), 0)
    rings = [ring for ring in loops(jacket.cloth.triangles) if np.ptp(jacket.cloth.points[ring, 0]) < 0.03]
    assert len(rings) == 2
    for ring in rings:
        edge = np.diff(jacket.cloth.points[ring], axis=0, append=jacket.cloth.points[ring[:1]])
        along = edge / np.linalg.norm(edge, axis=1, keepdims=True)
        corner = np.arccos(np.clip((along * np.roll(along, 1, axis=0)).sum(axis=1), -1.0, 1.0))
        assert np.degrees(corner.max()) < 45.0


@pytest.mark.parametrize("top", ["t-shirt", "shirt", "blazer", "dress"])
def test_what_is_not_drawn_of_the_body_stays_under_cloth_in_every_posture(top: str) -> None:
    naked = body("thin")
    parts = worn("thin", top, "trousers")
    hidden = np.any([p.hides[0] for p in parts], axis=0)
    triangles = naked.mesh.triangles[hidden]
    cloth = joined(naked, parts)
    first = len(cloth.mesh.vertices) - sum(len(p.levels[0].vertices) for p in parts)
    bare, dressed = Figure(naked), Figure(cloth)
    for name in ("standing", "sitting", "overhead", "elbow", "table", "bow"):
        posture = standard_postures()[name]
        skin = bare.pose(posture).vertices[triangles].mean(axis=1)[::7]
        over = dressed.pose(posture).vertices[first:]
        near = np.array([np.sqrt(np.square(over - p).sum(axis=1).min()) for p in skin])
        # Cloth is within reach of each place: between vertices 5 cm apart, over hollows, and round both legs at once.
        assert np.quantile(near, 0.99) < (0.13 if top == "dress" else 0.085), name


def test_the_same_words_make_the_same_clothes() -> None:
    a, b = (outfit(body("child"), Outfit(pattern="checks", seed=3)) for _ in range(2))
    for one, other in zip(a, b, strict=True):
        assert np.array_equal(one.albedo, other.albedo)
        assert all(np.array_equal(m.vertices, n.vertices) for m, n in zip(one.levels, other.levels, strict=True))
    assert drawn_outfit("female", 30.0, 4) == drawn_outfit("female", 30.0, 4)
    assert len({drawn_outfit("male", 40.0, seed).top for seed in range(30)}) > 3


@pytest.mark.parametrize(
    ("word", "value", "expected"),
    [("top", "toga", TOPS), ("bottom", "kilt", BOTTOMS), ("shoes", "skis", SHOES), ("pattern", "dots", ("plain", "denim"))],
)
def test_what_is_not_in_the_wardrobe_is_refused_in_one_line(word: str, value: str, expected: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match=f"outfit: {word}: expected one of .*{expected[-1]}.*got '{value}'") as fault:
        Outfit(**{word: value})  # type: ignore[arg-type]
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize("colour", [(300.0, 0.0, 0.0), (1.0, 2.0), (float("nan"), 1.0, 1.0)])
def test_colours_that_are_none_are_refused(colour: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="outfit: top_colour: expected red, green and blue from 0 to 255"):
        replace(Outfit(), top_colour=colour)


def test_skin_under_cloth_gives_way_and_bare_skin_stays() -> None:
    naked = body("heavy")
    parts = worn("heavy", "t-shirt", "trousers")
    sunk = np.max([p.sinks[2] for p in parts if p.sinks], axis=0)
    names = np.array(naked.body.names)[naked.coarser[1].mesh.limb]
    assert not sunk[np.isin(names, ["face", "skull", "left_palm", "right_palm"])].any()
    assert sunk[names == "abdomen"].min() > 0.005
    assert vertex_normals(naked.coarser[1].mesh).shape == (len(sunk), 3)
