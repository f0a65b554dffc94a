"""Joints of a person whose mesh has no rig, found from its shape in a T- or A-pose.

Arms: rings of equal distance along the surface from the fingertips have their middles on the arm's axis; where they grow
to the girth of the trunk, the shoulder begins. Legs: middles of slices. The joints between divide these lengths as in an average
body."""

from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import KDTree

from vistel.arrays import F64, I32
from vistel.figure.making.source import MakingError
from vistel.figure.skeleton import JOINT_INDEX, REFERENCE_HEIGHT, standard_skeleton

_WRIST = 0.262
"""Place of the wrist, as a share of the way from the fingertips to the shoulder joint."""
_ELBOW = 0.610
"""Place of the elbow, as a share of the same way."""
_ARM = 0.746
"""That way [m], for REFERENCE_HEIGHT."""
_TOUCH = 0.03
"""How near pieces must be to count as connected [m]."""
_PIECES = 40
"""How many pieces are connected so, largest first."""
_POSE = "pose the person standing with both arms sideways or half down (T- or A-pose), clear of the body, or import it with a rig"


def joints_by_shape(points: F64, triangles: I32) -> dict[str, F64]:
    """Places of arms, legs, hips, neck and head by name. points: (V, 3) upright [m]. Raises MakingError."""
    tall = float(points[:, 1].max())
    scale = tall / REFERENCE_HEIGHT
    out: dict[str, F64] = {}
    surface = _graph(points, triangles, scale)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        out |= _arm(points, surface, side, sign, scale)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        out |= _leg(points, side, sign, scale, tall)
    _mirrored(out)
    arms = 0.5 * (out["left_upper_arm"] + out["right_upper_arm"])
    standard = standard_skeleton(tall)
    neck_up = float(standard.rest[JOINT_INDEX["neck"], 1] - standard.rest[JOINT_INDEX["left_upper_arm"], 1])
    out["neck"] = np.array((0.0, arms[1] + neck_up, _slice_middle(points, arms[1] + neck_up, 0.10 * scale)[2] - 0.015 * scale))
    head = float(standard.rest[JOINT_INDEX["head"], 1])
    head = max(head, out["neck"][1] + 0.06 * scale)
    out["head"] = np.array((0.0, head, _slice_middle(points, head, 0.10 * scale)[2] - 0.005 * scale))
    for side in ("left", "right"):
        eye = standard.rest[JOINT_INDEX[f"{side}_eye"]]
        near = points[(np.abs(points[:, 0] - eye[0]) < 0.02 * scale) & (np.abs(points[:, 1] - eye[1]) < 0.02 * scale)]
        front = float(near[:, 2].max()) if len(near) else eye[2]
        out[f"{side}_eye"] = np.array((eye[0], eye[1], front - 0.014 * scale))
    return out


