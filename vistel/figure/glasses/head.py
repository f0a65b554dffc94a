"""A head as an optician measures it: eyes, the bridge of the nose, the ears, and how far its skin goes to the front and aside."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import KDTree  # pyright: ignore[reportMissingTypeStubs]

from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.face.landmarks import EYES_APART
from vistel.figure.skeleton import JOINT_INDEX

_STICKS_OUT = 0.004
"""So far beside the skull above them ears are found [m, a standard head]."""
_NO_EAR = 0.004, -0.086
"""Where the top of an ear is that lies flat: above the eyes, and before them [m, a standard head]."""
_SIDES = 4
"""Places of a triangle's edge whose skin is known."""


@dataclass(frozen=True)
class Ear:
    """Heights above the eyes and places before them [m]: of its top (y, z), and the rearmost z of its upper half."""

    top: tuple[float, float]
    back: float


@dataclass(frozen=True, eq=False)
class Head:
    """middle: (3,) between the eyes; half: half their distance [m]; scale: to a standard head; skin: (N, 3) places all over the
    skin, from the middle."""

    middle: F64
    half: float
    scale: float
    skin: F64

    @staticmethod
    def of(body: Avatar) -> "Head":
        """Of a body of the body model in the T-pose, naked and bald."""
        eyes = body.skeleton.rest[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]]
        middle, apart = eyes.mean(axis=0), float(np.linalg.norm(eyes[0] - eyes[1]))
        scale = apart / EYES_APART
        p = body.mesh.vertices.astype(np.float64) - middle
        near = (np.abs(p) < np.array((0.13, 0.08, 0.20)) * scale).all(axis=1)
        corner = p[body.mesh.triangles[near[body.mesh.triangles].all(axis=1)]]
        share = np.array([(a, b, _SIDES - a - b) for a in range(_SIDES + 1) for b in range(_SIDES + 1 - a)]) / _SIDES
        return Head(middle, 0.5 * apart, scale, np.einsum("kc,fcx->fkx", share, corner).reshape(-1, 3))

    @cached_property
    def ears(self) -> tuple[Ear, Ear]:
        """Left and right."""
        q, scale = self.skin / self.scale, self.scale

        def ear(sign: float) -> Ear:
            p = q * (sign, 1.0, 1.0)
            beside = p[(p[:, 2] < -0.05) & (p[:, 2] > -0.15)]
            skull = float(beside[(beside[:, 1] > 0.025) & (beside[:, 1] < 0.045), 0].max())
            mine = beside[(beside[:, 0] > skull + _STICKS_OUT) & (beside[:, 1] > -0.045) & (beside[:, 1] < 0.025)]
            if len(mine) < 12:
                (y, z), back = _NO_EAR, _NO_EAR[1] - 0.02
            else:
                y, z = mine[mine[:, 1].argmax(), 1:].tolist()
                back = float(mine[mine[:, 1] > y - 0.03, 2].min())
            return Ear((y * scale, z * scale), back * scale)

        return ear(1.0), ear(-1.0)

    def aside(self, at: F64, sign: float, round_m: float) -> F64:
        """(N,) how far to one side (1 left, -1 right) the skin goes within `round_m` of heights and places to the front (N, 2)
        [m]."""
        mine = self.skin[sign * self.skin[:, 0] > 0.0]
        tree: Any = KDTree(mine[:, 1:])
        return np.array([(sign * mine[near, 0]).max(initial=0.0) for near in tree.query_ball_point(at, round_m)])
