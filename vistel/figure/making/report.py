"""The parts of an avatar and how well its primitives fit its mesh."""

from typing import Any

import numpy as np

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.figure import Figure
from vistel.figure.making.parts import soundness
from vistel.figure.making.primitives import distances, vertex_areas
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.implicit.meshes.embedding_report import FitReport, fit_report


def inspect_avatar(avatar: Avatar) -> tuple[dict[str, Any], FitReport]:
    """Facts by name, and how well each primitive fits."""
    mesh = avatar.mesh
    points = mesh.vertices.astype(np.float64)
    distance = np.abs(distances(avatar.body, avatar.skeleton, points, mesh.limb))
    area = vertex_areas(points, mesh.triangles)
    figure = Figure(avatar)
    rigid, normals = np.empty_like(mesh.vertices), np.empty_like(mesh.vertices)
    figure.skin.pose(pose_joints(avatar.skeleton, Posture()), rigid, normals)
    moved = np.linalg.norm(figure.pose(Posture()).vertices - rigid, axis=1)
    sound = soundness(mesh.triangles, len(points))
    facts: dict[str, Any] = {
        "name": avatar.name,
        "height_m": round(avatar.skeleton.height, 3),
        "vertices": len(points),
        "triangles": len(mesh.triangles),
        "eyeballs": len(avatar.eyeballs),
        "levels": [len(level.mesh.triangles) for level in (avatar, *avatar.coarser)],
        "texture": f"{avatar.albedo.shape[1]} x {avatar.albedo.shape[0]}",
        "weights": "of the mesh" if mesh.bone is not None else "joint chain",
        "open_edges": sound.border,
        "not_manifold_edges": sound.branching,
        "pieces": sound.pieces,
        "primitives": len(avatar.body),
        "mean_distance_mm": round(1e3 * float(np.average(distance, weights=area)), 2),
        "rest_moved_mm": round(1e3 * float(moved.max()), 2),
    }
    report = fit_report(figure.embedding, avatar.body.names)
    facts["primitives_that_fit_badly"] = [f.name for f in report.fits if not f.good]
    return facts, report


def verdict(facts: dict[str, Any]) -> list[str]:
    """Three lines for a person: who it is, whether the mesh is whole, whether the primitives fit."""
    size = f"{facts['vertices']} vertices, {facts['primitives']} primitives, texture {facts['texture']}"
    faults = [f"{facts['open_edges']} edges at holes"] if facts["open_edges"] else []
    faults += [f"{facts['not_manifold_edges']} edges of more than two triangles"] if facts["not_manifold_edges"] else []
    pieces = "one piece" if facts["pieces"] == 1 else f"{facts['pieces']} pieces"
    mesh = f"usable, {pieces}, but {' and '.join(faults)}" if faults else f"good: {pieces}, no holes"
    bad = facts["primitives_that_fit_badly"]
    fit = f"good: skin and primitives are {facts['mean_distance_mm']:g} mm apart on average"
    if bad:
        named = f"{', '.join(bad[:3])}{' and others' if len(bad) > 3 else ''}"
        fit = f"poor at {len(bad)} of {facts['primitives']} primitives ({named}); `vistel avatar fit` adds some"
    return [f"{facts['name']}: {facts['height_m']:g} m tall, {size}", f"  mesh  {mesh}", f"  fit   {fit}"]
