"""A skeleton in the mesh's own pose, and the turns of its joints that make the T-pose of it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.skeleton import (
    FINGERS,
    JOINT_INDEX,
    JOINTS,
    PARENTS,
    REFERENCE_HEIGHT,
    SPINE_SEGMENTS,
    Skeleton,
    finger_joints,
    standard_skeleton,
)

NEEDED = tuple(
    f"{side}_{joint}"
    for side in ("left", "right")
    for joint in ("upper_arm", "lower_arm", "hand", "upper_leg", "lower_leg", "foot")
)
"""Joints without which there is no skeleton; all others are put where a person of these proportions has them."""


@dataclass(frozen=True)
class Jointed:
    """Where the joints are and how they turn. found: the skeleton as the mesh stands; rest: in the T-pose; turn:
    (J, 3, 3) rotation of each joint from the one to the other."""

    found: Skeleton
    rest: Skeleton
    turn: F64


def jointed(at: Mapping[str, F64], height: float) -> Jointed:
    """From the joints known, by name, in the upright frame [m]. Raises KeyError for one of NEEDED that is missing."""
    standard = standard_skeleton(height)
    scale = height / REFERENCE_HEIGHT
    rest0 = np.full((len(JOINTS), 3), np.nan)
    for name, p in at.items():
        rest0[JOINT_INDEX[name]] = p
    for name in NEEDED:
        if np.isnan(rest0[JOINT_INDEX[name]]).any():
            raise KeyError(name)
    _trunk(rest0, scale, standard)
    turn = np.tile(np.eye(3), (len(JOINTS), 1, 1))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        x = np.array((sign, 0.0, 0.0))
        upper, lower, hand = (JOINT_INDEX[f"{side}_{j}"] for j in ("upper_arm", "lower_arm", "hand"))
        turn[upper] = swing(rest0[lower] - rest0[upper], x)
        turn[lower] = swing(turn[upper] @ (rest0[hand] - rest0[lower]), x) @ turn[upper]
        _hand(rest0, turn, standard, side, sign)
        down = np.array((0.0, -1.0, 0.0))
        thigh, shank, foot = (JOINT_INDEX[f"{side}_{j}"] for j in ("upper_leg", "lower_leg", "foot"))
        turn[thigh] = swing(rest0[shank] - rest0[thigh], down)
        turn[shank] = swing(turn[thigh] @ (rest0[foot] - rest0[shank]), down) @ turn[thigh]
        toes = JOINT_INDEX[f"{side}_toes"]
        if np.isnan(rest0[toes]).any():
            rest0[toes] = rest0[foot] + standard.offsets[toes]
    rest = rest0.copy()
    for j in range(1, len(JOINTS)):
        p = int(PARENTS[j])
        rest[j] = rest[p] + turn[p] @ (rest0[j] - rest0[p])
    _symmetric_feet(rest)
    found = Skeleton(rest0, _tips(rest0, standard, turn, height))
    straight = np.tile(np.eye(3), (len(JOINTS), 1, 1))
    return Jointed(found, Skeleton(rest, _tips(rest, standard, straight, height)), turn)


def _trunk(at: F64, scale: float, standard: Skeleton) -> None:
    """Hips, spine, neck, head and collar bones; the spine is upright and in the middle, which postures rely on."""

    def mid(joint: str) -> F64:
        return 0.5 * (at[JOINT_INDEX[f"left_{joint}"]] + at[JOINT_INDEX[f"right_{joint}"]])

    legs, arms = mid("upper_leg"), mid("upper_arm")
    hips, neck, head = JOINT_INDEX["hips"], JOINT_INDEX["neck"], JOINT_INDEX["head"]
    at[hips] = legs
    at[hips, 1] += 0.02 * scale
    at[hips, 0] = 0.0
    if np.isnan(at[neck]).any():
        at[neck] = (0.0, arms[1] + 0.06 * scale, arms[2])
    at[neck, 0] = 0.0
    top = at[neck, 1] - 0.03 * scale
    first = JOINT_INDEX["spine_1"]
    z = 0.5 * (at[hips, 2] + arms[2])
    for k in range(SPINE_SEGMENTS):
        at[first + k] = (0.0, at[hips, 1] + k * (top - at[hips, 1]) / SPINE_SEGMENTS, z)
    if np.isnan(at[head]).any():
        at[head] = at[neck] + standard.offsets[head]
    at[head, 0] = 0.0
    for name in ("jaw", "left_eye", "right_eye"):
        if np.isnan(at[JOINT_INDEX[name]]).any():
            at[JOINT_INDEX[name]] = at[head] + standard.offsets[JOINT_INDEX[name]]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        collar = JOINT_INDEX[f"{side}_shoulder"]
        if np.isnan(at[collar]).any():
            at[collar] = (sign * 0.02 * scale, at[JOINT_INDEX[f"{side}_upper_arm"], 1], z + 0.02 * scale)


def _hand(at: F64, turn: F64, standard: Skeleton, side: str, sign: float) -> None:
    """The hand flat with its palm down, fingers along X; fingers the rig lacks as a hand of this size has them."""
    hand, lower = JOINT_INDEX[f"{side}_hand"], JOINT_INDEX[f"{side}_lower_arm"]
    row = [JOINT_INDEX[f"{side}_{f}_proximal"] for f in ("index", "middle", "ring", "little")]
    known = [j for j in row if not np.isnan(at[j]).any()]
    forward = turn[lower]
    if len(known) >= 3:
        along = at[known].mean(axis=0) - at[hand]
        across = at[known[0]] - at[known[-1]]
        now = _frame(along, across)
        turn[hand] = _frame(np.array((sign, 0.0, 0.0)), np.array((0.0, 0.0, 1.0))) @ now.T
    else:
        turn[hand] = forward
    size = _hand_size(at, standard, side)
    for k, joint in enumerate(finger_joints(side)):
        j, p = JOINT_INDEX[joint], int(PARENTS[JOINT_INDEX[joint]])
        if np.isnan(at[j]).any():
            # As the standard's, in the pose of the file: turned back from the T-pose.
            at[j] = at[p] + turn[p].T @ (size * standard.offsets[j])
        # The last phalanx has no joint behind it: it goes on as the one before.
        if k % 3 == 2:
            turn[j] = turn[p]
            continue
        n = JOINT_INDEX[finger_joints(side)[k + 1]]
        to = np.array((sign, 0.0, 0.0))
        if FINGERS[k // 3] == "thumb":
            to = standard.offsets[n]
        bone = at[n] - at[j]
        turn[j] = swing(turn[p] @ bone, to) @ turn[p] if not np.isnan(bone).any() else turn[p]


def _hand_size(at: F64, standard: Skeleton, side: str) -> float:
    """Size of the hand over the standard's: by its middle knuckle, else by the forearm."""
    hand, lower, knuckle = (JOINT_INDEX[f"{side}_{j}"] for j in ("hand", "lower_arm", "middle_proximal"))
    if not np.isnan(at[knuckle]).any():
        return float(np.linalg.norm(at[knuckle] - at[hand]) / np.linalg.norm(standard.offsets[knuckle]))
    return float(np.linalg.norm(at[hand] - at[lower]) / np.linalg.norm(standard.offsets[hand]))


