"""A mesh of an implicit surface, for any program that reads OBJ, PLY or STL.

python examples/08_mesh_a_field.py dumbbell.obj
"""

import sys
from pathlib import Path

import vistel.implicit as vi
from vistel.implicit.polygonise import polygonise, save


def main(path: str) -> None:
    """Two balls and a bar that blend, with a hole through the bar."""
    balls = vi.Sphere((-0.5, 0, 0), 0.4) + vi.Sphere((0.5, 0, 0), 0.4)
    bar = vi.Sphylinder((-0.5, 0, 0), (0.5, 0, 0), 0.3)
    hole = vi.Sphylinder((0, 0, -1), (0, 0, 1), 0.12)
    mesh = polygonise((balls + bar) - hole, resolution=96)
    save(mesh, Path(path))
    print(f"{path}: {len(mesh.triangles)} triangles, {mesh.volume:.3f} m3, watertight: {mesh.watertight}")


if __name__ == "__main__":
    main(sys.argv[1])
