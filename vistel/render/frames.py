"""The stream of a room's motion: one frame for all viewers, whole in itself, little-endian.

| bytes | what |
|---|---|
| 1 | FORMAT |
| 1 | 0 |
| 2 | of the table of people and things that numbers below refer to, modulo 65536 |
| 2, 2 | how many people and things follow |
| 8 | conference time [ms], float64 |
| 436 each | people, `PERSON` |
| 24 each | things, `THING` |

A rotation of the body is a unit quaternion (x, y, z, w) as its three smaller components, those in order, each of 15 bits from
-sqrt(1/2) to sqrt(1/2); which one is missing, and is positive, stands in the top bits of the first two numbers. One of a finger is
the same with 10 bits each, in 32 bits, the missing one on top. Rotations are relative to the parent joint, the hips' to the room.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.face.arkit import SHAPES
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS, finger_joints

FORMAT = 1
HEADER = struct.Struct("<BBHHHd")
FINGERS = np.array([JOINT_INDEX[j] for side in ("left", "right") for j in finger_joints(side)])
"""Joints whose rotations are sent with 10 bits: the bones beyond them are short."""
BODY = np.array([j for j in range(len(JOINTS)) if j not in FINGERS])
"""All others."""
SHIFTED = np.array(
    [JOINT_INDEX[f"spine_{k}"] for k in range(2, 9)]
    + [JOINT_INDEX[j] for j in ("neck", "left_shoulder", "right_shoulder", "left_upper_arm", "right_upper_arm")]
)
"""Joints that move against their parents: a spine is drawn out, a collar bone shortens."""
SHIFT_M = 1e-4
"""Step in which their places are sent [m]."""
PERSON = np.dtype(
    [
        ("who", "<u2"),
        ("talks", "u1"),
        ("spare", "u1"),
        ("hips", "<f4", 3),
        ("shifts", "<i2", (len(SHIFTED), 3)),
        ("body", "<u2", (len(BODY), 3)),
        ("fingers", "<u4", len(FINGERS)),
        ("face", "u1", len(SHAPES)),
    ]
)
"""hips: where they are in the room [m]; shifts: of `SHIFTED` in their parents' frames [SHIFT_M]; face: `SHAPES`, of 255."""
THING = np.dtype([("what", "<u2"), ("spare", "<u2"), ("position", "<f4", 3), ("rotation", "<i2", 4)])
"""position [m]; rotation: (x, y, z, w), of 32767."""
_OTHERS = np.array([[k for k in range(4) if k != missing] for missing in range(4)])
_ROOT_HALF = np.sqrt(0.5)


def header(table: int, people: int, things: int, t_ms: float) -> bytes:
    """The beginning of a frame."""
    return HEADER.pack(FORMAT, 0, table & 0xFFFF, people, things, t_ms)


def person_row(who: int, joints: JointPose, face: F64, *, talks: bool) -> NDArray[np.void]:
    """One `PERSON`. face: (len(SHAPES),) 0 to 1."""
    row = np.zeros((), PERSON)
    parents = PARENTS[1:]
    local = joints.rotation.copy()
    local[1:] = np.swapaxes(joints.rotation[parents], 1, 2) @ joints.rotation[1:]
    turned = quaternions(local)
    up = PARENTS[SHIFTED]
    away = joints.position[SHIFTED] - joints.position[up]
    shifts = np.einsum("jki,jk->ji", joints.rotation[up], away)
    row["who"], row["talks"], row["hips"] = who, talks, joints.position[0]
    row["shifts"] = np.clip(np.rint(shifts / SHIFT_M), -32767, 32767)
    row["body"] = _body(turned[BODY])
    row["fingers"] = _fingers(turned[FINGERS])
    row["face"] = np.rint(255.0 * face)
    return row


def thing_rows(poses: Iterable[tuple[int, F64, F64]]) -> NDArray[np.void]:
    """`THING` for numbers with positions (3,) [m] and rotations (4,)."""
    kept = [(what, 0, position, np.rint(32767.0 * rotation)) for what, position, rotation in poses]
    return np.array(kept, THING)


def quaternions(matrices: F64) -> F64:
    """(n, 4) unit quaternions (x, y, z, w) of rotation matrices (n, 3, 3)."""
    m = matrices
    x, y, z = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    squares = np.stack((1 + x - y - z, 1 - x + y - z, 1 - x - y + z, 1 + x + y + z), axis=1)
    largest = squares.argmax(axis=1)
    # Each row: four times the product of one component with all four (Shepperd 1978).
    a, b, c = m[:, 0, 1] + m[:, 1, 0], m[:, 0, 2] + m[:, 2, 0], m[:, 1, 2] + m[:, 2, 1]
    p, q, r = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    sx, sy, sz, sw = squares.T
    rows = np.stack([np.stack(row, axis=1) for row in ((sx, a, b, p), (a, sy, c, q), (b, c, sz, r), (p, q, r, sw))], axis=1)
    found = rows[np.arange(len(m)), largest]
    out: F64 = found / np.sqrt(np.einsum("ij,ij->i", found, found))[:, None]
    return out


def _smallest(q: F64, bits: int) -> tuple[NDArray[np.intp], NDArray[np.uint32]]:
    """Which component is the largest (n,), and the others (n, 3) as whole numbers of so many bits."""
    at = np.abs(q).argmax(axis=1)
    rows = np.arange(len(q))
    q = q * np.where(q[rows, at] < 0.0, -1.0, 1.0)[:, None]
    others = q[rows[:, None], _OTHERS[at]]
    most = (1 << bits) - 1
    return at, np.clip(np.rint((others / _ROOT_HALF + 1.0) * 0.5 * most), 0, most).astype(np.uint32)


def _body(q: F64) -> NDArray[np.uint16]:
    at, out = _smallest(q, 15)
    out[:, 0] |= ((at & 1) << 15).astype(np.uint32)
    out[:, 1] |= ((at >> 1) << 15).astype(np.uint32)
    return out.astype(np.uint16)


def _fingers(q: F64) -> NDArray[np.uint32]:
    at, out = _smallest(q, 10)
    packed = (at << 30) | (out[:, 0].astype(np.int64) << 20) | (out[:, 1].astype(np.int64) << 10) | out[:, 2]
    return packed.astype(np.uint32)


def joints_told() -> str:
    """JSON: how frames name joints and shapes of faces."""
    arrays = {"parents": PARENTS, "body": BODY, "fingers": FINGERS, "shifted": SHIFTED}
    told = {name: array.tolist() for name, array in arrays.items()} | {"shift_m": SHIFT_M}
    return json.dumps({"kind": "joints", "names": JOINTS, "face": SHAPES} | told)
