"""The parts of an avatar and how well its primitives fit its mesh."""

from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree  # pyright: ignore[reportMissingTypeStubs]

from vistel.arrays import F64, I32
from vistel.figure.avatar.avatar import Avatar, clothes, flesh
from vistel.figure.avatar.detail import borders
from vistel.figure.figure import Figure
from vistel.figure.making.parts import soundness
from vistel.figure.making.primitives import distances, vertex_areas
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.implicit.meshes.embedding_report import FitReport, fit_report

_LARGE = 0.06
"""Least share of a body's triangles that a piece which is judged has: a hand beside its sleeve has more, a tongue less."""
_UNDER = 0.06
"""So far from hair or clothes skin may end [m]."""


def inspect_avatar(avatar: Avatar) -> tuple[dict[str, Any], FitReport]:
    """Facts by name, and how well each primitive fits. Mesh and fit are those of the body: hair has holes, and clothes hang."""
    mesh = avatar.mesh
    points = mesh.vertices.astype(np.float64)
    hair, worn = ~flesh(avatar), clothes(avatar) >= 0
    worn &= not worn.all()
    body = ~(hair | worn)
    distance = np.abs(distances(avatar.body, avatar.skeleton, points, mesh.limb))
    area = vertex_areas(points, mesh.triangles)
    figure = Figure(avatar)
    rigid, normals = np.empty_like(mesh.vertices), np.empty_like(mesh.vertices)
    figure.skin.pose(pose_joints(avatar.skeleton, Posture()), rigid, normals)
    moved = np.linalg.norm(figure.pose(Posture()).vertices - rigid, axis=1)
    own = _large_pieces(mesh.triangles[body[mesh.triangles].all(axis=1)], len(points))
    sound = soundness(own, len(points))
    facts: dict[str, Any] = {
        "name": avatar.name,
        "height_m": round(avatar.skeleton.height, 3),
        "vertices": len(points),
        "triangles": len(mesh.triangles),
        "eyeballs": len(avatar.eyeballs),
        "levels": [len(level.mesh.triangles) for level in (avatar, *avatar.coarser)],
        "texture": f"{avatar.albedo.shape[1]} x {avatar.albedo.shape[0]}",
        "weights": "of the mesh" if mesh.bone is not None else "joint chain",
        "hair_vertices": int(hair.sum()),
        "clothes_vertices": int(worn.sum()),
        "open_edges": _open_edges(points, own, points[~body]),
        "not_manifold_edges": sound.branching,
        "pieces": sound.pieces,
        "primitives": len(avatar.body),
        "mean_distance_mm": round(1e3 * float(np.average(distance[body], weights=area[body])), 2),
        "rest_moved_mm": round(1e3 * float(moved.max()), 2),
    }
    report = fit_report(figure.embedding, avatar.body.names, body)
    facts["primitives_that_fit_badly"] = [f.name for f in report.fits if not f.good]
    return facts, report


def _large_pieces(triangles: I32, count: int) -> I32:
    """Those of the triangles (F, 3) over `count` vertices whose piece is a large part of all: teeth and tongues may be open."""
    a, b = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]]).T
    piece = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(count, count)), directed=False)[1][triangles[:, 0]]
    return triangles[np.bincount(piece)[piece] >= _LARGE * len(triangles)]


def _open_edges(points: F64, triangles: I32, over: F64) -> int:
    """Edges of triangles (F, 3) with nothing on their other side, but for those under hair and clothes (N, 3), where skin is left
    out."""
    here = borders(triangles.astype(np.int64)).astype(np.bool_)
    middle = 0.5 * (points[triangles] + points[np.roll(triangles, -1, axis=1)])[here]
    if not len(over) or not len(middle):
        return len(middle)
    tree: Any = KDTree(over)
    return int(np.count_nonzero(np.asarray(tree.query(middle)[0]) > _UNDER))


def verdict(facts: dict[str, Any]) -> list[str]:
    """Three lines for a person: who it is, whether the mesh is whole, whether the primitives fit."""
    beside = [f"{facts[f'{word}_vertices']} of {word}" for word in ("hair", "clothes") if facts.get(f"{word}_vertices")]
    of_others = f" ({', '.join(beside)})" if beside else ""
    size = f"{facts['vertices']} vertices{of_others}, {facts['primitives']} primitives, texture {facts['texture']}"
    faults = [f"{facts['open_edges']} edges at holes that nothing covers"] if facts["open_edges"] else []
    faults += [f"{facts['not_manifold_edges']} edges of more than two triangles"] if facts["not_manifold_edges"] else []
    pieces = "one large piece" if facts["pieces"] == 1 else f"{facts['pieces']} large pieces"
    mesh = f"usable, {pieces}, but {' and '.join(faults)}" if faults else f"good: {pieces}, no holes"
    bad = facts["primitives_that_fit_badly"]
    fit = f"good: skin and primitives are {facts['mean_distance_mm']:g} mm apart on average"
    if bad:
        named = f"{', '.join(bad[:3])}{' and others' if len(bad) > 3 else ''}"
        fit = f"poor at {len(bad)} of {facts['primitives']} primitives ({named}); `vistel avatar fit` adds some"
    return [f"{facts['name']}: {facts['height_m']:g} m tall, {size}", f"  mesh  {mesh}", f"  fit   {fit}"]
