"""The primitives a figure is made of: cone-spheres fixed to joints (sphere and sphylinder are special cases).

The same list carries the figure's implicit skin, its contacts with others and the ghosts it casts (Singh §2.5:
23 primitives for a figure; the hands' own capsules come after them so that fingers can touch and grasp).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import FINGERS, JOINT_INDEX, REFERENCE_HEIGHT, Skeleton, finger_joints
from vistel.jit.kernel_jit import compiled


@dataclass(frozen=True)
class Body:
    """P cone-spheres, each fixed to a joint.

    names: what each primitive is; joint: (P,) index of its joint; a, b: (P, 3) ends of its skeleton in the joint's
    frame [m]; radius_a, radius_b: (P,) radii of its surface (where its own field reaches the threshold) [m].
    """

    names: tuple[str, ...]
    joint: I32
    a: F64
    b: F64
    radius_a: F64
    radius_b: F64

    def __len__(self) -> int:
        return len(self.names)


@dataclass(frozen=True)
class PosedBody:
    """A body's primitives in the room: a, b (P, 3), radius_a, radius_b (P,), metres."""

    a: F64
    b: F64
    radius_a: F64
    radius_b: F64


def pose_body(body: Body, pose: JointPose) -> PosedBody:
    """The primitives of `body` with its joints at `pose`."""
    a, b = np.empty_like(body.a), np.empty_like(body.b)
    _pose_ends(body.joint, pose.rotation, pose.position, body.a, a)
    _pose_ends(body.joint, pose.rotation, pose.position, body.b, b)
    return PosedBody(a, b, body.radius_a, body.radius_b)


@compiled
def _pose_ends(joint: NDArray[np.int32], rotation: F64, position: F64, points: F64, out: F64) -> None:
    for i in range(len(joint)):
        j = joint[i]
        for axis in range(3):
            out[i, axis] = position[j, axis] + (
                rotation[j, axis, 0] * points[i, 0] + rotation[j, axis, 1] * points[i, 1] + rotation[j, axis, 2] * points[i, 2]
            )


@compiled
def limb_velocities(now: F64, before: F64, dt: float, fastest: float) -> F64:
    """(P, 3) velocity of the middle of each cone-sphere, (P, 8) ends and radii [m], which moved in `dt` [s]; 0 above `fastest`
    [m/s]."""
    out = np.empty((len(now), 3))
    for i in range(len(now)):
        square = 0.0
        for axis in range(3):
            middle, old = 0.5 * (now[i, axis] + now[i, 3 + axis]), 0.5 * (before[i, axis] + before[i, 3 + axis])
            out[i, axis] = (middle - old) / dt
            square += out[i, axis] ** 2
        if math.sqrt(square) > fastest:
            out[i] = 0.0
    return out


