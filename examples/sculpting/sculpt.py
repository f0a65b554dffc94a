"""A sculpting loop: blend, polygonise, take the mesh as one primitive, go on: python examples/sculpting/sculpt.py [out.obj]

Every round the head so far is a single pointblob whose surface is the mesh of the round before, so
the number of primitives stays small however long one goes on.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import vistel.implicit as vi
from vistel.implicit.polygonise import SurfaceMesh, pointblob_of, polygonise, save

TOLERANCE = 0.006


def ball(x: float, y: float, z: float, radius: float) -> vi.Shape:
    """A ball of clay, sizes of its surface [m]."""
    return vi.Sphere.of_surface((x, y, z), radius)


def rounds() -> Iterator[SurfaceMesh]:
    """The mesh after every round: an egg, ears and a nose put on, eye sockets pressed in, eyes put into them."""
    head: vi.Shape = ball(0, 0, 0, 0.42) + ball(0, 0.3, 0.0, 0.34)
    mesh = polygonise(head, tolerance=TOLERANCE)
    yield mesh

    # A pointblob needs a point that sees all of its surface: what is put on must not stand out too far.
    head = pointblob_of(mesh)
    for side in (-1, 1):
        head = head + ball(side * 0.47, 0.15, 0, 0.13)
    mesh = polygonise(head + ball(0, 0.08, 0.48, 0.11), tolerance=TOLERANCE)
    yield mesh

    head = pointblob_of(mesh)
    for side in (-1, 1):
        head = vi.difference(head, ball(side * 0.2, 0.34, 0.47, 0.12), power=6)
    mesh = polygonise(head, tolerance=TOLERANCE)
    yield mesh

    head = pointblob_of(mesh)
    eyes = [ball(side * 0.2, 0.34, 0.4, 0.085) for side in (-1, 1)]
    yield polygonise(vi.union(head, *eyes), tolerance=TOLERANCE)


def main() -> None:
    for number, mesh in enumerate(rounds(), 1):
        print(f"round {number}: {len(mesh.triangles)} triangles, {1e3 * mesh.volume:.0f} litres, closed: {mesh.watertight}")
        if len(sys.argv) > 1:
            save(mesh, Path(sys.argv[1]))


if __name__ == "__main__":
    main()
