"""Skeletons placed in meshes that have none: python -m docs.pictures.ghosts.placement [MESH.obj] [PRIMITIVES]

Makes placement.png: meshes coloured by primitive, the cone-spheres alone, and the mesh
pressed by a ball that is not shown. With a mesh of
your own it prints how well the primitives fit and shows that instead.
"""

import colorsys
import sys
from pathlib import Path

import numpy as np
from PIL import Image

import vistel.implicit as vi
from docs.pictures.drawing.mesh_render import Part, Studio, normals
from docs.pictures.ghosts.embedding_fit import coloured
from vistel.figure.people.builtin import builtin_avatar
from vistel.implicit.constants import SURFACE_RATIO
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.deformation.ghost_source import ghosts_of
from vistel.implicit.meshes.embedding import embed
from vistel.implicit.meshes.embedding_report import fit_report
from vistel.implicit.meshes.placement import Placement, place_skeletons
from vistel.implicit.polygonise import polygonise
from vistel.implicit.scene.mesh_file import read_polygons

FOLDER = Path(__file__).parent
PLAIN = np.array((0.86, 0.80, 0.72))


def dog() -> tuple[np.ndarray, np.ndarray]:
    """A balloon dog without a skeleton: vertices [m], triangles."""
    body = vi.Sphylinder((-0.22, 0.30, 0), (0.20, 0.30, 0), 0.17) + vi.ConeSphere((0.20, 0.33, 0), (0.33, 0.52, 0), 0.14, 0.11)
    head = vi.ConeSphere((0.34, 0.56, 0), (0.52, 0.53, 0), 0.15, 0.08)
    for z in (-0.09, 0.09):
        for x in (-0.22, 0.20):
            body = body + vi.ConeSphere((x, 0.24, z), (x, 0.04, z), 0.085, 0.07)
        head = head + vi.ConeSphere((0.32, 0.66, 0.7 * z), (0.28, 0.76, 1.2 * z), 0.05, 0.035)
    mesh = polygonise(body + head + vi.ConeSphere((-0.33, 0.36, 0), (-0.47, 0.54, 0), 0.06, 0.04), resolution=96)
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.triangles, np.int32)


def read(path: str) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = read_polygons(Path(path))
    return vertices, np.array([(f[0], f[i], f[i + 1]) for f in faces for i in range(1, len(f) - 1)], np.int32)


def shades(count: int) -> np.ndarray:
    """(count, 3) colours that neighbours in the list do not share."""
    return np.array([colorsys.hsv_to_rgb((0.618 * i) % 1.0, 0.45, 0.92) for i in range(count)])


def primitives(placed: Placement) -> list[Part]:
    """The cone-spheres as meshes."""
    limbs, parts = placed.limbs, []
    for i, colour in enumerate(shades(limbs.groups)):
        a, b = limbs.a[i], limbs.b[i]
        influence = (float(r) / SURFACE_RATIO for r in (limbs.radius_a[i], limbs.radius_b[i]))
        mesh = polygonise(vi.ConeSphere(tuple(a), tuple(b), *influence), resolution=28)
        parts.append(coloured(np.asarray(mesh.vertices), np.asarray(mesh.triangles), np.tile(colour, (len(mesh.vertices), 1))))
    return parts


def pressed(vertices: np.ndarray, triangles: np.ndarray, placed: Placement) -> list[Part]:
    """The mesh with a ball pressed into its side; the ball is not shown."""
    size, top = np.ptp(vertices, axis=0).max(), vertices[:, 1].max()
    side = vertices[np.abs(vertices[:, 1] - 0.5 * top) < 0.06 * top]
    touch = side[np.argmax(side[:, 2])]
    radius = 0.09 * size
    centre = touch + np.array((0.0, 0.0, 0.62 * radius))
    embedding = embed(vertices.astype(np.float32), placed.limb, placed.limbs)
    deformer = Deformer(triangles, embedding)
    moved = np.ascontiguousarray(vertices, np.float32)
    ball = PrimitiveSet.of_kinds(["sphere"], [[radius]], np.eye(3)[None], centre[None])
    deformer.deform(moved, normals(vertices, triangles).astype(np.float32), placed.limbs.a, placed.limbs.b, [ghosts_of(ball)])
    print("\n".join(fit_report(embedding).lines()[:3]), f"{np.count_nonzero(deformer.moved)} vertices moved", sep="\n")
    return [coloured(moved, triangles, np.tile(PLAIN, (len(vertices), 1)))]


def row(studio: Studio, vertices: np.ndarray, triangles: np.ndarray, count: int) -> Image.Image:
    placed = place_skeletons(vertices, triangles, count)
    size = float(np.ptp(vertices, axis=0).max())
    print(f"{placed.limbs.groups} primitives, mean distance {1e3 * placed.mean_distance:.1f} mm of {size:.2f} m")
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    eye = tuple(middle + size * np.array((0.75, 0.25, 1.55)))
    groups = (
        [coloured(vertices, triangles, shades(placed.limbs.groups)[placed.limb])],
        primitives(placed),
        pressed(vertices, triangles, placed),
    )
    images = [studio.photograph(parts, eye, tuple(middle), (400, 400), 0.66) for parts in groups]
    out = Image.new("RGB", (1200, 400), "white")
    for k, image in enumerate(images):
        out.paste(image, (400 * k, 0))
    return out


def main() -> None:
    studio = Studio()
    if len(sys.argv) > 1:
        row(studio, *read(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 23).save("placement.png")
        return
    person = builtin_avatar("builtin:person=carla", name="fit", height=1.75).mesh
    meshes = ((*dog(), 22), (person.vertices.astype(np.float64), person.triangles, 23))
    rows = [row(studio, *mesh) for mesh in meshes]
    out = Image.new("RGB", (1200, 400 * len(rows)), "white")
    for k, image in enumerate(rows):
        out.paste(image, (0, 400 * k))
    out.save(FOLDER / "placement.png", optimize=True)


if __name__ == "__main__":
    main()
