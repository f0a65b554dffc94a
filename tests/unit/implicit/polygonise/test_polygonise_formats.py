"""Meshes on file and back: positions, faces, normals, colours; what cannot be written is said before the work."""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

import vistel.implicit as vi
from vistel.implicit.polygonise import FORMATS, SurfaceMesh, polygonise, save
from vistel.implicit.scene import read_polygons
from vistel_cli.main import app

ROOT = Path(__file__).resolve().parents[4]
SCENE = ROOT / "examples" / "scenes" / "blobs.toml"
Make = Callable[[], SurfaceMesh]


def blob() -> SurfaceMesh:
    left = vi.Sphere((0, 0, 0), 1.0).with_attributes(colour=(1, 0, 0), uv=(0.25, 0.75))
    right = vi.Sphere((1.2, 0, 0), 1.0).with_attributes(colour=(0, 0, 1), uv=(0.5, 0.5))
    return polygonise(left + right, resolution=24)


def block() -> SurfaceMesh:
    shape = vi.Pointblob.of_surface(vi.box((0.6, 0.4, 0.3)), (0, 0, 0)) + vi.Sphere((0.9, 0.2, 0), 0.5)
    return polygonise(shape.with_attributes(colour=(0.2, 0.4, 0.6)), resolution=24, keep_polygons=True)


@pytest.mark.parametrize("make", [blob, block])
@pytest.mark.parametrize("ending", [".obj", ".ply", ".glb"])
def test_others_read_a_closed_surface_of_the_same_size(make: Make, ending: str, tmp_path: Path) -> None:
    mesh = make()
    path = tmp_path / f"mesh{ending}"
    save(mesh, path)
    read = trimesh.load(path, force="mesh", process=False)
    # Vertices that were repeated for their normals are the same points again.
    read.merge_vertices(merge_norm=True, merge_tex=True)
    assert read.is_watertight
    assert read.volume == pytest.approx(mesh.volume, rel=1e-4)
    assert read.area == pytest.approx(mesh.area, rel=1e-4)


@pytest.mark.parametrize("make", [blob, block])
@pytest.mark.parametrize("ending", [".obj", ".ply"])
def test_our_reader_gets_back_what_was_written(make: Make, ending: str, tmp_path: Path) -> None:
    mesh = make()
    path = tmp_path / f"mesh{ending}"
    save(mesh, path)
    vertices, faces = read_polygons(path)
    if ending == ".obj":
        np.testing.assert_allclose(vertices, mesh.vertices, rtol=1e-8, atol=1e-9)
        assert faces == mesh.polygons
        assert vi.Polyhedron(vertices, faces).volume == pytest.approx(mesh.volume)
    else:
        corners = vertices[np.array(faces)]
        np.testing.assert_allclose(corners, mesh.vertices[mesh.triangles], atol=1e-6)


def test_colours_and_texture_coordinates_are_in_the_files(tmp_path: Path) -> None:
    mesh = blob()
    for ending in FORMATS:
        save(mesh, tmp_path / f"mesh{ending}")
    ply = trimesh.load(tmp_path / "mesh.ply", process=False).metadata["_ply_raw"]["vertex"]["data"]
    for k, name in enumerate(("red", "green", "blue")):
        np.testing.assert_allclose(ply[name].ravel() / 255, mesh.attributes["colour"][:, k], atol=0.003)
    lines = (tmp_path / "mesh.obj").read_text().splitlines()
    colours = np.array([line.split()[4:] for line in lines if line.startswith("v ")], float)
    np.testing.assert_allclose(colours, mesh.attributes["colour"], atol=1e-6)
    uv = np.array([line.split()[1:] for line in lines if line.startswith("vt ")], float)
    np.testing.assert_allclose(uv, mesh.attributes["uv"], atol=1e-5)
    data = (tmp_path / "mesh.glb").read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    scene = json.loads(data[20 : 20 + length])
    assert set(scene["meshes"][0]["primitives"][0]["attributes"]) == {"POSITION", "NORMAL", "COLOR_0", "TEXCOORD_0"}
    assert struct.unpack_from("<I", data, 8)[0] == len(data)


