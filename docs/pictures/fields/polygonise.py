"""The pictures of docs/how-to/polygonise.md: meshes with their edges, smooth and as they are."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import vistel.implicit as vi
from docs.pictures.drawing.implicit_render import label, sheet
from docs.pictures.drawing.mesh_render import Part, Studio
from vistel.implicit.polygonise import SurfaceMesh, polygonise
from vistel.implicit.polygonise.shading import auto_smooth

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "examples" / "sculpting"))

CLAY, KEPT, MADE = (0.80, 0.58, 0.45), (0.55, 0.66, 0.78), (0.86, 0.62, 0.42)
SIZE = 512


def wires(colour: Sequence[float], width: float) -> NDArray[np.uint8]:
    """A texture for triangles with corners at (0, 0), (1, 0), (0, 1): their colour, darker along the sides."""
    u, v = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE, 1 - (np.arange(SIZE) + 0.5) / SIZE)
    # Distances from the sides of an equal-sided triangle of height 1.
    near = np.minimum(np.minimum(u, v), np.abs(1 - u - v))
    shade = np.where(near < width, 0.35, 1.0)
    return (255 * np.asarray(colour) * shade[..., None]).astype(np.uint8)


def drawn(mesh: SurfaceMesh, rows: NDArray[np.int64] | None, colour: Sequence[float], edges: float) -> Part:
    """Some triangles of a mesh, smooth, with edges of a width where that is not 0."""
    rows = np.arange(len(mesh.triangles)) if rows is None else rows
    triangles = mesh.triangles[rows]
    normal_of = triangles if mesh.normal_of is None else mesh.normal_of[rows]
    corner = np.tile(np.array([(0, 0), (1, 0), (0, 1)], np.float32), (len(rows), 1))
    texture = wires(colour, edges) if edges else np.full((1, 1, 3), 255 * np.asarray(colour), np.uint8)
    return Part(
        mesh.vertices[triangles.ravel()], mesh.normals[normal_of.ravel()], corner, np.arange(3 * len(rows)).reshape(-1, 3), texture
    )


def view(studio: Studio, parts: list[Part], centre: Sequence[float], size: float, turn: float = 0.5) -> Image.Image:
    eye = np.asarray(centre) + 6 * size * np.array([np.sin(turn), 0.45, np.cos(turn)])
    return studio.photograph(parts, eye, centre, (420, 380), 0.24)


def main() -> None:
    from sculpt import rounds

    from benchmarks.fields.bench_polygonise import table_3  # found on the path set above

    studio = Studio()
    blend = vi.Sphere.of_surface((-0.35, 0, 0), 0.4) + vi.Sphere.of_surface((0.3, 0.1, 0), 0.3)
    knot = blend + vi.Sphylinder.of_surface((0.5, 0.2, 0), (0.9, 0.5, 0), 0.07)
    even, fine = polygonise(knot, resolution=40), polygonise(knot, tolerance=0.004)
    pictures = [
        label(view(studio, [drawn(even, None, CLAY, 0.05)], (0.1, 0.05, 0), 0.98), f"even cells: {len(even.triangles)} triangles"),
        label(view(studio, [drawn(fine, None, CLAY, 0.05)], (0.1, 0.05, 0), 0.98), f"within 4 mm: {len(fine.triangles)} triangles"),
        label(view(studio, [drawn(fine, None, CLAY, 0)], (0.1, 0.05, 0), 0.98), "within 4 mm, smooth"),
    ]
    sheet(pictures, 3, "fields/polygonise-cells")

    pictures = []
    places = {"28a": ((-0.2, 0, 0), 1.3), "28b": ((0, 0.12, 0), 0.95), "28c": ((0.85, 0.25, 0), 0.9)}
    for name, (shape, resolution) in table_3().items():
        if name[:3] not in places:
            continue
        mesh = polygonise(shape, resolution=2 * resolution, keep_polygons=True)
        assert mesh.polygon is not None
        own = mesh.polygon < mesh.retained
        centre, size = places[name[:3]]
        parts = [drawn(mesh, np.flatnonzero(own), KEPT, 0.04), drawn(mesh, np.flatnonzero(~own), MADE, 0.04)]
        pictures.append(label(view(studio, parts, centre, size), f"{name}: {mesh.retained} polygons kept"))
        parts = [drawn(mesh, None, CLAY, 0)]
        pictures.append(label(view(studio, parts, centre, size), f"{name}, shaded"))
    sheet(pictures[::2] + pictures[1::2], 3, "fields/polygonise-kept")

    pictures = []
    for number, mesh in enumerate(rounds(), 1):
        smooth = replace(mesh, **dict(zip(("normals", "normal_of"), auto_smooth(mesh.vertices, mesh.triangles, 0.9), strict=True)))
        part = drawn(smooth, None, CLAY, 0.0)
        pictures.append(label(view(studio, [part], (0, 0.15, 0), 0.95, 0.35), f"round {number}: {len(mesh.triangles)} triangles"))
    sheet(pictures, 4, "fields/polygonise-sculpting")


if __name__ == "__main__":
    main()
