"""Meshes of people as files might hold them, made from a built-in person."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from avatar_fixture import closed_person
from numpy.typing import NDArray

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.figure import Figure
from vistel.figure.posture.posture import SHOULDER, Posture


@lru_cache(maxsize=1)
def person() -> Avatar:
    """One person of 1.70 m."""
    eva = closed_person()
    # Levels from the cache carry the name of whoever was made first.
    return replace(eva, coarser=tuple(replace(level, name="eva") for level in eva.coarser))


@lru_cache(maxsize=1)
def a_pose() -> NDArray[np.float32]:
    """Her vertices with the arms 45 degrees down."""
    dofs = np.zeros(25)
    dofs[SHOULDER["left"]], dofs[SHOULDER["right"]] = (0, 0, -np.pi / 4), (0, 0, np.pi / 4)
    return Figure(person()).pose(Posture(dofs)).vertices.copy()


def write_obj(
    path: Path, vertices: NDArray[np.floating], *, faces: slice | NDArray[np.intp] = slice(None), uv: bool = False, extra: str = ""
) -> Path:
    """An OBJ of her with these vertices."""
    mesh = person().mesh
    lines = [extra] if extra else []
    lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in np.asarray(vertices).tolist()]
    if uv:
        lines += [f"vt {u:.6f} {v:.6f}" for u, v in mesh.uv.tolist()]
        pairs = zip((mesh.triangles[faces] + 1).tolist(), (mesh.corner_triangles[faces] + 1).tolist(), strict=True)
        lines += ["f " + " ".join(f"{v}/{t}" for v, t in zip(vs, ts, strict=True)) for vs, ts in pairs]
    else:
        lines += ["f {} {} {}".format(*row) for row in (mesh.triangles[faces] + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path
