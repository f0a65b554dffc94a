"""What a person has on: hair and garments, each a mesh and a picture of its own, joined with the body into one avatar."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F32, F64, U8, Bool
from vistel.figure.avatar.atlas import atlas
from vistel.figure.avatar.avatar import Avatar, Mesh, Target
from vistel.figure.avatar.detail import of_triangles
from vistel.figure.avatar.patch import Patch
from vistel.figure.figure import vertex_normals


@dataclass(frozen=True, eq=False)
class Part:
    """Hair or a garment, in the T-pose of the body that it was made for.

    levels: a mesh for each level of detail of the body, the finest first, with bones and weights; `uv` in the part's own picture.
    albedo: (H, W, 3) sRGB, first row at the top. patches: surface properties, boxes in that picture. hides: for each level (F,)
    triangles of the body that are covered everywhere and not drawn; sinks: for each level (V,)
    how far its skin gives way under the part [m]."""

    name: str
    levels: tuple[Mesh, ...]
    albedo: U8
    patches: tuple[Patch, ...] = ()
    hides: tuple[Bool, ...] = ()
    sinks: tuple[F32, ...] = ()


def joined(body: Avatar, parts: Sequence[Part]) -> Avatar:
    """The body with its parts on, every level of detail."""
    if not parts:
        return body
    albedo, box = atlas([body.albedo, *(part.albedo for part in parts)])
    patches = tuple(p.within(b) for b, has in zip(box, (body.patches, *(p.patches for p in parts)), strict=True) for p in has)
    eyes = tuple(replace(eye, uv=_placed(eye, box[0]).uv) for eye in body.eyeballs)
    levels: list[Avatar] = []
    for k, level in enumerate((body, *body.coarser)):
        hidden = np.zeros(len(level.mesh.triangles), np.bool_)
        for part in parts:
            if part.hides:
                hidden |= part.hides[k]
        worn = [_placed(part.levels[k], b) for part, b in zip(parts, box[1:], strict=True)]
        skin = _sunken(_placed(level.mesh, box[0]), [p.sinks[k] for p in parts if p.sinks])
        seen = of_triangles(skin, skin.triangles[~hidden].astype(np.int64), skin.corner_triangles[~hidden].astype(np.int64))
        mesh = together([seen, *worn])
        levels.append(replace(level, mesh=mesh, eyeballs=eyes, albedo=albedo, patches=patches, coarser=()))
    return replace(levels[0], coarser=tuple(levels[1:]))


def _placed(mesh: Mesh, box: F64) -> Mesh:
    return replace(mesh, uv=(box[:2] + mesh.uv * box[2:]).astype(np.float32))


def _sunken(mesh: Mesh, depths: Sequence[F32]) -> Mesh:
    """The mesh with its vertices moved in by all these depths (V,) [m]: under two layers it gives way to both."""
    if not depths:
        return mesh
    return replace(mesh, vertices=mesh.vertices - np.sum(depths, axis=0)[:, None] * vertex_normals(mesh))


def together(meshes: Sequence[Mesh]) -> Mesh:
    """One mesh of several with bones; their expressions are those of the first and of all that have one of the same name."""
    first = np.cumsum([0, *(len(m.vertices) for m in meshes)]).astype(np.int32)
    corner = np.cumsum([0, *(len(m.uv) for m in meshes)]).astype(np.int32)
    assert all(m.bone is not None and m.weight is not None for m in meshes), "parts have bones"
    names = dict.fromkeys(t.name for m in meshes for t in m.targets)
    targets: list[Target] = []
    for name in names:
        found = [(t, f) for m, f in zip(meshes, first, strict=False) for t in m.targets if t.name == name]
        vertex = np.concatenate([t.vertex + f for t, f in found]).astype(np.int32)
        targets.append(replace(found[0][0], vertex=vertex, offset=np.concatenate([t.offset for t, _ in found])))
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.triangles + f for m, f in zip(meshes, first, strict=False)]),
        np.concatenate([m.corner_vertex + f for m, f in zip(meshes, first, strict=False)]),
        np.concatenate([m.uv for m in meshes]),
        np.concatenate([m.corner_triangles + c for m, c in zip(meshes, corner, strict=False)]),
        np.concatenate([m.limb for m in meshes]),
        np.concatenate([m.bone for m in meshes if m.bone is not None]),
        np.concatenate([m.weight for m in meshes if m.weight is not None]),
        tuple(targets),
        _hanging(meshes),
    )


def _hanging(meshes: Sequence[Mesh]) -> F32 | None:
    if all(m.hangs is None for m in meshes):
        return None
    return np.concatenate([np.zeros(len(m.vertices), np.float32) if m.hangs is None else m.hangs for m in meshes])
