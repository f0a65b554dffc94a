"""A face's expression from points of its mesh, by rules: each measures a distance against the same face at rest."""

from collections.abc import Mapping

import numpy as np

from vistel.arrays import F64
from vistel.figure.face.landmarks import EYES_APART
from vistel.figure.face.marks import MOVES, REST

JAW_M = 0.034
"""How far the lips part with the jaw quite open [m]."""
CORNER_M = 0.012
"""How far a corner of the mouth goes in a broad smile [m]."""
PUCKER_M = 0.024
"""By how much a pursed mouth is narrower [m]."""
BROW_M = 0.009
"""How far a brow rises, or falls [m]."""
OPEN_LID = 0.92
"""Of the opening at rest: a lid that is as open is quite open, and noise does not make it tremble."""
SHUT_LID = 0.30
"""The same of a lid that is shut: landmarks of lids do not meet."""
EYEBALL_M = 0.012
"""Radius on which an iris goes [m]."""


class MeshFace:
    """From points of a face to marks, gaze and lids. Points are by name, (3,) in units of the rest's, head's frame: +X left, +Y up,
    +Z to the front."""

    def __init__(self, rest: Mapping[str, F64]) -> None:
        """rest: the face at rest, which looks ahead."""
        self._rest = rest
        apart = float(np.linalg.norm(rest["left_iris"] - rest["right_iris"]))
        self._metre = EYES_APART / max(1e-6, apart)

    def expression(self, points: Mapping[str, F64]) -> dict[str, float]:
        """ARKit's coefficients that can be told, 0 .. 1."""
        out: dict[str, float] = {}
        gap = self._moved(points, "upper_lip", 1) - self._moved(points, "lower_lip", 1)
        out["jawOpen"] = gap / JAW_M
        wide = self._moved(points, "left_mouth_corner", 0) - self._moved(points, "right_mouth_corner", 0)
        lift = 0.3 * max(0.0, gap)  # an open mouth draws its corners down
        for side, name, sign in (("Left", "left", 1.0), ("Right", "right", -1.0)):
            corner = f"{name}_mouth_corner"
            up = self._moved(points, corner, 1) + lift
            out[f"mouthSmile{side}"] = (0.75 * sign * self._moved(points, corner, 0) + 0.65 * up) / CORNER_M
            out[f"mouthFrown{side}"] = (-up - 0.5 * max(0.0, sign * self._moved(points, corner, 0))) / CORNER_M
            brow = self._moved(points, f"{name}_brow", 1) / BROW_M
            out[f"browOuterUp{side}"], out[f"browDown{side}"] = brow, -brow
        out["browInnerUp"] = min(out["browOuterUpLeft"], out["browOuterUpRight"])
        out["mouthPucker"] = -wide / PUCKER_M
        return {name: min(1.0, max(0.0, value)) for name, value in out.items()}

    def marks(self, points: Mapping[str, F64]) -> F64:
        """(13, 2) marks [m]."""
        return REST + sum((share * MOVES[name] for name, share in self.expression(points).items()), np.zeros_like(REST))

    def lids(self, points: Mapping[str, F64]) -> F64:
        """(2,) opening of the left and the right eye, 0 closed .. 1 as at rest."""
        found = [_opening(points, side) / max(1e-6, _opening(self._rest, side)) for side in ("left", "right")]
        return np.clip((np.array(found) - SHUT_LID) / (OPEN_LID - SHUT_LID), 0.0, 1.0)

    def gaze(self, points: Mapping[str, F64]) -> F64:
        """(2,) yaw (left positive) and pitch (up positive) of both eyes [rad]."""
        off = np.zeros(2)
        for side in ("left", "right"):
            moved = (_iris(points, side) - _iris(self._rest, side)) * self._metre
            off += 0.5 * moved[:2]
        return np.arcsin(np.clip(off / EYEBALL_M, -0.6, 0.6))

    def _moved(self, points: Mapping[str, F64], name: str, axis: int) -> float:
        return float(points[name][axis] - self._rest[name][axis]) * self._metre


def _opening(points: Mapping[str, F64], side: str) -> float:
    """How open an eye is, as a share of its width."""
    width = float(np.linalg.norm(points[f"{side}_outer_corner"] - points[f"{side}_inner_corner"]))
    return float(points[f"{side}_upper_lid"][1] - points[f"{side}_lower_lid"][1]) / max(1e-6, width)


def _iris(points: Mapping[str, F64], side: str) -> F64:
    """(3,) the iris from the middle of the eye's corners."""
    return points[f"{side}_iris"] - 0.5 * (points[f"{side}_outer_corner"] + points[f"{side}_inner_corner"])