def _graph(points: F64, triangles: I32, scale: float) -> Any:
    """Lengths of the edges between vertices; pieces that nearly touch, as a hand and its sleeve, are connected there."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    ends = np.unique(np.sort(ends, axis=1), axis=0).astype(np.int64)
    size = (len(points), len(points))
    joined = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=size)
    label: Any = connected_components(joined, directed=False)[1]
    pieces = np.argsort(-np.bincount(label), kind="stable")[:_PIECES]
    for piece in pieces[1:]:
        mine, others = np.flatnonzero(label == piece), np.flatnonzero(label != piece)
        found: Any = KDTree(points[others]).query(points[mine], distance_upper_bound=_TOUCH * scale)
        distance, nearest = found
        near = np.isfinite(distance)
        ends = np.vstack([ends, np.column_stack([mine[near], others[nearest[near]]])])
    length = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1) + 1e-9
    graph = coo_array((length, (ends[:, 0], ends[:, 1])), shape=size)
    graph.sum_duplicates()
    return csr_array(graph)


def _arm(points: F64, surface: Any, side: str, sign: float, scale: float) -> dict[str, F64]:
    tip = int(np.argmax(sign * points[:, 0]))
    if sign * points[tip, 0] < 0.25 * scale or points[tip, 1] < 0.28 * REFERENCE_HEIGHT * scale:
        raise MakingError(f"no {side} arm is to be seen beside the body; {_POSE}")
    far = dijkstra(surface, directed=False, indices=tip)
    step = 0.02 * scale
    middles: list[F64] = []
    girth: list[float] = []
    at: list[float] = []
    for d in np.arange(2 * step, 1.0 * scale, step):
        ring = points[np.abs(far - d) < 0.75 * step]
        if len(ring) < 6:
            continue
        middle = 0.5 * (ring.min(axis=0) + ring.max(axis=0))
        middles.append(middle)
        girth.append(float(np.linalg.norm(ring - middle, axis=1).mean()))
        at.append(float(d))
    if len(at) < 12:
        raise MakingError(f"the {side} arm hangs together with nothing; mend the mesh so that arm and body are one surface")
    sizes = np.array(girth)
    forearm = float(np.median(sizes[(np.array(at) > 0.25 * scale) & (np.array(at) < 0.50 * scale)]))
    wide = np.flatnonzero((sizes > 2.2 * forearm) & (np.array(at) > 0.45 * scale))
    end = int(wide[0]) if len(wide) else len(at) - 1
    axis = np.array(middles[: max(end - 2, 4)])
    far_part = axis[np.array(at[: len(axis)]) > 0.30 * scale]
    if len(far_part) < 4:
        raise MakingError(f"the {side} arm is too short to be one; {_POSE}")
    centre = far_part.mean(axis=0)
    along = np.linalg.svd(far_part - centre)[2][0]
    along *= -np.sign(along[0]) * sign
    # Rings end at the armpit. In a T-pose the flesh above it makes them end early: half as measured, half as usual.
    reach = float((axis[-1] - centre) @ along) + 0.035 * scale
    if abs(along[1]) < 0.35:
        reach = 0.5 * (reach + _ARM * scale - float((points[tip] - centre) @ -along))
    shoulder = centre + reach * along
    shoulder[0] = sign * np.clip(sign * shoulder[0], 0.13 * scale, 0.21 * scale)
    total = np.concatenate([[points[tip]], axis, [shoulder]])
    path = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(total, axis=0), axis=1))])
    straight = np.linalg.norm(points[tip] - shoulder)
    path *= straight / path[-1] if path[-1] < 1.3 * straight else 1.0
    out: dict[str, F64] = {f"{side}_upper_arm": shoulder}
    for joint, share in (("lower_arm", _ELBOW), ("hand", _WRIST)):
        place: list[float] = [np.interp(share * path[-1], path, total[:, k]) for k in range(3)]
        out[f"{side}_{joint}"] = np.array(place)
    return out


def _leg(points: F64, side: str, sign: float, scale: float, tall: float) -> dict[str, F64]:
    standard = standard_skeleton(tall)
    crotch = _crotch(points, tall)
    out: dict[str, F64] = {}
    shift = float(np.clip(crotch - 0.80 * scale, -0.10 * scale, 0.10 * scale))
    for joint in ("upper_leg", "lower_leg", "foot"):
        y = float(standard.rest[JOINT_INDEX[f"{side}_{joint}"], 1])
        y += shift * (1.0 if joint == "upper_leg" else 0.5 if joint == "lower_leg" else 0.0)
        level = y if joint != "upper_leg" else crotch - 0.06 * scale
        x = sign * points[:, 0]
        beside = points[(x > 0.0) & (x < 0.45 * scale)]
        # Coarse meshes have no vertices in a thin slice.
        for thick in (0.012, 0.03, 0.06):
            ring = beside[np.abs(beside[:, 1] - level) < thick * scale]
            if len(ring) >= 8:
                break
        # Hands beside a thigh are further out than the thigh is thick.
        ring = ring[sign * ring[:, 0] < float(np.min(sign * ring[:, 0])) + 0.24 * scale] if len(ring) else ring
        if len(ring) < 4:
            raise MakingError(f"no {side} leg at a height of {level:.2f} m; {_POSE}")
        middle = 0.5 * (ring.min(axis=0) + ring.max(axis=0))
        across = 0.92 * middle[0] if joint == "upper_leg" else middle[0]
        out[f"{side}_{joint}"] = np.array((across, y, middle[2]))
    foot = points[(points[:, 1] < 0.05 * tall) & (sign * points[:, 0] > 0.0)]
    low, high = foot.min(axis=0), foot.max(axis=0)
    ankle = out[f"{side}_foot"]
    out[f"{side}_foot"] = np.array((ankle[0], ankle[1], low[2] + 0.25 * (high[2] - low[2])))
    out[f"{side}_toes"] = np.array((0.5 * (low[0] + high[0]), 0.02 * scale, low[2] + 0.72 * (high[2] - low[2])))
    return out


def _crotch(points: F64, tall: float) -> float:
    """Height up to which the legs are apart: the highest slice with nothing in the middle. Skirts have none."""
    middle = points[np.abs(points[:, 0]) < 0.012 * tall]
    below = middle[(middle[:, 1] > 0.30 * tall) & (middle[:, 1] < 0.56 * tall)]
    return float(below[:, 1].min()) if len(below) and below[:, 1].min() > 0.36 * tall else 0.457 * tall


def _slice_middle(points: F64, y: float, half_width: float) -> F64:
    ring = points[(np.abs(points[:, 1] - y) < 0.012) & (np.abs(points[:, 0]) < half_width)]
    return 0.5 * (ring.min(axis=0) + ring.max(axis=0)) if len(ring) else np.array((0.0, y, 0.0))


def _mirrored(out: dict[str, F64]) -> None:
    """Left and right made mirror images where they nearly are: landmarks are noisier than people are uneven."""
    for name in [n for n in out if n.startswith("left_")]:
        other = "right_" + name.removeprefix("left_")
        a, b = out[name], out[other] * (-1.0, 1.0, 1.0)
        if np.linalg.norm(a - b) < 0.06:
            middle = 0.5 * (a + b)
            out[name], out[other] = middle, middle * (-1.0, 1.0, 1.0)