@pytest.mark.parametrize("make", [blob, block])
def test_usd_names_every_face_and_corner(make: Make, tmp_path: Path) -> None:
    mesh = make()
    save(mesh, tmp_path / "mesh.usda")
    text = (tmp_path / "mesh.usda").read_text()

    def row(name: str) -> list[float]:
        found = re.search(rf"{re.escape(name)} = \[(.*?)\]", text)
        assert found is not None
        return [float(v) for v in re.findall(r"-?\d[\d.e+-]*", found[1])]

    counts = row("int[] faceVertexCounts")
    assert sum(counts) == len(row("int[] faceVertexIndices"))
    assert len(counts) == len(mesh.polygons)
    np.testing.assert_allclose(np.reshape(row("point3f[] points"), (-1, 3)), mesh.vertices, rtol=1e-5, atol=1e-6)
    wanted = sum(counts) if mesh.normal_of is not None else len(mesh.vertices)
    assert len(row("normal3f[] normals")) == 3 * wanted


def test_a_half_written_file_does_not_take_the_place_of_a_good_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "mesh.obj"
    path.write_text("good")

    def fail(mesh: SurfaceMesh) -> bytes:
        raise MemoryError

    monkeypatch.setitem(FORMATS, ".obj", fail)
    with pytest.raises(MemoryError):
        save(blob(), path)
    assert path.read_text() == "good"
    assert list(tmp_path.iterdir()) == [path]


def run(*words: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, ["polygonise", *words])
    return result.exit_code, result.stdout, result.stderr


def test_the_command_writes_a_mesh_and_reports_it(tmp_path: Path) -> None:
    out = tmp_path / "blobs.glb"
    code, text, _ = run(str(SCENE), "-o", str(out), "--resolution", "48", "--json", "--stats")
    assert code == 0
    report = json.loads(text)
    assert report["watertight"] and report["manifold"]
    assert report["residual"] <= 1e-4
    assert out.stat().st_size > 10_000


@pytest.mark.parametrize("words", [("--tolerance", "0.02"), ("--keep-polygons", "--resolution", "40")])
def test_the_command_takes_a_tolerance_and_keeps_polygons(words: tuple[str, ...], tmp_path: Path) -> None:
    code, text, err = run(str(SCENE), "-o", str(tmp_path / "a.ply"), "--json", "--stats", *words)
    assert code == 0, err
    assert json.loads(text)["watertight"]


@pytest.mark.parametrize(
    ("text", "words", "expected"),
    [
        ('[shapes.a]\nkind = "sphere"\nradius = 0.5\n', ("-o", "no/such/place.obj"), "there is no folder"),
        ('[shapes.a]\nkind = "sphere"\nradius = 0.5\n', ("-o", "a.stl"), "expected .obj"),
        ('[shapes.a]\nkind = "sphere"\nradius = 0.5\n', ("-o", "a.obj", "--resolution", "9", "--tolerance", "1"), "one of them"),
        ('[shapes.a]\nkind = "sphere"\nradius = 0.5\n', ("-o", "a.obj", "--tolerance", "1e-9"), "GiB"),
        ('[shapes.a]\nkind = "sphere"\nradius = 0.5\n[shapes.b]\nkind = "complement"\nof = ["a"]\n', ("-o", "a.obj"), "no bounds"),
    ],
)
def test_what_cannot_be_done_is_reported_in_one_line(
    text: str, words: tuple[str, ...], expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    camera = "[camera]\nposition = [0, 0, 5]\n\n"
    (tmp_path / "scene.toml").write_text(camera + text)
    code, _, err = run("scene.toml", *words)
    assert code in (1, 2)
    assert expected in err
    assert len(err.strip().splitlines()) == 1


def test_the_sculpting_example_goes_back_and_forth(tmp_path: Path) -> None:
    out = tmp_path / "head.obj"
    example = ROOT / "examples" / "sculpting" / "sculpt.py"
    done = subprocess.run([sys.executable, str(example), str(out)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rounds = [line for line in done.stdout.splitlines() if line.startswith("round")]
    assert len(rounds) == 4
    assert all("closed: True" in line for line in rounds)
    vertices, faces = read_polygons(out)
    assert vi.Polyhedron(vertices, faces).volume == pytest.approx(0.53, abs=0.05)
