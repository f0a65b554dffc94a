"""Pictures: the quick ways draw what the general way draws; lamps, mirrors, textures and polygons do what they say."""

from __future__ import annotations

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import vistel.implicit as vi
from vistel.implicit.scene import Camera, Checker, Light, Material, Mesh, Ripples, Scene, ground, load, mesh_of
from vistel.implicit.trace import MeshTree, Tracer, render
from vistel.implicit.trace.exact import Exact
from vistel.implicit.trace.report import report, warnings
from vistel_cli.main import app

ROOT = Path(__file__).resolve().parents[4]
CAMERA = Camera((2.0, 1.5, 4.0), field_of_view=0.5)
LAMPS = (Light((3, 6, 4)), Light(towards=(-1, 1, 1), colour=(0.3, 0.3, 0.4)))
CLAY, STEEL = Material((0.8, 0.4, 0.3)), Material((0.5, 0.6, 0.7), reflection=0.6)
BALLS = vi.Sphere.of_surface((0, 0, 0), 0.5) + vi.Sphylinder.of_surface((0.5, 0.2, 0.3), (0.9, 0.5, 0), 0.2)
BLOBS = vi.total(
    vi.Pointblob.of_surface(vi.sphere_mesh(0.4, 8, 12), (0, 0, 0)),
    vi.Pointblob.of_surface(vi.box(0.25, (0.6, 0, 0)), (0.6, 0, 0)),
    vi.Sphere.of_surface((0, 0.6, 0.2), 0.2),
)


def scene(shape: vi.Shape | None, **more: object) -> Scene:
    return Scene(CAMERA, shape, lights=LAMPS, size=(64, 48), **more)  # type: ignore[arg-type]


