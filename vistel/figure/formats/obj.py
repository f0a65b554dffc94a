"""An avatar's shape and texture for other programs: OBJ, MTL and PNG. It cannot be read back as an avatar."""

from pathlib import Path

import numpy as np
from PIL import Image

from vistel.arrays import I32, Bool
from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.patch import patch_of


def export_obj(avatar: Avatar, path: Path) -> None:
    """Writes PATH (.obj), and beside it the material (.mtl) and the texture (.png); no lenses of glasses, which would be solid.
    Raises OSError."""
    material, texture = path.with_suffix(".mtl"), path.with_suffix(".png")
    Image.fromarray(avatar.albedo).save(texture)
    material.write_text(f"newmtl avatar\nKd 1 1 1\nmap_Kd {texture.name}\n", encoding="utf-8")
    lines = [f"mtllib {material.name}", "usemtl avatar"]
    first_vertex = first_corner = 1
    for label, mesh in zip(("skin", "left_eye", "right_eye"), (avatar.mesh, *avatar.eyeballs), strict=False):
        lines.append(f"o {label}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertices]
        lines += [f"vt {u:.6f} {v:.6f}" for u, v in mesh.uv]
        solid = ~_film(avatar, mesh)
        lines += _faces(mesh.triangles[solid] + first_vertex, mesh.corner_triangles[solid] + first_corner)
        first_vertex, first_corner = first_vertex + len(mesh.vertices), first_corner + len(mesh.uv)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _film(avatar: Avatar, mesh: Mesh) -> Bool:
    """(F,) triangles that are nowhere solid."""
    films = np.array([*(patch.film for patch in avatar.patches), False])
    return films[patch_of(avatar.patches, mesh.uv, mesh.corner_triangles)]


def _faces(vertices: I32, corners: I32) -> list[str]:
    return [
        "f " + " ".join(f"{v}/{c}" for v, c in zip(vs, cs, strict=True))
        for vs, cs in zip(vertices.tolist(), corners.tolist(), strict=True)
    ]
