"""A small person for tests: a closed tube over every primitive of the standard body, no sculpting."""

import numpy as np

from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.body import Body, pose_body, standard_body
from vistel.figure.posture.posture import rest_pose
from vistel.figure.skeleton import Skeleton, standard_skeleton


def capsule(a, b, ra, rb, *, around=12, along=9, cap=3):
    """A closed triangle mesh of a cone-sphere: vertices, triangles (outwards)."""
    axis = np.asarray(b, float) - a
    length = np.linalg.norm(axis)
    w = axis / length if length > 1e-9 else np.array([0.0, 1.0, 0.0])
    u = np.cross(w, [0.0, 0.0, 1.0] if abs(w[2]) < 0.9 else [1.0, 0.0, 0.0])
    u /= np.linalg.norm(u)
    v = np.cross(w, u)
    sine = (ra - rb) / length if length > abs(ra - rb) + 1e-9 else 0.0
    start = np.arcsin(sine)
    rings = [(a, ra, t) for t in np.linspace(-np.pi / 2, start, cap + 1)[1:-1]]
    rings += [(a + s * axis, ra + s * (rb - ra), start) for s in np.linspace(0, 1, along)]
    rings += [(b, rb, t) for t in np.linspace(start, np.pi / 2, cap + 1)[1:-1]]
    turn = np.arange(around) * 2 * np.pi / around
    circle = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
    points = [a - ra * w] + [c + r * (np.cos(t) * d + np.sin(t) * w) for c, r, t in rings for d in circle] + [b + rb * w]
    triangles = []
    for i in range(around):
        j = (i + 1) % around
        triangles.append((0, 1 + j, 1 + i))
        for k in range(len(rings) - 1):
            p, q = 1 + k * around, 1 + (k + 1) * around
            triangles += [(p + i, p + j, q + j), (p + i, q + j, q + i)]
        last = 1 + (len(rings) - 1) * around
        triangles.append((last + i, last + j, len(points) - 1))
    return np.array(points), np.array(triangles, np.int32)


def tube_mesh(body: Body, skeleton: Skeleton) -> Mesh:
    posed = pose_body(body, rest_pose(skeleton))
    vertices, triangles, limb, count = [], [], [], 0
    for i in range(len(body)):
        p, t = capsule(posed.a[i], posed.b[i], posed.radius_a[i], posed.radius_b[i])
        vertices.append(p)
        triangles.append(t + count)
        limb += [i] * len(p)
        count += len(p)
    points = np.concatenate(vertices).astype(np.float32)
    faces = np.concatenate(triangles).astype(np.int32)
    index = np.arange(count, dtype=np.int32)
    return Mesh(points, faces, index, np.zeros((count, 2), np.float32), faces, np.array(limb, np.int32))


def tube_person(height: float = 1.75) -> Avatar:
    skeleton = standard_skeleton(height)
    body = standard_body(skeleton)
    return Avatar("tube", skeleton, body, tube_mesh(body, skeleton), (), np.zeros((1, 1, 3), np.uint8))
