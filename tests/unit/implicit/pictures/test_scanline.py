"""Scanline pictures: those of the ray caster, whatever the graph; edits that redo little and give the same picture."""

from __future__ import annotations

import math
from collections.abc import Callable

import numba as nb
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vistel.implicit as vi
from vistel.implicit.scanline import Scanline, ScanlinePicture, render
from vistel.implicit.scanline.lanes_kernels import load
from vistel.implicit.scanline.shade_kernels import power
from vistel.implicit.scene import Camera, Checker, Light, Material, Ripples, Scene, SceneError, encoded, ground
from vistel.implicit.trace import RayCaster
from vistel.implicit.trace import render as trace
from vistel.jit.lanes import store
from vistel.jit.pointers import keep, pointer

NEAR = Camera((2.6, 1.4, 3.1), field_of_view=math.radians(24))
FLAT = Camera((2.6, 1.4, 3.1), height=1.5)
LIGHTS = (Light(position=(3, 5, 4)), Light(towards=(-1, 1, 0.5), colour=(0.3, 0.35, 0.4)))
SIZE = (83, 70)


def scene_of(shape: vi.Shape, camera: Camera = NEAR, size: tuple[int, int] = SIZE, **more: object) -> Scene:
    return Scene(camera, shape, lights=LIGHTS, size=size, **more)  # type: ignore[arg-type]


def ray_cast(scene: Scene) -> ScanlinePicture:
    """The ray caster's picture of the same, without shadows and mirrors."""
    found = trace(scene, depth=0, shadows=False, threads=1)
    return ScanlinePicture(found.light, found.distance.astype(np.float32), found.thing, 1.0)


def differ(a: ScanlinePicture, b: ScanlinePicture) -> tuple[int, int]:
    """Pixels where two pictures see different things; where they see the same in colours more than 2/255 apart."""
    other = a.thing != b.thing
    apart = np.abs(encoded(a.light).astype(int) - encoded(b.light).astype(int)).max(axis=2) > 2
    return int(other.sum()), int((apart & ~other).sum())


def spread(rng: np.random.Generator) -> tuple[float, float, float]:
    x, y, z = rng.uniform(-0.35, 0.35, 3)
    return float(x), float(y), float(z)


def sphere(rng: np.random.Generator) -> vi.Primitive:
    return vi.Sphere(spread(rng), rng.uniform(0.12, 0.3))


def sphylinder(rng: np.random.Generator) -> vi.Primitive:
    return vi.Sphylinder(spread(rng), spread(rng), rng.uniform(0.08, 0.16))


def cone_sphere(rng: np.random.Generator) -> vi.Primitive:
    return vi.ConeSphere(spread(rng), spread(rng), *rng.uniform(0.08, 0.22, 2))


def polygon(rng: np.random.Generator) -> vi.Primitive:
    a, b = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
    turn = np.sort(rng.uniform(0, 2 * math.pi, 5)) if rng.random() < 0.5 else np.array([0.0, 2.1, 4.2])
    return vi.RoundedPolygon(spread(rng) + 0.2 * (np.cos(turn)[:, None] * a + np.sin(turn)[:, None] * b), rng.uniform(0.08, 0.14))


KINDS = (sphere, sphylinder, cone_sphere, polygon)


def many(seed: int, kinds: tuple[Callable[[np.random.Generator], vi.Primitive], ...] = KINDS, count: int = 9) -> list[vi.Primitive]:
    rng = np.random.default_rng(seed)
    return [kinds[i % len(kinds)](rng) for i in range(count)]


