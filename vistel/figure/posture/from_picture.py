"""A seated person from landmarks in one camera's picture: where a point lies on its ray follows from the lengths of bones.

Frame: the seat's (+X to the person's left, +Y up, +Z where they face); the camera looks along -Z, and its picture's right is the
person's left. Points of a picture are in picture heights from its middle, y up.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import HAND_DOF_COUNT
from vistel.geometry.rotation import matrix_from_rotvec, rotation_x, rotation_y

FOCAL = 1.22
"""Of a webcam, whose picture is 40 to 48 degrees high: the distance at which what is seen is as high as the picture, in picture
heights. Browsers do not tell it. An error acts as one of depth: what is seen across does not depend on it."""
BONE_M = 0.02
"""How far a bone's length may be off, as joints are seen [m]."""
ELBOW_M = 0.20
"""How far off the landmarks' own depth of an elbow is, from the shoulder [m]."""
WRIST_M = 0.07
"""The same of a wrist [m]."""
PALM_M = 0.05
"""How much farther a wrist may be than its hand looks small [m]..."""
ASLANT_M = 0.30
"""... and how much nearer: networks see hands that point at the camera shorter than they are [m]."""
STILL_M = 0.02
"""An elbow or wrist moves no more than this [m]..."""
FAST_M_S = 1.5
"""... and this far a second in depth, or it is more likely another solution [m/s]."""
BEHIND_M = 0.05
"""A wrist that would be farther than this behind its shoulder is unlikely: a camera does not see it there [m]."""
_GRID = 25
"""Depths of an elbow that are tried, and of a wrist."""
PALM_POINTS = (0, 1, 5, 9, 13, 17)
"""Of a hand's 21 points those that its palm carries: the wrist, the thumb's base, the knuckles."""
PALM_JOINTS = ("hand", "thumb_metacarpal", "index_proximal", "middle_proximal", "ring_proximal", "little_proximal")
"""The joints there."""


class Placed(NamedTuple):
    """Points (n, 3) that lie as `shape` does after `scale * rotation @ shape + shift`."""

    rotation: F64
    scale: float
    shift: F64


def fitted(shape: F64, points: F64) -> Placed:
    """How `shape` (n, 3) lies where `points` (n, 3) are, in the sense of least squares (Umeyama 1991)."""
    from_shape, from_points = shape.mean(axis=0), points.mean(axis=0)
    a, b = shape - from_shape, points - from_points
    u, d, vt = np.linalg.svd(b.T @ a)
    sign = np.array((1.0, 1.0, math.copysign(1.0, float(np.linalg.det(u) * np.linalg.det(vt)))))
    rotation = np.ascontiguousarray((u * sign) @ vt)
    scale = float((d * sign).sum() / max(1e-12, float((a * a).sum())))
    return Placed(rotation, scale, from_points - scale * rotation @ from_shape)


def turn_between(a: F64, b: F64) -> F64:
    """(3, 3) the shortest rotation that takes the direction of `a` to that of `b`."""
    axis = np.cross(a, b)
    across = float(np.linalg.norm(axis))
    return matrix_from_rotvec(np.ascontiguousarray(axis * (math.atan2(across, float(a @ b)) / max(across, 1e-12))))


def ray(point: F64) -> F64:
    """(3,) from the camera to what is seen at a point (2,) of the picture, one metre deep."""
    return np.array((point[0] / FOCAL, point[1] / FOCAL, -1.0))


def unprojected(points: F64) -> F64:
    """(n, 3) where points (n, 3) of a picture, with their depths in its units, are from the camera, in units of the distance of
    what has depth 0."""
    deep = 1.0 - points[:, 2:] / FOCAL
    return np.hstack((points[:, :2] / FOCAL * deep, -deep))


class Arm(NamedTuple):
    """elbow, wrist: (2,) in the picture; depths: (2,) how far each is nearer to the camera than the shoulder, as the landmarks
    have it, and palm: the wrist's distance from the camera, as the hand's size has it [m]; None: not known."""

    elbow: F64
    wrist: F64
    depths: F64
    palm: float | None = None


def arm_of(arm: Arm, camera: F64, shoulder: F64, lengths: F64, last: F64 | None, dt: float) -> tuple[F64, F64, F64]:
    """Elbow and wrist (3,) of an arm whose bones have `lengths` (2,) [m], and their distances (2,) from the camera [m].

    camera, shoulder: (3,). last: the distances `dt` before, None where the arm was not seen. All pairs of distances are weighed:
    bones keep their lengths, the landmarks' depths are rough, an arm does not jump.
    """
    near = float(camera[2] - shoulder[2])
    rays = ray(arm.elbow), ray(arm.wrist)
    first = near + lengths[0] * np.linspace(-1.1, 1.1, _GRID)
    second = near + lengths.sum() * np.linspace(-1.1, 1.1, 2 * _GRID - 1)
    steps = np.array((first[1] - first[0], second[1] - second[0]))
    best = np.array((near, near))
    for _ in range(3):  # ever finer round the best
        cost = _cost(first[:, None], second[None, :], arm, camera, shoulder, lengths, rays, max(BONE_M, float(steps[0])))
        if last is not None:
            most = STILL_M + FAST_M_S * dt
            cost += ((first[:, None] - last[0]) / most) ** 2 + ((second[None, :] - last[1]) / most) ** 2
        i, j = divmod(int(np.argmin(cost)), len(second))
        best = np.array((first[i], second[j]))
        first, second = (best[k] + steps[k] * np.linspace(-1.0, 1.0, 9) for k in range(2))
        steps = steps / 4.0
    return camera + best[0] * rays[0], camera + best[1] * rays[1], best


