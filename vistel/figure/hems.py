"""Cloth that is folded in, as hems are: it faces the body, but what presses the cloth over it presses it, too."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from vistel.arrays import F32, I32, Bool
from vistel.figure.avatar.avatar import Avatar, clothes
from vistel.figure.body import pose_body
from vistel.figure.posture.posture import rest_pose


def with_hems_outwards(avatar: Avatar, normals: F32) -> F32:
    """The normals (V, 3) of an avatar's mesh at rest, those of hems as the cloth on which they lie has them.

    Skin moves along its normals where something touches: a hem that faces the body would stay, and come through the cloth that is
    pressed in. Hems are seen from within sleeves and legs alone, where their light is that of the cloth round them.
    """
    worn, mesh = clothes(avatar), avatar.mesh
    if not (worn < 0).any():
        return normals  # skin and clothes are one: what faces inwards may be a mouth
    folded = _folded_in(avatar, normals, worn)
    out = normals.copy()
    for garment in np.unique(worn[folded]):
        hem, cloth = (np.flatnonzero((worn == garment) & which) for which in (folded, ~folded))
        if len(cloth):
            out[hem] = normals[cloth[KDTree(mesh.vertices[cloth]).query(mesh.vertices[hem])[1]]]
    return out


def _folded_in(avatar: Avatar, normals: F32, worn: I32) -> Bool:
    """(V,) vertices of pieces of cloth that face the body more than they face away from it."""
    mesh, count = avatar.mesh, len(worn)
    ends = np.concatenate([mesh.triangles[:, :2], mesh.triangles[:, 1:]])
    piece = connected_components(coo_array((np.ones(len(ends)), tuple(ends.T)), shape=(count, count)), directed=False)[1]
    facing = np.bincount(piece, (normals * _outwards(avatar)).sum(axis=1))
    return np.asarray((facing[piece] < 0.0) & (worn >= 0), np.bool_)


def _outwards(avatar: Avatar) -> F32:
    """(V, 3) unit, away from the axis of the primitive that each vertex belongs to, at rest."""
    posed, mesh = pose_body(avatar.body, rest_pose(avatar.skeleton)), avatar.mesh
    a, p = posed.a[mesh.limb], mesh.vertices.astype(np.float64)
    along = posed.b[mesh.limb] - a
    share = np.clip(((p - a) * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-12), 0.0, 1.0)
    away = p - a - share[:, None] * along
    return (away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)).astype(np.float32)
