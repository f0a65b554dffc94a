"""A person of a log as a Biovision hierarchy (BVH), for programs that animate figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, TextIO

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import Posture, interpolate, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS
from vistel.log.numbers import skeleton_of

if TYPE_CHECKING:
    from vistel.log import Log

CM = 100.0
"""BVH files are mostly in centimetres."""
_USUAL = {"shoulder": "Shoulder", "upper_arm": "Arm", "lower_arm": "ForeArm", "hand": "Hand"} | {
    "upper_leg": "UpLeg",
    "lower_leg": "Leg",
    "foot": "Foot",
    "toes": "ToeBase",
}
"""What other programs call the joints of limbs, after the side."""
_ROTATION = "Zrotation Xrotation Yrotation"
_POSITION = "Xposition Yposition Zposition"
_CHILDREN: dict[int, list[int]] = {j: [c for c in range(len(JOINTS)) if PARENTS[c] == j] for j in range(len(JOINTS))}


def write_bvh(log: Log, participant: str, file: TextIO, begin: float = 0.0, end: float | None = None, fps: float = 60.0) -> int:
    """Write what a participant did from `begin` to `end` [s], `fps` frames a second between its postures. Returns how many frames.

    The spine's segments, the neck and the upper arms have positions too: they shift. Raises ValueError, one line, for an unknown
    participant and where there is no posture.
    """
    skeleton = skeleton_of(log, participant)
    timed = postures_of(log, participant, begin, end)
    moved = list(frames(timed, fps))
    file.write("HIERARCHY\n")
    _write_joint(file, skeleton.offsets * CM, skeleton.tip * CM, 0, "")
    file.write(f"MOTION\nFrames: {len(moved)}\nFrame Time: {1.0 / fps:.8f}\n")
    order = list(_depth_first(0))
    for posture in moved:
        pose = pose_joints(skeleton, posture)
        numbers: list[float] = []
        for j in order:
            p = int(PARENTS[j])
            above = pose.rotation[p].T if p >= 0 else np.eye(3)
            if _shifts(j):
                numbers += (CM * above @ (pose.position[j] - (pose.position[p] if p >= 0 else 0.0))).tolist()
            numbers += _zxy(above @ pose.rotation[j])
        file.write(" ".join(f"{x:.4f}" for x in numbers) + "\n")
    return len(moved)


def postures_of(log: Log, participant: str, begin: float, end: float | None) -> list[tuple[float, Posture]]:
    """Times [s] and postures from `begin` to `end`. Raises ValueError, one line, where there is none."""
    timed = list(log.postures(participant, begin, end))
    if not timed:
        raise ValueError(f"{log.path}: no posture of {participant} in that time")
    return timed


def frames(timed: Sequence[tuple[float, Posture]], fps: float) -> Iterator[Posture]:
    """`fps` postures a second, from the first of `timed` [s] to the last, between its own."""
    n, (t0, last) = 0, (timed[0][0], timed[-1][0])
    for frame in range(int((last - t0) * fps) + 1):
        t = t0 + frame / fps
        while n + 2 < len(timed) and timed[n + 1][0] <= t:
            n += 1
        if n + 1 == len(timed):
            yield timed[n][1]
            return
        (before, a), (after, b) = timed[n], timed[n + 1]
        yield interpolate(a, b, min(1.0, (t - before) / (after - before))) if after > before else b


def _depth_first(j: int) -> Iterator[int]:
    yield j
    for child in _CHILDREN[j]:
        yield from _depth_first(child)


def _shifts(j: int) -> bool:
    name = JOINTS[j]
    return name in ("hips", "neck") or name.startswith("spine_") or name.endswith("_upper_arm")


def _write_joint(file: TextIO, offsets: F64, tip: F64, j: int, indent: str) -> None:
    offset = np.zeros(3) if j == 0 else offsets[j]
    channels = f"6 {_POSITION} {_ROTATION}" if _shifts(j) else f"3 {_ROTATION}"
    file.write(f"{indent}{'ROOT' if j == 0 else 'JOINT'} {_name(JOINTS[j])}\n{indent}{{\n")
    file.write(f"{indent}  OFFSET {_three(offset)}\n{indent}  CHANNELS {channels}\n")
    for child in _CHILDREN[j]:
        _write_joint(file, offsets, tip, child, indent + "  ")
    if not _CHILDREN[j]:
        file.write(f"{indent}  End Site\n{indent}  {{\n{indent}    OFFSET {_three(tip[j])}\n{indent}  }}\n")
    file.write(f"{indent}}}\n")


def _three(v: F64) -> str:
    return " ".join(f"{x:.4f}" for x in v)


def _name(joint: str) -> str:
    """LeftForeArm of left_lower_arm; the top of the spine is the Chest."""
    if joint == f"spine_{len([n for n in JOINT_INDEX if n.startswith('spine_')])}":
        return "Chest"
    side, _, rest = joint.partition("_")
    if rest in _USUAL:
        return side.capitalize() + _USUAL[rest]
    return "".join(word.capitalize() for word in joint.replace("spine", "spine_segment").split("_"))


def _zxy(r: F64) -> list[float]:
    """Angles [degrees] about Z, then X, then Y that make a rotation matrix: R = Rz Rx Ry."""
    x = np.arcsin(np.clip(r[2, 1], -1.0, 1.0))
    z, y = np.arctan2(-r[0, 1], r[1, 1]), np.arctan2(-r[2, 0], r[2, 2])
    return np.degrees([z, x, y]).tolist()
