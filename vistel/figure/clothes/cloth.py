"""Cloth: the mesh of a garment, or of a piece of one, at one level of detail, while it is being made."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F32, F64, I32, Bool
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.avatar.detail import borders, coarser
from vistel.figure.making.assembly.piece import closest
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINTS
from vistel.geometry.normals import vertex_normals

BONES = len(JOINTS) + len(TWIST_BONES)
"""Joints, then twist bones, as in `vistel.figure.avatar.avatar.Mesh`."""


@dataclass(frozen=True, eq=False)
class Cloth:
    """points: (V, 3) in the T-pose [m]. triangles: (F, 3), counter-clockwise seen from outside. weight: (V, BONES) shares of bones.
    limb: (V,) of the body beneath. panel: (F,) name of the panel that a triangle is cut from, by index into `panels`; flat: (F, 3,
    2) where its corners lie on that panel [m]. rim: (V,) whether it is of a border's finish, which shows its shape."""

    points: F64
    triangles: I32
    weight: F32
    limb: I32
    panel: I32
    flat: F64
    rim: Bool
    panels: tuple[str, ...]

    def without(self, gone: Bool) -> "Cloth":
        """Without those triangles (F,), and without the vertices that only they used."""
        used = np.zeros(len(self.points), np.bool_)
        used[self.triangles[~gone]] = True
        number = np.cumsum(used, dtype=np.int32) - 1
        kept = replace(self, triangles=number[self.triangles[~gone]], panel=self.panel[~gone], flat=self.flat[~gone])
        return replace(kept, points=self.points[used], weight=self.weight[used], limb=self.limb[used], rim=self.rim[used])

    def normals(self) -> F64:
        """(V, 3) unit normals, triangles weighted by their area."""
        return vertex_normals(self.points, self.triangles)

    def bones_at(self, points: F64) -> tuple[F32, I32, F64]:
        """(N, BONES) shares of bones and (N,) limbs of the places of this cloth nearest to points (N, 3), for what lies on it; and
        (N,) how far off those are [m]."""
        on, share, far = closest(points, self.points[self.triangles])
        corner = self.triangles[on]
        bones = np.einsum("nk,nkb->nb", share, self.weight[corner]).astype(np.float32)
        return bones, self.limb[corner[np.arange(len(corner)), share.argmax(axis=1)]], far


def dense(bone: I32, weight: F32) -> F32:
    """(V, BONES) shares of what (V, 4) bones and weights say."""
    out = np.zeros((len(bone), BONES), np.float32)
    for k in range(bone.shape[1]):
        out[np.arange(len(bone)), bone[:, k]] += weight[:, k]
    return out


def sewn(pieces: Sequence[Cloth]) -> Cloth:
    """Pieces of one garment as one, their vertices apart."""
    names = tuple(dict.fromkeys(name for piece in pieces for name in piece.panels))
    first = np.cumsum([0, *(len(piece.points) for piece in pieces)])
    panels = [np.array([names.index(n) for n in piece.panels], np.int32)[piece.panel] for piece in pieces]
    return Cloth(
        np.concatenate([p.points for p in pieces]),
        np.concatenate([p.triangles + f for p, f in zip(pieces, first, strict=False)]).astype(np.int32),
        np.concatenate([p.weight for p in pieces]),
        np.concatenate([p.limb for p in pieces]),
        np.concatenate(panels),
        np.concatenate([p.flat for p in pieces]),
        np.concatenate([p.rim for p in pieces]),
        names,
    )


_APART = 64.0
"""By which panels lie apart while a cloth is thinned [m]."""


def thinned(cloth: Cloth, triangles: int) -> tuple[Cloth, I32]:
    """With about so many triangles, its borders as they are; and (V,) where its vertices have gone, -1 for those that are gone."""
    at = cloth.flat + np.stack([_APART * cloth.panel, np.zeros(len(cloth.panel))], axis=-1)[:, None]
    rows = np.column_stack([cloth.triangles.ravel(), np.round(1e5 * at.reshape(-1, 2)).astype(np.int64)])
    _, first, corner = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    number = np.arange(len(cloth.points), dtype=np.int32)
    edge = borders(cloth.triangles.astype(np.int64)) > 0
    border = np.zeros(len(number), np.bool_)
    border[cloth.triangles[edge]] = border[np.roll(cloth.triangles, -1, axis=1)[edge]] = True
    mesh = Mesh(
        cloth.points.astype(np.float32),
        cloth.triangles,
        cloth.triangles.ravel()[first].astype(np.int32),
        at.reshape(-1, 2)[first].astype(np.float32),
        corner.reshape(-1, 3).astype(np.int32),
        number,
    )
    few = coarser(mesh, triangles, np.where(border, np.inf, 1.0))
    kept = few.limb
    flat = few.uv[few.corner_triangles].astype(np.float64)
    panel = np.round(flat[:, 0, 0] / _APART).astype(np.int32)
    flat[..., 0] -= _APART * panel[:, None]
    gone = np.full(len(number), -1, np.int32)
    gone[kept] = np.arange(len(kept), dtype=np.int32)
    out = Cloth(cloth.points[kept], few.triangles, cloth.weight[kept], cloth.limb[kept], panel, flat, cloth.rim[kept], cloth.panels)
    return out, gone


def mesh_of(cloth: Cloth, where: dict[str, F64]) -> Mesh:
    """As an avatar has it. where: (2, 2) of each panel, texture coordinates = first row + second row * place on the panel."""
    place = np.array([where[name] for name in cloth.panels]).reshape(-1, 2, 2)[cloth.panel]
    uv = np.clip(place[:, None, 0] + place[:, None, 1] * cloth.flat, 0.0, 1.0).reshape(-1, 2).astype(np.float32)
    rows = np.column_stack([cloth.triangles.ravel(), np.round(uv * 65535.0).astype(np.int64)])
    _, first, corner = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    bone = np.argsort(-cloth.weight, axis=1, kind="stable")[:, :4].astype(np.int32)
    share = np.take_along_axis(cloth.weight, bone, axis=1)
    return Mesh(
        cloth.points.astype(np.float32),
        cloth.triangles,
        cloth.triangles.ravel()[first].astype(np.int32),
        uv[first],
        corner.reshape(-1, 3).astype(np.int32),
        cloth.limb.astype(np.int32),
        bone,
        (share / share.sum(axis=1, keepdims=True)).astype(np.float32),
    )