def _frame(along: F64, across: F64) -> F64:
    x = along / np.linalg.norm(along)
    z = across - (across @ x) * x
    z /= max(float(np.linalg.norm(z)), 1e-12)
    return np.stack([x, np.cross(z, x), z], axis=1)


def swing(a: F64, b: F64) -> F64:
    """The smallest rotation (3, 3) that turns the direction a into b."""
    a, b = a / max(float(np.linalg.norm(a)), 1e-12), b / max(float(np.linalg.norm(b)), 1e-12)
    v, c = np.cross(a, b), float(a @ b)
    if c < -0.9999999:
        axis = np.cross(a, (1.0, 0.0, 0.0) if abs(a[0]) < 0.9 else (0.0, 1.0, 0.0))
        axis /= np.linalg.norm(axis)
        return 2.0 * np.outer(axis, axis) - np.eye(3)
    k = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + k + k @ k / (1.0 + c)


def _symmetric_feet(rest: F64) -> None:
    """Left and right leg of one length and one depth, as postures with fixed feet take them to be."""
    for joint in ("upper_leg", "lower_leg", "foot"):
        left, right = JOINT_INDEX[f"left_{joint}"], JOINT_INDEX[f"right_{joint}"]
        rest[[left, right], 1:] = rest[[left, right], 1:].mean(axis=0)


def _tips(at: F64, standard: Skeleton, turn: F64, height: float) -> F64:
    """(J, 3) ends of the bones: the next joint, or as far as a person of that size."""
    tip = np.zeros_like(at)
    for j in range(1, len(JOINTS)):
        p = int(PARENTS[j])
        if JOINTS[p] not in ("hips", "head") and (JOINTS[j] == "neck" or not tip[p].any()):
            tip[p] = at[j] - at[p]
    for j in range(len(JOINTS)):
        if not tip[j].any():
            tip[j] = turn[j].T @ standard.tip[j]
    tip[JOINT_INDEX["hips"]] = at[JOINT_INDEX["spine_1"]] - at[JOINT_INDEX["hips"]] + (0, 0.02 * height / REFERENCE_HEIGHT, 0)
    head = JOINT_INDEX["head"]
    tip[head] = (0.0, height - at[head, 1], 0.0)
    for side in ("left", "right"):
        hand = JOINT_INDEX[f"{side}_hand"]
        tip[hand] = at[JOINT_INDEX[f"{side}_middle_proximal"]] - at[hand]
        for finger in FINGERS:
            last = JOINT_INDEX[f"{side}_{finger}_distal"]
            before = int(PARENTS[last])
            tip[last] = (
                0.85
                * np.linalg.norm(at[last] - at[before])
                * (at[last] - at[before])
                / max(float(np.linalg.norm(at[last] - at[before])), 1e-9)
            )
    return tip