def rays(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    y, x = np.mgrid[: scene.size[1], : scene.size[0]]
    return scene.camera.rays(scene.size, np.stack([x, y], axis=-1).reshape(-1, 2) + 0.5)


@pytest.mark.parametrize("height", [None, 2.0])
@pytest.mark.parametrize("shininess", [40.0, 12.5])
def test_drawing_in_packets_gives_what_the_general_way_gives(height: float | None, shininess: float) -> None:
    view = replace(scene(replace(CLAY, shininess=shininess).on(BALLS)), camera=replace(CAMERA, height=height))
    quick, general = render(view, threads=1), Tracer(view, method="numeric").prepare().seen(*rays(view))
    assert Tracer(view).plain is not None
    assert np.array_equal(quick.thing.ravel(), general.thing)
    hit = general.thing > 0
    assert 500 < hit.sum() < 3000
    assert quick.distance.ravel()[hit] == pytest.approx(general.distance[hit], abs=1e-4)
    differs = np.abs(quick.light.reshape(-1, 3) - general.colour).max(axis=1) > 2e-3
    assert differs.sum() <= 0.005 * hit.sum()  # edges of shadows


def test_polygons_that_are_the_surface_give_the_picture_of_the_field() -> None:
    view = scene(CLAY.on(BLOBS))
    kept, solved = Tracer(view).prepare(), Tracer(view, retain=False, method="numeric", samples=24).prepare()
    assert kept.exact is not None
    o, d = rays(view)
    far = np.full(len(o), np.inf)
    a, b = kept.hits(o, d, far)[0], solved.hits(o, d, far)[0]
    assert np.count_nonzero(np.isfinite(a) != np.isfinite(b)) <= 2
    both = np.isfinite(a) & np.isfinite(b)
    assert np.count_nonzero(np.abs(a[both] - b[both]) > 1e-4) <= 2
    assert np.abs(BLOBS.field(o[both] + a[both, None] * d[both]) - 0.5).max() <= 1e-5


def test_a_union_of_sums_keeps_its_polygons_too() -> None:
    view = scene(BLOBS | vi.Pointblob.of_surface(vi.box(0.2, (-0.6, 0, 0.3)), (-0.6, 0, 0.3)))
    kept, solved = Tracer(view).prepare(), Tracer(view, retain=False).prepare()
    o, d = rays(view)
    a, b = (t.hits(o, d, np.full(len(o), np.inf))[0] for t in (kept, solved))
    assert np.nan_to_num(a, posinf=9) == pytest.approx(np.nan_to_num(b, posinf=9), abs=1e-4)


def test_point_setblobs_keep_their_polygons() -> None:
    flat = vi.sphere_mesh(0.5, 10, 16).transformed(np.diag([1.0, 0.4, 1.0, 1.0])[:3])
    shape = vi.PointSetblob(flat, [(-0.2, 0, 0), (0.2, 0, 0)]) + vi.Sphere.of_surface((0.3, 0.2, 0.1), 0.15)
    view = scene(shape)
    kept, solved = Tracer(view).prepare(), Tracer(view, retain=False, samples=24).prepare()
    assert kept.exact is not None
    o, d = rays(view)
    a, b = (t.hits(o, d, np.full(len(o), np.inf))[0] for t in (kept, solved))
    assert np.count_nonzero(np.abs(np.nan_to_num(a, posinf=9) - np.nan_to_num(b, posinf=9)) > 2e-4) <= 2


def test_primitives_apart_have_no_boxes_and_no_candidates() -> None:
    cubes = [vi.Pointblob.of_surface(vi.box(0.2, (x, 0, 0)), (x, 0, 0)) for x in (-2.0, 0.0, 2.0)]
    exact = Exact.of(vi.compile(vi.total(*cubes)), 0.5)
    assert exact is not None
    assert (exact.polygons, exact.candidates, exact.pairs, len(exact.boxes)) == (18, 0, 0, 0)
    near = Exact.of(vi.compile(vi.total(cubes[0], cubes[1].moved((-1.5, 0, 0)))), 0.5)
    assert near is not None
    assert 0 < near.candidates < 12
    assert near.pairs == 1
    assert Exact.of(vi.compile(vi.subtract(*cubes[:2])), 0.5) is None


def test_the_report_has_the_columns_of_table_1() -> None:
    found = report(scene(BLOBS, meshes=[ground(-1)]))
    assert found["primitives"] == 3
    assert found["polygons"] == 96 + 6
    assert 0 < found["candidate_polygons"] <= found["polygons"]
    assert found["intersection_boxes"] == 3
    assert found["mesh_triangles"] == 2


def test_a_mirror_shows_what_is_before_it_and_depth_ends_it() -> None:
    wall = Mesh(np.array([(-9, -9, -1), (9, -9, -1), (0, 20, -1)], float), np.array([[0, 1, 2]]), STEEL)
    ball = replace(CLAY, ambient=1.0, diffuse=0.0, specular=0.0).on(vi.Sphere.of_surface((0, 0, 1), 0.4))
    view = Scene(Camera((0, 0, 5), height=4), ball, [wall], size=(41, 41), background=(0, 0, 1))
    shown, plain = render(view, threads=1, depth=1), render(view, threads=1, depth=0)
    assert not np.allclose(shown.light[2, 2], plain.light[2, 2])
    assert shown.light[2, 2, 2] == pytest.approx(0.6 * 1 + 0.4 * plain.light[2, 2, 2], abs=1e-3)  # the blue behind
    assert shown.light[20, 20] == pytest.approx(CLAY.colour, abs=1e-3)


def test_shadows_fall_and_can_be_left_out_for_all_or_for_a_lamp() -> None:
    lamp = Light((0, 5, 0))
    view = Scene(Camera((0, 3, 4)), CLAY.on(vi.Sphere.of_surface((0, 1, 0), 0.5)), [ground(0, 20)], [lamp], size=(40, 40))
    dark, light = render(view, threads=1), render(view, threads=1, shadows=False)
    quiet = render(replace(view, lights=[replace(lamp, shadows=False)]), threads=1)
    assert light.light.sum() > dark.light.sum()
    assert quiet.light == pytest.approx(light.light)
    where = np.argwhere((light.light - dark.light).max(axis=2) > 0.1)
    points, _ = view.camera.rays(view.size, where[:, ::-1] + 0.5)
    assert len(where) > 20
    assert (dark.thing[where[:, 0], where[:, 1]] == 2).all()
    assert points.shape[1] == 3


def test_polygons_hide_the_surface_and_the_surface_hides_polygons() -> None:
    quad = Mesh(np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float), np.array([[0, 1, 2], [0, 2, 3]]))
    view = Scene(Camera((0, 0, 5), height=3), vi.Sphere.of_surface((0, 0, -0.1), 0.5), [quad], size=(30, 30))
    thing = render(view, threads=1).thing
    assert thing[15, 15] == 1
    assert thing[15, 22] == 2
    assert thing[0, 0] == 0
    assert (render(replace(view, meshes=[replace(quad, vertices=quad.vertices + np.array([0, 0, 1]))]), threads=1).thing != 1).all()


def test_textures_are_looked_up_at_the_surface_point_of_the_primitive() -> None:
    texture = Checker((1, 0, 0), (0, 1, 0), 0.5)
    view = Scene(Camera((0.1, 0.1, 5), (0.1, 0.1, 0), height=3), replace(CLAY, texture=texture).on(vi.Sphere((0, 0, 0), 1)))
    seen = Tracer(view).prepare().look(np.array([[0.2, 0.2, 0.459]]), np.array([-1]), np.array([[0, 0, -1.0]]))
    boundary = vi.Sphere((0, 0, 0), 1).boundary_point([[0.2, 0.2, 0.459]])
    assert seen.colour[0] == pytest.approx(texture(boundary)[0])


def test_bumps_tilt_normals_but_not_the_surface() -> None:
    smooth = scene(CLAY.on(BALLS))
    bumpy = scene(replace(CLAY, bump=Ripples(0.02, 0.1)).on(BALLS))
    a, b = render(smooth, threads=1), render(bumpy, threads=1)
    assert np.array_equal(a.thing, b.thing)
    assert np.abs(a.light - b.light).max() > 0.1


def test_antialiasing_softens_edges_only() -> None:
    view = scene(CLAY.on(BALLS))
    hard, soft = render(view, threads=1), render(view, threads=1, antialias=0.1)
    assert 0 < soft.refined < 0.5 * hard.thing.size
    same = (hard.light == soft.light).all(axis=2)
    assert same.mean() > 0.5
    assert np.array_equal(hard.thing, soft.thing)


