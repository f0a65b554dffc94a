"""The panels that garments are cut from, and the seams between them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, I32
from vistel.figure.clothes.build import Build
from vistel.figure.clothes.cut import Field
from vistel.figure.clothes.tube import Tube
from vistel.geometry.smoothstep import smoothstep

PANELS = ("front", "back", "left_sleeve", "left_sleeve_back", "right_sleeve", "right_sleeve_back",
          "left_leg", "left_leg_back", "right_leg", "right_leg_back")  # fmt: skip
"""Two of each tube: that which is centred on its front, and that on its back."""


@dataclass(frozen=True, eq=False)
class Panels:
    """seams: fields that are zero along seams. tubes: of the trunk, the arms and the legs. legs: whether it has legs, and no trunk.
    armhole: how far from the middle sleeves begin [m]."""

    build: Build
    legs: bool
    armhole: float

    @property
    def seams(self) -> Sequence[Field]:
        """Between tubes, then between front and back."""
        if self.legs:
            return (lambda p: p[:, 0], self._front)
        return (lambda p: np.abs(p[:, 0]) - self.armhole, self._front)

    @property
    def tubes(self) -> tuple[Tube, ...]:
        """As `PANELS` are counted."""
        return (self.build.trunk, *self.build.arms, *self.build.legs)

    def tube_at(self, p: F64) -> I32:
        """(N,) tube that places (N, 3) belong to."""
        if self.legs:
            return np.where(p[:, 0] > 0.0, 3, 4).astype(np.int32)
        return np.where(p[:, 0] > self.armhole, 1, np.where(p[:, 0] < -self.armhole, 2, 0)).astype(np.int32)

    def cut(self, skin: F64, seen: Sequence[F64], triangles: I32) -> tuple[I32, F64]:
        """(F,) panel of each triangle, and (F, 3, 2) where its corners lie on it [m]. skin: (V, 3) where the cloth was cut;
        seen: (V, 3) of each tube, the last of all others, as it is unrolled."""
        centre = skin[triangles].mean(axis=1)
        panel = (2 * self.tube_at(centre) + (self._front(centre) < 0.0)).astype(np.int32)
        flat = np.zeros((len(triangles), 3, 2))
        for k in range(len(PANELS)):
            mine = np.flatnonzero(panel == k)
            if not len(mine):
                continue
            corner = seen[min(k // 2, len(seen) - 1)][triangles]
            p = corner[mine].reshape(-1, 3)
            at = self.tubes[k // 2].unrolled(p, np.pi * (k % 2))
            flat[mine] = (self._upright(p, at, k) if k < 2 else at).reshape(-1, 3, 2)
        return panel, flat

    def _upright(self, p: F64, at: F64, panel: int) -> F64:
        """Places on the front or the back, whose threads go up over the shoulders and do not draw together at the neck."""
        tube, scale = self.build.trunk, self.build.scale
        high = smoothstep(self.build.armpit - 0.12 * scale, self.build.armpit + 0.02 * scale, p[:, 1])
        across = tube.around * np.arcsin(np.clip(p[:, 0] / (1.25 * self.armhole), -1.0, 1.0)) * (1.0 - 2.0 * panel)
        return np.column_stack([at[:, 0] + high * (across - at[:, 0]), at[:, 1]])

    def _front(self, p: F64) -> F64:
        """(N,) how far places lie to the front of the side seams [m]."""
        out, of = np.zeros(len(p)), self.tube_at(p)
        for k, tube in enumerate(self.tubes):
            mine = of == k
            s = (p[mine] - tube.origin) @ tube.along
            out[mine] = (p[mine] - tube.origin) @ tube.front - np.interp(s, tube.s, tube.middle[:, 0])
        return out


def of_top(build: Build) -> Panels:
    """Trunk and sleeves."""
    return Panels(build, False, float(build.joint("left_upper_arm")[0]))


def of_legs(build: Build) -> Panels:
    """Two legs, up to the waist."""
    return Panels(build, True, 9.0)
