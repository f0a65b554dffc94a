"""PLY as scanners write it: text and binary, texture coordinates or colours at vertices, and clear words for the rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from vistel.figure.making.files.read_ply import read_ply
from vistel.figure.making.source import MakingError

N = 24
ANGLE = 2 * np.pi * np.arange(N) / N
POINTS = np.concatenate([np.stack([np.cos(ANGLE), np.sin(ANGLE), np.full(N, z)], axis=1) for z in (0.0, 2.0, 4.0)])
QUADS = [[r * N + j, r * N + (j + 1) % N, (r + 1) * N + (j + 1) % N, (r + 1) * N + j] for r in range(2) for j in range(N)]
COLOUR = np.clip(np.stack([128 + 120 * np.cos(np.tile(ANGLE, 3)), np.repeat((0, 100, 200), N), np.full(3 * N, 60)], axis=1), 0, 255)


def header(form: str, extra: str) -> str:
    return (
        f"ply\nformat {form} 1.0\ncomment TextureFile skin.png\nelement vertex {len(POINTS)}\nproperty float x\n"
        f"property float y\nproperty float z\n{extra}element face {len(QUADS)}\nproperty list uchar int vertex_indices\n"
        "end_header\n"
    )


RGB = "property uchar red\nproperty uchar green\nproperty uchar blue\n"


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_every_kind_holds_the_same_mesh(tmp_path: Path, form: str) -> None:
    path = tmp_path / "arm.ply"
    if form == "ascii":
        rows = [f"{x:g} {y:g} {z:g} {r} {g} {b}" for (x, y, z), (r, g, b) in zip(POINTS, COLOUR.astype(int), strict=True)]
        path.write_text(header(form, RGB) + "\n".join(rows + [f"4 {a} {b} {c} {d}" for a, b, c, d in QUADS]) + "\n")
    else:
        order = "<" if "little" in form else ">"
        vertex = np.dtype([(n, f"{order}f4") for n in "xyz"] + [(n, "u1") for n in ("r", "g", "b")])
        rows = np.array([(*p, *c) for p, c in zip(POINTS, COLOUR.astype(int), strict=True)], vertex)
        face = np.array([(4, q) for q in QUADS], np.dtype([("n", "u1"), ("v", f"{order}i4", 4)]))
        path.write_bytes(header(form, RGB).encode() + rows.tobytes() + face.tobytes())
    source = read_ply(path)
    assert np.allclose(source.points, POINTS, atol=1e-5)
    assert len(source.triangles) == 2 * len(QUADS) and source.triangles.max() == len(POINTS) - 1
    picture = source.materials[0].picture
    assert picture is not None
    uv = source.uv[source.uv_triangles]
    row, column = ((1.0 - uv[..., 1]) * 1023).round().astype(int), (uv[..., 0] * 1023).round().astype(int)
    assert np.abs(picture[row, column].astype(float) - COLOUR[source.triangles]).mean() < 4.0


def test_texture_coordinates_at_vertices_go_with_the_named_picture(tmp_path: Path) -> None:
    Image.new("RGB", (8, 8), (10, 20, 30)).save(tmp_path / "skin.png")
    path = tmp_path / "arm.ply"
    rows = [f"{x:g} {y:g} {z:g} 0.5 0.25" for x, y, z in POINTS]
    text = header("ascii", "property float s\nproperty float t\n")
    path.write_text(text + "\n".join(rows + [f"4 {a} {b} {c} {d}" for a, b, c, d in QUADS]) + "\n")
    source = read_ply(path)
    assert np.allclose(source.uv[source.uv_triangles], (0.5, 0.25))
    assert source.materials[0].picture is not None and source.materials[0].picture.shape == (8, 8, 3)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("solid\n", "it does not begin with ply"),
        ("ply\nformat ascii 1.0\n", "not a whole PLY file"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "no faces"),
        (header("ascii", ""), "not a whole PLY file"),
        (header("binary_little_endian", "") + "xxx", "not a whole PLY file"),
    ],
)
def test_what_is_no_mesh_is_refused_in_one_line(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "arm.ply"
    path.write_text(text)
    with pytest.raises(MakingError) as told:
        read_ply(path)
    assert reason in str(told.value) and "\n" not in str(told.value)
