"""Where the joints, faces and hands of people in a picture are, and which of them are seen."""

from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, Skeleton
from vistel.render.view.camera import FAR, NEAR, Pinhole

MARKS = {11: "left_upper_arm", 12: "right_upper_arm", 13: "left_lower_arm", 14: "right_lower_arm", 15: "left_hand",
         16: "right_hand", 23: "left_upper_leg", 24: "right_upper_leg", 25: "left_lower_leg", 26: "right_lower_leg",
         27: "left_foot", 28: "right_foot"}  # fmt: skip
"""The detector's landmarks of a pose that are joints of ours."""
FACE = 0.10
"""Half the height of a face, from brows to chin [m]."""
HEAD = 0.15
"""From the middle of a face to the edge of what a detector needs to see: head, hair and a little round it [m]."""
INSIDE = 0.16
"""A joint or an eye that is no deeper under what is seen there is not hidden: flesh and clothes are over it [m]."""
HAND_INSIDE = 0.035
"""The same for the joints of a hand [m]."""
CROP = 2.2
"""Side of the square in which a hand is looked for, in lengths of the hand."""
_FINGERS = {side: [n for n, j in enumerate(JOINTS) if j.startswith(f"{side}_") and j.split("_")[1] in
                   ("hand", "thumb", "index", "middle", "ring", "little")] for side in ("left", "right")}  # fmt: skip


def distances(depth: F64) -> F64:
    """Metres in front of the camera, from a depth buffer (height, width)."""
    return 2.0 * FAR * NEAR / (FAR + NEAR - (2.0 * depth - 1.0) * (FAR - NEAR))


def truth_of(name: str, skeleton: Skeleton, pose: JointPose, camera: Pinhole, metres: F64) -> dict[str, Any]:
    """Of one person, in pixels. metres: (height, width) distance of what is seen, first row at the top."""
    height, width = metres.shape
    tips = pose.position + np.einsum("jab,jb->ja", pose.rotation, skeleton.tip)
    at = camera.project(pose.position, width, height)
    eyes = at[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]]
    head = pose.rotation[JOINT_INDEX["head"]]
    middle = pose.position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0)
    to_eye = camera.position - middle
    cosine = float(head[:, 2] @ to_eye / np.linalg.norm(to_eye))
    # Before eyes, nose and chin, so that the head's own skin does not hide them.
    ahead = head @ np.array(((0.03, 0.0, 0.03), (-0.03, 0.0, 0.03), (0.0, -0.04, 0.05), (0.0, -0.08, 0.04))).T
    face = camera.project(middle + ahead.T, width, height)
    hands = [camera.project(np.vstack((pose.position[n], tips[n[1:]])), width, height) for n in _FINGERS.values()]
    x, y, half = *map(float, face[2, :2]), camera.pixels_per_m(float(face[2, 2]), height) * FACE
    room = half * HEAD / FACE
    return {
        "name": name,
        "turned": float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))),
        "face": [x, y, half],
        "eyes": eyes[:, :2].tolist(),
        "whole": room <= x <= width - room and room <= y <= height - room,
        "face_seen": float(_seen(face, metres, INSIDE).mean()),
        "stature": skeleton.height * camera.pixels_per_m(float(at[JOINT_INDEX["hips"], 2]), height),
        "joints": {str(k): at[JOINT_INDEX[j], :2].tolist() for k, j in MARKS.items()},
        "joints_seen": {str(k): bool(_seen(at[[JOINT_INDEX[j]]], metres, INSIDE)[0]) for k, j in MARKS.items()},
        "hands": [_hand(hand, metres) for hand in hands],
    }


def _hand(at: F64, metres: F64) -> dict[str, Any]:
    low, high = at[:, :2].min(axis=0), at[:, :2].max(axis=0)
    long = float((high - low).max())
    side = max(1, round(CROP * long))
    corner = np.round(0.5 * (low + high) - 0.5 * side).astype(int)
    return {"long": long, "seen": float(_seen(at, metres, HAND_INSIDE).mean()), "square": [*map(int, corner), side]}


def _seen(at: F64, metres: F64, inside: float) -> F64:
    """1 for each place (x, y, distance) that is in the picture and not behind something else."""
    height, width = metres.shape
    x, y = np.floor(at[:, 0]).astype(int), np.floor(at[:, 1]).astype(int)
    within = (x >= 0) & (x < width) & (y >= 0) & (y < height) & (at[:, 2] > 0.0)
    before = metres[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]
    return (within & (before > at[:, 2] - inside)).astype(np.float64)