def standard_body(skeleton: Skeleton, build: float = 1.0) -> Body:
    """23 body primitives and 16 for each hand, sized after `skeleton`; `build` scales the girth (1 = average)."""
    scale = skeleton.height / REFERENCE_HEIGHT
    rows: list[tuple[str, str, F64, F64, float, float]] = []

    def add(
        name: str,
        joint: str,
        a: tuple[float, float, float] | F64,
        b: tuple[float, float, float] | F64,
        ra: float,
        rb: float,
        girth: bool = True,
    ) -> None:
        s = scale * (build if girth else 1.0)
        rows.append((name, joint, np.asarray(a, np.float64), np.asarray(b, np.float64), ra * s, rb * s))

    def m(x: float, y: float, z: float) -> F64:
        return np.array((x, y, z)) * scale

    # Least-squares fit to the surface of the built-in person of average build (median distance 3 mm).
    add("pelvis", "hips", m(-0.062, 0.036, 0.002), m(0.062, 0.036, 0.002), 0.1075, 0.1075)
    add("abdomen", "spine_3", m(-0.049, 0.033, 0.007), m(0.049, 0.033, 0.007), 0.103, 0.103)
    add("waist", "spine_5", m(-0.046, 0.023, 0.001), m(0.046, 0.023, 0.001), 0.1135, 0.1135)
    add("chest", "spine_7", m(-0.051, 0.001, -0.004), m(0.051, 0.001, -0.004), 0.1235, 0.1235)
    add("breast", "spine_8", m(-0.079, 0.010, -0.022), m(0.079, 0.010, -0.022), 0.0885, 0.0885)
    neck = skeleton.tip[JOINT_INDEX["neck"]]
    add("neck", "neck", m(0, 0.004, -0.017), neck + m(0, 0.033, -0.011), 0.067, 0.0475)
    add("skull", "head", m(0, 0.1075, -0.038), m(0, 0.1105, 0.004), 0.086, 0.0835, girth=False)
    add("face", "head", m(0, 0.066, 0.014), m(0, -0.004, 0.040), 0.0795, 0.049, girth=False)
    for side in ("left", "right"):
        sign = 1.0 if side == "left" else -1.0
        upper = skeleton.tip[JOINT_INDEX[f"{side}_upper_arm"]]
        lower = skeleton.tip[JOINT_INDEX[f"{side}_lower_arm"]]
        thigh = skeleton.tip[JOINT_INDEX[f"{side}_upper_leg"]]
        shank = skeleton.tip[JOINT_INDEX[f"{side}_lower_leg"]]
        foot = skeleton.tip[JOINT_INDEX[f"{side}_foot"]]
        collar = skeleton.tip[JOINT_INDEX[f"{side}_shoulder"]]
        add(f"{side}_collar", f"{side}_shoulder", collar * 0.35, collar * 0.9, 0.0455, 0.0585)
        add(f"{side}_upper_arm", f"{side}_upper_arm", np.zeros(3), upper, 0.0680, 0.0450)
        add(f"{side}_forearm", f"{side}_lower_arm", np.zeros(3), lower, 0.0505, 0.0355)
        add(
            f"{side}_palm",
            f"{side}_hand",
            m(sign * 0.043, -0.002, 0.015),
            m(sign * 0.052, -0.003, -0.017),
            0.0233,
            0.0210,
            girth=False,
        )
        add(f"{side}_thigh", f"{side}_upper_leg", np.zeros(3), thigh, 0.0990, 0.0665)
        add(f"{side}_shank", f"{side}_lower_leg", np.zeros(3), shank, 0.0660, 0.0600)
        add(f"{side}_foot", f"{side}_foot", m(0, -0.036, -0.020), foot + m(sign * 0.006, 0.010, 0.027), 0.0440, 0.0290, girth=False)
    add("crotch", "hips", m(-0.040, -0.033, -0.015), m(0.040, -0.033, -0.015), 0.102, 0.102)
    radii = {
        "thumb": (0.0125, 0.0115, 0.0105, 0.0090),
        "index": (0.0100, 0.0090, 0.0082, 0.0072),
        "middle": (0.0102, 0.0092, 0.0083, 0.0073),
        "ring": (0.0096, 0.0087, 0.0079, 0.0070),
        "little": (0.0086, 0.0077, 0.0070, 0.0062),
    }
    for side in ("left", "right"):
        sign = 1.0 if side == "left" else -1.0
        for i, joint in enumerate(finger_joints(side)):
            r = radii[FINGERS[i // 3]]
            add(joint, joint, np.zeros(3), skeleton.tip[JOINT_INDEX[joint]], r[i % 3], r[i % 3 + 1], girth=False)
        add(
            f"{side}_knuckles",
            f"{side}_hand",
            m(sign * 0.088, 0.0, 0.024),
            m(sign * 0.080, 0.0, -0.026),
            0.0125,
            0.0115,
            girth=False,
        )
    return Body(
        tuple(r[0] for r in rows),
        np.array([JOINT_INDEX[r[1]] for r in rows], np.int32),
        np.array([r[2] for r in rows]),
        np.array([r[3] for r in rows]),
        np.array([r[4] for r in rows]),
        np.array([r[5] for r in rows]),
    )