def test_pictures_do_not_depend_on_threads_and_progress_rises_to_one() -> None:
    view = scene(CLAY.on(BLOBS), meshes=[ground(-0.6)])
    parts: list[float] = []
    one = render(view, threads=1, antialias=0.1)
    four = render(view, threads=4, antialias=0.1, progress=parts.append)
    assert one.light == pytest.approx(four.light, abs=1e-5)
    assert parts[-1] == 1.0
    assert parts == sorted(parts)


def test_triangles_are_found_as_by_trying_all() -> None:
    random = np.random.default_rng(2)
    corners = random.uniform(-1, 1, (300, 1, 3)) + 0.2 * random.normal(size=(300, 3, 3))
    o, d = random.normal(size=(200, 3)) * 2, random.normal(size=(200, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    t, which = MeshTree.of(corners).cast(o, d, np.zeros(200), np.full(200, np.inf))
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    matrix = np.stack(np.broadcast_arrays(-d[:, None], u[None], v[None]), axis=-1)
    s = np.linalg.solve(matrix, (o[:, None] - a[None])[..., None])[..., 0]
    inside = (s[..., 0] >= 0) & (s[..., 1] >= 0) & (s[..., 2] >= 0) & (s[..., 1] + s[..., 2] <= 1)
    every = np.where(inside, s[..., 0], np.inf)
    assert t == pytest.approx(every.min(axis=1))
    hit = np.isfinite(t)
    assert np.array_equal(which[hit], every.argmin(axis=1)[hit])
    assert (which[~hit] == -1).all()


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        (0.3 * vi.Sphere((0, 0, 0), 1), "never reaches the threshold 0.5 .*0.3 at most"),
        (vi.Sphere((0, 0, 0), 1, weight=0.3) + vi.Sphere((5, 0, 0), 1, weight=0.3), "0.3 at most where it was sampled"),
        (vi.Sphere((0, 0, 0), 1) & vi.Sphere((5, 0, 0), 1), "at most where it was sampled"),
        (vi.Sphere((0, 0, 0), 1), ""),
    ],
)
def test_a_field_that_never_reaches_the_threshold_is_reported(shape: vi.Shape, said: str) -> None:
    lines = warnings(scene(shape))
    if not said:
        assert lines == []
        return
    (line,) = lines
    assert "\n" not in line
    assert re.search(said, line)


def run(*words: str) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, ["trace", *words])
    return done.exit_code, done.stdout, done.stderr


def test_the_command_writes_the_picture_and_reports(tmp_path: Path) -> None:
    code, out, _ = run(str(ROOT / "examples/scenes/blobs.toml"), "-o", str(tmp_path / "a.png"), "--size", "64x40", "--json")
    assert code == 0
    facts = json.loads(out)
    assert (facts["width"], facts["height"], facts["primitives"]) == (64, 40, 7)
    assert facts["candidate_polygons"] >= 0
    assert (tmp_path / "a.png").stat().st_size > 500


BAD = {
    "no.toml": (None, "no such file"),
    "empty.toml": ("[camera]\nposition = [0, 0, 5]\n", "something to see"),
    "endless.toml": (
        '[camera]\nposition = [0, 0, 5]\n[shapes.a]\nkind = "complement"\nof = [{kind = "sphere", radius = 1}]\n',
        "has no end",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_scene_ends_the_command_with_one_line(tmp_path: Path, name: str) -> None:
    text, said = BAD[name]
    if text is not None:
        (tmp_path / name).write_text(text)
    code, _, error = run(str(tmp_path / name), "-o", str(tmp_path / "a.png"))
    assert code == 1
    assert said in error
    assert error.count("\n") == 1
    assert not (tmp_path / "a.png").exists()


@pytest.mark.skipif(os.name == "nt", reason="POSIX paths")
def test_an_output_that_cannot_be_written_is_reported_before_work_starts(tmp_path: Path) -> None:
    for output, said in ((tmp_path / "no" / "a.png", "there is no folder"), (tmp_path / "a.tiff", "expected .png")):
        code, _, error = run(str(ROOT / "examples/scenes/blobs.toml"), "-o", str(output))
        assert (code, error.count("\n")) == (1, 1)
        assert said in error
    code, _, error = run(str(ROOT / "examples/scenes/blobs.toml"), "--size", "big")
    assert (code, "expected WIDTHxHEIGHT" in error) == (2, True)


def test_an_impossible_method_is_reported(tmp_path: Path) -> None:
    code, _, error = run(str(ROOT / "examples/scenes/blobs.toml"), "-o", str(tmp_path / "a.png"), "--method", "march")
    assert code in (1, 2)
    assert "use auto" in error


def test_a_scene_of_polygons_alone_is_drawn() -> None:
    view = scene(None, meshes=[mesh_of(vi.box(0.5), STEEL)])
    assert (render(view, threads=1).thing == 2).sum() > 200
    assert load(ROOT / "examples/scenes/blobs.toml").size == (640, 400)