@pytest.mark.parametrize("camera", [NEAR, FLAT], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("kinds", [(k,) for k in KINDS] + [KINDS], ids=[k.__name__ for k in KINDS] + ["all"])
def test_a_sum_looks_as_the_ray_caster_sees_it(kinds: tuple[Callable[..., vi.Primitive], ...], camera: Camera) -> None:
    others = shades = seen = 0
    for seed in range(4):
        scene = scene_of(vi.total(*many(seed, kinds)), camera)
        line = Scanline(scene)
        picture, cast = line.draw(), ray_cast(scene)
        other, shade = differ(picture, cast)
        others, shades, seen = others + other, shades + shade, seen + int((cast.thing == 1).sum())
        assert line.surface is not None and line.surface.swept
    assert seen > 2000
    assert others <= max(1, seen // 1000) and shades <= seen // 500


def stretched(shape: vi.Shape) -> vi.Shape:
    return vi.Placed(shape, np.array([[1.4, 0.2, 0, 0.1], [0, 0.7, 0.1, 0], [0, 0.1, 1.1, 0]]))


GRAPHS = {
    "union of sums": lambda: vi.union(vi.total(*many(1)), vi.total(*many(2, (sphere,))), vi.Sphere((0, 0.1, 0.2), 0.3)),
    "difference": lambda: vi.difference(vi.total(*many(3)), vi.Sphere((0.2, 0.2, 0.2), 0.35)),
    "intersection": lambda: vi.intersection(vi.total(*many(4)), vi.Sphere((0, 0, 0), 0.7)),
    "stretched": lambda: vi.total(*(stretched(p) for p in many(5))),
    "pointblob": lambda: vi.total(vi.Pointblob.of_surface(vi.box(0.25), (0, 0, 0)), vi.Sphere((0.3, 0.2, 0.1), 0.3)),
    "superquadrics": lambda: vi.total(
        vi.Superellipsoid((0, 0, 0), (0.4, 0.3, 0.2), 0.4, 0.6), vi.Supertoroid((0, 0.2, 0), (0.3, 0.3, 0.2), 0.9, 1, 1)
    ),
    "other blends": lambda: vi.total(*(vi.Sphere(spread(np.random.default_rng(i)), 0.3, blend=vi.WYVILL) for i in range(5))),
    "negative weight": lambda: vi.total(vi.Sphere((0, 0, 0), 0.6), vi.Sphere((0.2, 0.2, 0.3), 0.4, weight=-1.0)),
    "notched polygon": lambda: vi.RoundedPolygon(
        np.array([[0, 0, 0], [0.5, 0, 0], [0.5, 0.5, 0], [0.3, 0.15, 0], [0, 0.5, 0]]), 0.12
    ),
}


@pytest.mark.parametrize("name", GRAPHS)
def test_any_graph_looks_as_the_ray_caster_sees_it(name: str) -> None:
    scene = scene_of(GRAPHS[name]())
    picture, cast = render(scene), ray_cast(scene)
    other, shade = differ(picture, cast)
    assert (cast.thing == 1).sum() > 200
    assert other <= 1 and shade <= 3


def test_materials_textures_bumps_and_polygons_are_those_of_the_ray_caster() -> None:
    parts = [Material(colour=(i / 9, 1 - i / 9, 0.5), specular=i / 20).on(p) for i, p in enumerate(many(6))]
    parts[0] = Material(texture=Checker(size=0.1), bump=Ripples(0.01, 0.05)).on(vi.Sphere((0, 0.1, 0), 0.5))
    floor = ground(-0.3, 1.5, Material(texture=Checker(), specular=0.0))
    scene = scene_of(vi.total(*parts), meshes=(floor,))
    picture, cast = render(scene), ray_cast(scene)
    other, shade = differ(picture, cast)
    assert {0, 1, 2} == set(np.unique(cast.thing))
    assert other <= 2 and shade <= 6


def test_polygons_alone_are_drawn_and_cut_off_before_the_eye() -> None:
    scene = Scene(Camera((0, 0.4, 0), (0, 0, -3), field_of_view=1.2), None, (ground(0.0, 5.0),), LIGHTS, size=SIZE)
    picture, cast = render(scene), ray_cast(scene)
    assert (cast.thing == 2).sum() > 1000
    assert differ(picture, cast)[0] <= 2


def test_an_eye_within_the_field_is_left_to_the_ray_caster() -> None:
    scene = scene_of(vi.total(*many(7)), Camera((0.1, 0.1, 0.5), field_of_view=1.4))
    assert differ(render(scene), ray_cast(scene))[0] <= 1


@pytest.mark.parametrize("width", [1, 15, 16, 17, 64])
def test_pictures_of_any_width_are_whole(width: int) -> None:
    scene = scene_of(vi.total(*many(8)), size=(width, 9))
    picture, cast = render(scene), ray_cast(scene)
    assert picture.light.shape == (9, width, 3) and differ(picture, cast)[0] == 0


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_what_is_found_is_on_the_surface_and_nothing_is_before_it(seed: int) -> None:
    scene = scene_of(vi.total(*many(seed, count=12)), size=(48, 20))
    picture, program = render(scene), scene.program
    assert program is not None
    rows, columns = np.nonzero(picture.thing)
    origins, along = scene.camera.rays(scene.size, np.stack([columns, rows], axis=1) + 0.5)
    t = picture.depth[rows, columns] / (along @ scene.camera.frame[2])
    field = program.field(origins + t[:, None] * along)
    assert np.abs(field - 0.5).max(initial=0.0) < 1e-3
    before = np.linspace(0.0, 1.0, 200, endpoint=False)[None, :, None] ** 0.2
    inside = program.field(origins[:, None] + before * t[:, None, None] * along[:, None]) > 0.5 + 1e-4
    assert not inside.any()


def moved(parts: list[vi.Primitive], by: tuple[float, float, float]) -> vi.Shape:
    first = parts[0]
    return vi.total(vi.Sphere(tuple(np.add(first.centre, by)), first.radius), *parts[1:])  # type: ignore[attr-defined]


@pytest.mark.parametrize("by", [(0.05, 0.0, 0.0), (0.0, -0.3, 0.1), (0.9, 0.0, 0.0)])
def test_an_edit_gives_the_picture_that_drawing_anew_gives_bit_for_bit(by: tuple[float, float, float]) -> None:
    parts = [vi.Sphere((-0.2, 0.1, 0.1), 0.2), *many(9)]
    line = Scanline(scene_of(vi.total(*parts)))
    line.draw()
    edited = line.edit(moved(parts, by))
    anew = line.draw()
    assert 0 < edited.redrawn < 0.6
    for name in ("light", "depth", "thing"):
        assert np.array_equal(getattr(edited, name), getattr(anew, name))


def test_edits_after_edits_end_where_they_began() -> None:
    parts = [vi.Sphere((-0.2, 0.1, 0.1), 0.2), *many(10)]
    line = Scanline(scene_of(vi.total(*parts)))
    before = line.draw()
    for step in range(1, 6):
        line.edit(moved(parts, (0.1 * step, 0.05 * step, 0.0)))
    assert np.array_equal(line.edit(vi.total(*parts)).light, before.light)


@pytest.mark.parametrize("name", ["union of sums", "difference", "pointblob"])
def test_an_edit_of_any_graph_gives_what_drawing_anew_gives(name: str) -> None:
    def shape(x: float) -> vi.Shape:
        return vi.union(GRAPHS[name](), vi.Sphere((x, 0.3, 0.3), 0.15))

    floor = ground(-0.4, 1.0)
    line = Scanline(scene_of(shape(0.0), meshes=(floor,)))
    line.draw()
    edited = line.edit(shape(0.2))
    anew = line.draw()
    assert edited.redrawn < 0.6
    assert differ(edited, anew) == (0, 0)


def test_an_edit_that_adds_a_primitive_draws_it() -> None:
    parts = many(11)
    line = Scanline(scene_of(vi.total(*parts)))
    line.draw()
    edited = line.edit(vi.total(*parts, vi.Sphere((0.3, 0.3, 0.3), 0.3)))
    assert differ(edited, render(scene_of(vi.total(*parts, vi.Sphere((0.3, 0.3, 0.3), 0.3)))))[0] == 0


def test_a_changed_colour_is_seen() -> None:
    red, blue = Material(colour=(0.9, 0.1, 0.1)), Material(colour=(0.1, 0.1, 0.9))
    parts = many(12)
    line = Scanline(scene_of(vi.total(*(red.on(p) for p in parts))))
    line.draw()
    edited = line.edit(vi.total(blue.on(parts[0]), *(red.on(p) for p in parts[1:])))
    assert differ(edited, render(line.scene)) == (0, 0)


def test_nothing_reaches_the_threshold_and_the_picture_is_empty() -> None:
    picture = render(scene_of(vi.Sphere((0, 0, 0), 0.4, weight=0.3)))
    assert not picture.thing.any() and np.isinf(picture.depth).all()


def test_an_object_without_end_is_refused_in_one_line() -> None:
    with pytest.raises(SceneError, match=r"^shapes: the object has no end .* intersect it with a bounded shape$"):
        Scanline(scene_of(vi.Complement(vi.Sphere((0, 0, 0), 0.4))))


def test_an_offset_far_from_the_origin_keeps_its_precision() -> None:
    away = np.array([300.0, -200.0, 500.0])
    parts = [vi.Placed(p, np.column_stack([np.eye(3), away])) for p in many(13)]
    camera = Camera(tuple(np.add(NEAR.position, away)), tuple(away), field_of_view=NEAR.field_of_view)
    lights = (Light(towards=(1, 2, 3)),)
    there = render(Scene(camera, vi.total(*parts), lights=lights, size=SIZE))
    here = render(Scene(NEAR, vi.total(*many(13)), lights=lights, size=SIZE))
    assert differ(there, here)[0] <= 3


@nb.njit
def _powers(base: np.ndarray, exponent: np.ndarray, out: np.ndarray) -> None:
    store(pointer(out), power(load(pointer(base)), load(pointer(exponent))))
    keep(base, exponent, out)


@given(st.lists(st.tuples(st.floats(0, 1, width=32), st.floats(1, 200, width=32)), min_size=16, max_size=16))
@settings(deadline=None)
def test_highlights_have_the_powers_of_their_shininess(pairs: list[tuple[float, float]]) -> None:
    base, exponent = np.array(pairs, np.float32).T.copy()
    out = np.empty(16, np.float32)
    _powers(base, exponent, out)
    assert np.allclose(out, base.astype(np.float64) ** exponent, atol=2e-4)


def test_the_ray_caster_and_the_scanline_agree_on_every_root() -> None:
    scene = scene_of(vi.total(*many(14, count=20)))
    picture = render(scene)
    rows, columns = np.nonzero(picture.thing)
    origins, along = scene.camera.rays(scene.size, np.stack([columns, rows], axis=1) + 0.5)
    assert scene.program is not None
    t = RayCaster(scene.program).first(origins, along)
    assert np.abs(t * (along @ scene.camera.frame[2]) - picture.depth[rows, columns]).max() < 1e-4
