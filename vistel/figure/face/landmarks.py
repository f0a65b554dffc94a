"""Where on a head the rules of the face act: its eyes, the hinge of its jaw, and the places of the 13 marks."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.face.marks import MARK_INDEX, MARKS
from vistel.figure.skeleton import JOINT_INDEX

EYES_APART = 0.064
"""Distance of the eyes of the standard head, to whose size the rules refer [m]."""
HINGE = np.array((0.0, -0.025, -0.065))
"""Middle of the jaw's joints, from the middle between the eyes."""
EYEBALL = 0.0128

# From the middle between the eyes of a built-in head, millimetres to the left and up.
_LEFT_MM = {
    "inner_brow": (14.0, 17.0),
    "outer_brow": (44.0, 15.0),
    "cheek": (40.0, -35.0),
    "nose_wing": (16.5, -44.0),
    "mouth_corner": (24.5, -75.5),
}
_MIDDLE_MM = {"upper_lip": (0.0, -71.0), "lower_lip": (0.0, -82.0), "chin": (0.0, -108.0)}


@dataclass(frozen=True, eq=False)
class Landmarks:
    """marks: (13, 3), order of `MARKS`; eyes: (2, 3) centres of the eyeballs, left first; hinge: (3,) middle of the jaw's
    joints; between: (3,) where the lips meet in the middle. Metres, in the frame of the mesh, +X to the person's left, +Y up, +Z
    to the front."""

    marks: F64
    eyes: F64
    hinge: F64
    between: F64

    @property
    def scale(self) -> float:
        """This head's size relative to the standard head."""
        return float(np.linalg.norm(self.eyes[0] - self.eyes[1])) / EYES_APART

    @property
    def middle(self) -> F64:
        """(3,) between the eyes."""
        return self.eyes.mean(axis=0)

    @staticmethod
    def of_marks(marks: F64, eyes: F64, between: F64 | None = None) -> "Landmarks":
        """From known places; the hinge is where it is on the standard head, and the lips meet midway between their marks unless
        given."""
        apart = float(np.linalg.norm(eyes[0] - eyes[1])) / EYES_APART
        m = np.asarray(marks, np.float64)
        lips = 0.5 * (m[MARK_INDEX["upper_lip"]] + m[MARK_INDEX["lower_lip"]])
        hinge = eyes.mean(axis=0) + apart * HINGE
        return Landmarks(m, np.asarray(eyes, np.float64), hinge, lips if between is None else between)


def landmarks_of(avatar: Avatar) -> Landmarks:
    """Of an avatar: where they are on the built-in heads, as far apart as its eyes are, on the front of its skin. Raises
    ValueError for a head without a face there."""
    rest = avatar.skeleton.rest
    eyes = np.array([rest[JOINT_INDEX["left_eye"]], rest[JOINT_INDEX["right_eye"]]], np.float64)
    scale, middle = float(np.linalg.norm(eyes[0] - eyes[1])) / EYES_APART, eyes.mean(axis=0)
    if scale < 0.2:
        raise ValueError("the eyes are in one place")
    at = np.zeros((len(MARKS), 2))
    for name, (x, y) in _LEFT_MM.items():
        at[MARK_INDEX[f"left_{name}"]], at[MARK_INDEX[f"right_{name}"]] = (x, y), (-x, y)
    for name, place in _MIDDLE_MM.items():
        at[MARK_INDEX[name]] = place
    wanted = middle[:2] + 1e-3 * scale * at
    return Landmarks.of_marks(_on_the_front(avatar.mesh.vertices, wanted, middle, scale), eyes)


def _on_the_front(vertices: NDArray[np.float32], wanted: F64, middle: F64, scale: float) -> F64:
    """(N, 3) places of a skin at x and y (N, 2), as far to the front as it goes there."""
    v = vertices.astype(np.float64)
    v = v[(v[:, 2] > middle[2] - 0.06 * scale) & (np.abs(v[:, 1] - middle[1]) < 0.16 * scale)]
    out = np.empty((len(wanted), 3))
    for k, p in enumerate(wanted):
        away = np.hypot(v[:, 0] - p[0], v[:, 1] - p[1])
        near = np.flatnonzero(away < 0.009 * scale)
        if len(near) == 0:  # a coarse mesh
            near = np.flatnonzero(away < 0.020 * scale)
        if len(near) == 0:
            raise ValueError(f"there is no skin where {MARKS[k]} should be")
        foremost = near[v[near, 2] > v[near, 2].max() - 0.012 * scale]
        weight = 1.0 / (away[foremost] + 1e-4) ** 2
        out[k] = (*p, float((weight * v[foremost, 2]).sum() / weight.sum()))
    return out
