"""What an avatar is made of and how well its primitives hold its mesh."""

from typing import Any

import numpy as np

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.figure import Figure
from vistel.figure.making.parts import soundness
from vistel.figure.making.primitives import distances, vertex_areas
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.implicit.meshes.embedding_report import fit_report


def inspect_avatar(avatar: Avatar) -> tuple[dict[str, Any], list[str]]:
    """Facts by name, and the lines of the fit report."""
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
    return facts, fit_report(figure.embedding, avatar.body.names).lines()
