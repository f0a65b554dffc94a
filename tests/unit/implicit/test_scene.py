"""Scene files are read whole or refused in one line that names file, key and what was expected."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

import vistel.implicit as vi
from vistel.implicit.primitives.kinds import KINDS
from vistel.implicit.scene import (
    Camera,
    Checker,
    Light,
    Material,
    Mesh,
    Scene,
    SceneError,
    check_writable,
    encoded,
    load,
    parse,
    read_polygons,
    write_png,
)
from vistel.implicit.scene.entries import AnyShape
from vistel.implicit.scene.file import MOST_SHAPES

ROOT = Path(__file__).resolve().parents[3]
VIEW = {"camera": {"position": [0, 0, 5]}}

EVERY_KIND: dict[str, dict[str, Any]] = {
    "sphere": {"radius": 0.3},
    "sphylinder": {"start": [0, 0, 0], "end": [1, 0, 0], "radius": 0.2},
    "cone_sphere": {"start": [0, 0, 0], "end": [1, 0, 0], "radii": [0.2, 0.1]},
    "rounded_polygon": {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "radius": 0.1},
    "superellipsoid": {"half_axes": [0.3, 0.2, 0.1], "e1": 0.5},
    "supertoroid": {"half_axes": [0.1, 0.1, 0.1], "alpha": 3},
    "pointblob": {"volume": {"box": [0.2, 0.2, 0.2]}},
    "point_setblob": {"volume": {"box": [0.3, 0.2, 0.2]}, "centres": [[-0.1, 0, 0], [0.1, 0, 0]]},
    "polyblob": {"hull": {"box": [0.3, 0.3, 0.3]}, "core": {"sphere": 0.1}},
}


def scene(shapes: dict[str, Any] | None = None, **more: Any) -> Scene:
    return parse({**VIEW, "shapes": shapes or {}, **more}, "s.toml")


def test_there_is_an_entry_for_every_kind_of_primitive() -> None:
    assert set(EVERY_KIND) == {kind.name for kind in KINDS} - {"ramp"}  # a ramp is half a ghost, never a shape


@pytest.mark.parametrize("kind", EVERY_KIND)
def test_every_kind_makes_the_library_s_primitive(kind: str) -> None:
    shape = scene({"a": {"kind": kind, **EVERY_KIND[kind]}}).shape
    assert isinstance(shape, vi.Primitive)
    assert shape.kind == kind


@pytest.mark.parametrize("name", sorted(p.name for p in (ROOT / "examples/scenes").glob("*.toml")))
def test_the_examples_are_valid(name: str) -> None:
    read = load(ROOT / "examples/scenes" / name)
    assert read.program is not None or read.meshes


def test_the_reference_shows_a_valid_file_with_every_kind_of_shape() -> None:
    text = (ROOT / "docs/reference/scene-file.md").read_text("utf-8")
    shown = tomllib.loads(re.findall(r"```toml\n(.*?)```", text, re.DOTALL)[0])
    assert parse(shown).program is not None
    assert set(EVERY_KIND) <= {shape["kind"] for shape in shown["shapes"].values()}
    kinds = {k for model in get_args(get_args(AnyShape)[0]) for k in get_args(model.model_fields["kind"].annotation)}
    for name in kinds:
        assert f'"{name}"' in text


def test_surface_sizes_are_those_of_the_surface_and_influence_sizes_those_of_the_realm() -> None:
    shape = scene({"a": {"kind": "sphere", "radius": 0.3}}, threshold=0.4).shape
    assert shape is not None
    assert shape.field([0.3, 0, 0]) == pytest.approx(0.4)
    shape = scene({"a": {"kind": "sphere", "radius": 0.3, "sizes": "influence"}}).shape
    assert shape is not None
    assert shape.bounds[1, 0] == pytest.approx(0.3)


def test_combinations_are_those_of_the_library() -> None:
    parts = {"a": {"kind": "sphere", "radius": 0.3}, "b": {"kind": "sphere", "radius": 0.2, "centre": [0.3, 0, 0]}}
    a, b = vi.Sphere.of_surface((0, 0, 0), 0.3), vi.Sphere.of_surface((0.3, 0, 0), 0.2)
    expected = {
        "sum": ({}, a + b),
        "union": ({}, a | b),
        "intersection": ({"power": 3}, vi.intersection(a, b, power=3)),
        "difference": ({}, a - b),
        "subtract": ({}, vi.subtract(a, b)),
        "diff": ({"power": 3}, vi.Diff((a, b), 3)),
        "selective": ({"blends": [[0, 1]]}, a + b),
    }
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (200, 3))
    for kind, (options, shape) in expected.items():
        made = scene(parts | {"c": {"kind": kind, "of": ["a", "b"], **options}}).shape
        assert made is not None
        assert made.field(points) == pytest.approx(shape.field(points)), kind
    inside_out = scene(parts | {"c": {"kind": "complement", "of": ["a"]}}, show=["c"]).shape
    assert inside_out is not None
    assert inside_out.field(points) == pytest.approx((~a).field(points))


def test_shapes_that_no_other_is_made_of_are_shown_as_a_union_unless_show_says_otherwise() -> None:
    parts = {n: {"kind": "sphere", "radius": 0.3, "centre": [x, 0, 0]} for n, x in (("a", 0), ("b", 1), ("c", 2))}
    whole = scene(parts | {"ab": {"kind": "sum", "of": ["a", "b"]}})
    assert whole.program is not None
    assert len(whole.program.arrays["leaf"]) == 3
    part = scene(parts, show=["b"]).shape
    assert isinstance(part, vi.Sphere)


def test_placement_scales_turns_then_moves() -> None:
    placed = {
        "kind": "sphere",
        "radius": 0.1,
        "centre": [1, 0, 0],
        "scale": 2,
        "translate": [0, 0, 1],
        "rotate": {"axis": [0, 1, 0], "angle": 90},
    }
    shape = scene({"a": placed}).shape
    assert shape is not None
    assert shape.field([0, 0, -1]) == pytest.approx(1)
    mesh = scene(meshes=[{"solid": {"box": [0.1, 0.1, 0.1]}, "translate": [0, 2, 0]}]).meshes[0]
    assert mesh.vertices.mean(axis=0) == pytest.approx([0, 2, 0])


def test_materials_blend_and_what_has_none_takes_the_scene_s() -> None:
    read = scene(
        {"a": {"kind": "sphere", "radius": 0.3, "material": "red"}, "b": {"kind": "sphere", "radius": 0.3, "centre": [2, 0, 0]}},
        materials={"red": {"colour": [1, 0, 0], "reflection": 0.5}},
    )
    assert read.program is not None
    found = read.program.attributes([[0, 0, 0], [2, 0, 0]])
    assert found["colour"] == pytest.approx(np.array([[1, 0, 0], Material().colour]))
    assert found["finish"][:, 4] == pytest.approx([0.5, 0])


def test_bumps_count_as_level_where_a_primitive_has_none() -> None:
    read = scene(
        {"a": {"kind": "sphere", "radius": 0.3, "material": "m"}, "b": {"kind": "sphere", "radius": 0.3, "centre": [2, 0, 0]}},
        materials={"m": {"bump": {"waves": 0.01, "length": 0.1}}},
    )
    assert read.program is not None
    assert read.program.attributes([[0.1, 0.02, 0], [2, 0, 0]])["bump"][1, 0] == 0


FAULTS: list[tuple[dict[str, Any], str]] = [
    ({"camera": None}, "camera: "),
    ({"shapes": {"a": {"kind": "spher"}}}, "shapes.a.kind: is 'spher', .*; did you mean sphere"),
    ({"shapes": {"a": {"kind": "sphere"}}}, r"shapes\.a\.radius: is missing"),
    ({"shapes": {"a": {"kind": "sphere", "radius": -1}}}, r"shapes\.a\.radius: is -1, expected more than 0"),
    ({"shapes": {"a": {"kind": "sphere", "radius": 1, "colour": 2}}}, r"shapes\.a\.colour: unknown key; expected one of scale, "),
    ({"shapes": {"a": {"kind": "sum", "of": [{"kind": "sphere", "radius": "x"}]}}}, r"shapes\.a\.of\[0\]\.radius: is 'x'"),
    ({"shapes": {"a": {"kind": "sum", "of": ["b"]}}}, r"shapes\.a\.of\[0\]: names the shape 'b', expected one of a"),
    ({"shapes": {"a": {"kind": "sum", "of": ["a"]}}, "show": ["a"]}, "made of itself"),
    ({"shapes": {"a": {"kind": "sphere", "radius": 1, "material": "m"}}}, r"shapes\.a\.material: is 'm', expected one of none"),
    ({"shapes": {"a": {"kind": "sphere", "radius": 1, "weight": 0.2}}}, r"shapes\.a: Sphere: threshold is 0.5"),
    ({"shapes": {"a": {"kind": "sphere", "radius": 1, "blend": "foo"}}}, r"shapes\.a\.blend: .*expected one of hermite"),
    ({"shapes": {"a": {"kind": "pointblob", "volume": {"box": [1, 1, 1], "sphere": 2}}}}, "box and sphere, expected one of"),
    ({"shapes": {"a": {"kind": "pointblob", "volume": {"box": [1, 1, 1]}, "centre": [5, 0, 0]}}}, "not star-shaped"),
    (
        {"materials": {"m": {"texture": {"chess": 1}}}},
        r"materials\.m\.texture: expected a table with one of the keys checker, image",
    ),
    ({"materials": {"m": {"texture": {"image": "no.png"}}}}, r"materials\.m\.texture\.image: no.png is not a file"),
    ({"meshes": [{"solid": {"file": "no.obj"}}]}, r"meshes\[0\]\.solid: no.obj: cannot be read"),
    ({"meshes": [{"ground": 0, "solid": {"box": [1, 1, 1]}}]}, r"meshes\[0\]: expected either solid or ground"),
    ({"lights": [{}]}, r"lights\[0\]: expected either position or towards"),
    ({"camera": {"position": [0, 0, 0]}}, "camera: target lies at position"),
    ({"size": [0, 10]}, r"size\[0\]: is 0"),
    ({"threshold": 1.5}, "threshold: is 1.5"),
    ({}, "shapes: is empty and there are no meshes"),
]


@pytest.mark.parametrize(("part", "said"), FAULTS, ids=[said for _, said in FAULTS])
def test_a_fault_is_one_line_with_file_key_and_expectation(part: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError, match=said) as error:
        parse({**VIEW, **part}, "s.toml")
    assert str(error.value).startswith("s.toml: ")
    assert "\n" not in str(error.value)


def test_files_that_are_not_toml_or_not_there_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"cannot be read: No such file"):
        load(tmp_path / "no.toml")
    (tmp_path / "bad.toml").write_text("a = [")
    with pytest.raises(SceneError, match=r"bad.toml:?\d*: not valid TOML"):
        load(tmp_path / "bad.toml")


def test_a_million_shapes_are_refused_with_the_limit() -> None:
    ball = {"kind": "sphere", "radius": 1.0}
    with pytest.raises(SceneError, match=f"1,000,000 shapes, expected at most {MOST_SHAPES:,}"):
        scene({"a": {"kind": "sum", "of": [ball] * 999_999}})


def test_polygons_are_read_from_obj_and_both_kinds_of_ply(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("# square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/2 3//3 -1\n")
    vertices, faces = read_polygons(tmp_path / "a.obj")
    assert faces == ((0, 1, 2, 3),)
    head = "ply\nformat {} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    rows = "".join(f"{x:g} {y:g} {z:g} 7\n" for x, y, z in vertices)
    (tmp_path / "a.ply").write_text(head.format("ascii") + rows + "4 0 1 2 3\n")
    record = np.dtype([("p", "<f4", 3), ("c", "u1")])
    body = np.array([(tuple(v), 7) for v in vertices], record).tobytes()
    body += np.array([(4, (0, 1, 2, 3))], np.dtype([("n", "u1"), ("v", "<i4", 4)])).tobytes()
    (tmp_path / "b.ply").write_bytes(head.format("binary_little_endian").encode() + body)
    for name in ("a.ply", "b.ply"):
        again, same = read_polygons(tmp_path / name)
        assert same == faces
        assert again == pytest.approx(vertices)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.stl", "", "expected .obj or .ply"),
        ("a.obj", "v 0 0\n", "not a valid OBJ"),
        ("a.obj", "v 0 0 0\n", "0 faces"),
        ("a.obj", "v 0 0 0\nf 1 2 3\n", "has the face"),
        ("a.ply", "plx\n", "not a valid PLY"),
    ],
)
def test_broken_polygon_files_are_refused(tmp_path: Path, name: str, text: str, said: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(SceneError, match=said) as error:
        read_polygons(tmp_path / name)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("height", [None, 2.0])
def test_projecting_undoes_casting(height: float | None) -> None:
    camera = Camera((3, 2, 4), (0.2, 0, 0), field_of_view=0.6, height=height)
    pixels = np.random.default_rng(0).uniform(0, 300, (50, 2))
    origins, directions = camera.rays((300, 200), pixels)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(np.ones(50))
    again, depth = camera.project(origins + 2.5 * directions, (300, 200))
    assert again == pytest.approx(pixels)
    assert depth == pytest.approx(2.5 * directions @ camera.frame[2])


def test_the_picture_is_not_mirrored() -> None:
    camera = Camera((0, 0, 5))
    (x, y), (u, v) = camera.project([[1, 0, 0], [0, 1, 0]], (100, 100))[0]
    assert (x > 50, y == 50, u == 50, v < 50) == (True, True, True, True)


def test_lights_and_meshes_check_what_they_are_given() -> None:
    with pytest.raises(SceneError, match="either position or towards"):
        Light((0, 0, 0), (0, 1, 0))
    with pytest.raises(SceneError, match="name vertices 0 to 3 of 3"):
        Mesh(np.zeros((3, 3)), np.array([[0, 1, 3]]))


def test_a_checker_s_cubes_take_turns() -> None:
    colours = Checker((1, 1, 1), (0, 0, 0), 1.0)(np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [1.5, 1.5, 0.5], [-0.5, 0.5, 0.5]]))
    assert colours[:, 0].tolist() == [1, 0, 1, 0]


def test_pictures_are_written_or_refused_beforehand(tmp_path: Path) -> None:
    light = np.linspace(0, 1.2, 300, dtype=np.float32).reshape(10, 10, 3)
    write_png(tmp_path / "a.png", light)
    assert (tmp_path / "a.png").stat().st_size > 0
    assert encoded(light)[-1, -1].tolist() == [255, 255, 255]
    assert encoded(np.array([0.2140])).tolist() == [127]
    refused = {tmp_path / "a.jpg": "expected .png", tmp_path / "no/a.png": "does not exist", tmp_path: "cannot write"}
    for path, said in refused.items():
        with pytest.raises(SceneError, match=said):
            check_writable(path)