def _cost(first: F64, second: F64, arm: Arm, camera: F64, shoulder: F64, lengths: F64, rays: tuple[F64, F64], bone: float) -> F64:
    """(n, m) of every pair of distances of elbow (n, 1) and wrist (1, m). bone: how far the bones' lengths may be off [m]."""
    near = camera[2] - shoulder[2]
    elbow = camera + first[..., None] * rays[0]
    wrist = camera + second[..., None] * rays[1]
    upper: F64 = np.linalg.norm(elbow - shoulder, axis=-1)
    lower: F64 = np.linalg.norm(wrist - elbow, axis=-1)
    cost: F64 = ((upper - lengths[0]) / bone) ** 2 + ((lower - lengths[1]) / bone) ** 2
    cost += ((near - first - arm.depths[0]) / ELBOW_M) ** 2 + ((near - second - arm.depths[1]) / WRIST_M) ** 2
    cost += (np.maximum(0.0, second - near - BEHIND_M) / BONE_M) ** 2
    if arm.palm is not None:
        off = second - arm.palm
        cost += (off / np.where(off > 0.0, PALM_M, ASLANT_M)) ** 2
    return cost


def palm_of(points: F64, rest: F64) -> Placed:
    """How the palm lies whose joints PALM_JOINTS rest at `rest` (6, 3) [m, hand's frame], from 21 points (21, 3)."""
    return fitted(rest, points[list(PALM_POINTS)])


def fingers_of(points: F64, rotation: F64, side: float, rest: Mapping[str, F64]) -> F64:
    """(20,) angles of a hand [rad], as a row of `Posture.hands`, from its 21 points (21, 3) and its rotation (3, 3); side +1 left.

    rest: bones "thumb_metacarpal" and "thumb_proximal" (3,) of the left hand in its frame.
    """
    seen = points @ rotation * (side, 1.0, 1.0)  # as a left hand's
    out = np.zeros(HAND_DOF_COUNT)
    out[:4] = _thumb(np.diff(seen[1:5], axis=0), rest["thumb_metacarpal"], rest["thumb_proximal"])
    for finger in range(4):
        first = 5 + 4 * finger
        out[4 + 4 * finger : 8 + 4 * finger] = _finger(np.diff(seen[first : first + 4], axis=0))
    return out


def _finger(bones: F64) -> F64:
    """Base flexion, abduction, middle and end flexion of (3, 3) bones of a left hand, whose fingers point along +X, palm down."""
    base = bones[0]
    across = math.hypot(base[0], base[2])
    bent_back = base[0] < 0.0 and -base[1] > 0.0  # past a right angle
    spread = 0.0 if across < 0.4 * math.hypot(across, base[1]) or bent_back else math.atan2(base[2], base[0])
    along = np.array((math.cos(spread), 0.0, math.sin(spread)))
    angles = np.array([math.atan2(-bone[1], float(bone @ along)) for bone in bones])
    turns = (np.diff(angles) + math.pi) % (2.0 * math.pi) - math.pi
    return np.array((angles[0], spread, turns[0], turns[1]))


def _thumb(bones: F64, metacarpal: F64, proximal: F64) -> F64:
    """Roll, abduction and two flexions of the (3, 3) bones of a left thumb whose bones rest as given."""
    first = bones[0] * (np.linalg.norm(metacarpal) / max(1e-9, float(np.linalg.norm(bones[0]))))
    reach = math.hypot(metacarpal[0], metacarpal[2])
    abduction = math.acos(min(1.0, max(-1.0, first[0] / reach))) - math.atan2(metacarpal[2], metacarpal[0])
    raised = metacarpal[0] * math.sin(abduction) + metacarpal[2] * math.cos(abduction)
    roll = math.atan2(first[2], first[1]) - math.atan2(raised, metacarpal[1])
    roll = (roll + math.pi) % (2.0 * math.pi) - math.pi
    frame = rotation_x(roll) @ rotation_y(-abduction)
    angles = [math.atan2(proximal[2], proximal[0])]
    angles += [math.atan2(bone[2], bone[0]) for bone in bones[1:] @ frame]
    return np.array((roll, abduction, angles[0] - angles[1], angles[1] - angles[2]))
