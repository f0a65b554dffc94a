"""Where on a head the rules of the face act: its eyes, the hinge of its jaw, and the places of the 13 marks."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar, Mesh, rigid
from vistel.figure.face.marks import MARK_INDEX, MARKS
from vistel.figure.face.targets import meant
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
JAW = "AU26"
"""The unit that opens the jaw."""
_MIDDLE_MM = {"upper_lip": (0.0, -71.0), "lower_lip": (0.0, -82.0), "chin": (0.0, -108.0)}


_LIPS = [MARK_INDEX["upper_lip"], MARK_INDEX["lower_lip"]]
_OF_MOUTH = [*_LIPS, MARK_INDEX["left_mouth_corner"], MARK_INDEX["right_mouth_corner"]]


@dataclass(frozen=True, eq=False)
class Landmarks:
    """marks: (13, 3), order of `MARKS`; eyes: (2, 3) centres of the eyeballs, left first; hinge: (3,) middle of the jaw's
    joints; between: (3,) where the lips meet in the middle. Metres, in the frame of the mesh, +X to the person's left, +Y up, +Z
    to the front. ball: radius of the eyeballs, 0 where that is not known."""

    marks: F64
    eyes: F64
    hinge: F64
    between: F64
    ball: float = 0.0

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
    """Of an avatar: where they are on the built-in heads, as far apart as its eyes are, on the front of its skin; the mouth
    where its own shape of the open jaw parts the lips. Raises ValueError for a head without a face there."""
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
    between, skin = _between_lips(avatar.mesh, middle, scale), avatar.mesh.vertices[~rigid(avatar)]
    if between is None:
        return Landmarks.of_marks(_on_the_front(skin, wanted, middle, scale), eyes)
    wanted[_OF_MOUTH, 1] += between[1] - wanted[_LIPS, 1].mean()
    marks = _on_the_front(skin, wanted, middle, scale)
    found = Landmarks.of_marks(marks, eyes, np.array((middle[0], between[1], marks[_LIPS, 2].mean())))
    ball = float(np.median(np.linalg.norm(avatar.eyeballs[0].vertices - eyes[0], axis=1))) if avatar.eyeballs else 0.0
    return replace(found, ball=ball)


def _between_lips(mesh: Mesh, middle: F64, scale: float) -> F64 | None:
    """(3,) where the lips meet in the middle, on a head with a shape for the open jaw: the lower lip moves with it, the upper one
    stays. None where there is none, or no place where both meet."""
    meanings = meant(t.name for t in mesh.targets)
    jaw = next((t for t in mesh.targets if (m := meanings.get(t.name)) and m.unit == JAW), None)
    if jaw is None:
        return None
    v = mesh.vertices.astype(np.float64)
    down = np.zeros(len(v))
    down[jaw.vertex] = -jaw.offset[:, 1]
    q = (v - middle) / scale
    own = np.flatnonzero((np.abs(q[:, 0]) < 0.005) & (q[:, 1] < -0.048) & (q[:, 1] > -0.100) & (q[:, 2] > -0.02))
    # What lies behind other skin of that height is inside the mouth.
    near = np.abs(q[own, 1][:, None] - q[own, 1]) < 0.004
    own = own[q[own, 2] > np.where(near, q[own, 2], -np.inf).max(axis=1) - 0.007] if len(own) else own
    most = float(down[own].max(initial=0.0))
    upper, lower = own[down[own] < 0.3 * most], own[down[own] > 0.6 * most]
    if most < 0.004 * scale or not len(upper) or not len(lower):
        return None
    return 0.5 * (v[upper[np.argmin(v[upper, 1])]] + v[lower[np.argmax(v[lower, 1])]])


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
