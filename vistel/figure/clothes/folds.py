"""Folds that hanging cloth has anyhow, as height over a panel: below the arms, at elbows, knees and hems."""

from dataclasses import dataclass

import numpy as np

from vistel.figure.clothes.build import Build
from vistel.figure.clothes.weave import Floats
from vistel.geometry.smoothstep import smooth

_DEEP = 0.0011
"""Height of a usual fold [m]."""


@dataclass(frozen=True, eq=False)
class Folds:
    """On a body. v of panels is the height over the top of the tube: of the trunk and the legs as they stand, of sleeves along the
    arm."""

    build: Build
    seed: int
    strength: float = 1.0

    def height(self, panel: str, u: Floats, v: Floats) -> Floats:
        """(H, W) at places of a panel [m]."""
        rng = np.random.default_rng((self.seed, 7, sum(panel.encode())))
        scale, build = self.build.scale, self.build
        if "sleeve" in panel:
            elbow = float(abs(build.joint("left_lower_arm")[0] - build.joint("left_upper_arm")[0]))
            bend = np.exp(-np.square((v + elbow) / (0.07 * scale)))
            cuff = smooth((-v - 1.45 * elbow) / (0.4 * elbow)) * 0.5
            out = (0.35 + bend) * _wrinkled(u, v, rng, (0.45, 1.0), 0.040 * scale)
            out = out + cuff * _wrinkled(u, v, rng, (0.1, 1.0), 0.028 * scale)
        elif "leg" in panel:
            hip, knee = build.joint("left_upper_leg")[1], build.joint("left_lower_leg")[1]
            low = hip - build.joint("left_foot")[1]
            bend = np.exp(-np.square((v + hip - knee) / (0.07 * scale)))
            crotch = np.exp(-np.square((v + 0.09 * scale) / (0.06 * scale)))
            hem = smooth((-v - low + 0.16 * scale) / (0.14 * scale))
            out = 0.25 * _wrinkled(u, v, rng, (1.0, 0.25), 0.085 * scale)
            out = out + 0.7 * bend * _wrinkled(u, v, rng, (0.25, 1.0), 0.040 * scale)
            out = out + 0.7 * crotch * _wrinkled(u, v, rng, (0.7, 0.8), 0.045 * scale)
            out = out + 1.1 * hem * _wrinkled(u, v, rng, (0.2, 1.0), 0.036 * scale)
        elif panel == "skirt":
            out = 0.9 * _wrinkled(u, v, rng, (1.0, 0.06), 0.075 * scale)
        elif panel in ("front", "back"):
            drop = smooth(-(v + 0.10 * scale) / (0.22 * scale))
            side = np.abs(u) / (2.0 * build.trunk.around)
            hang = _wrinkled(u, v, rng, (1.0, 0.28), 0.10 * scale)
            across = _wrinkled(u * np.sign(u), v, rng, (0.6, -1.0), 0.06 * scale)
            waist = np.exp(-np.square((v + build.trunk.origin[1] - build.waist - 0.03) / (0.08 * scale)))
            out = 0.55 * drop * hang + (0.25 + 0.5 * waist) * np.clip(side, 0.0, 1.0) * across
        else:
            return np.zeros_like(u)
        return self.strength * _DEEP * out


def _wrinkled(u: Floats, v: Floats, rng: np.random.Generator, across: tuple[float, float], width: float) -> Floats:
    """Folds of about a width [m], across a direction, that come and go, -1 to 1."""
    out, main = np.zeros_like(u), np.arctan2(across[1], across[0])
    for _ in range(4):
        turn, k = main + float(rng.normal(0.0, 0.30)), 2.0 * np.pi / (width * float(rng.uniform(0.7, 1.5)))
        bow, phase, start = (float(x) for x in rng.uniform((0.2, 0.0, 0.0), (0.7, 6.28, 6.28)))
        c, s = float(np.cos(turn)), float(np.sin(turn))
        along = c * v - s * u
        x = k * (c * u + s * v) + bow * np.cos(0.35 * k * along + start)
        envelope = 0.5 + 0.5 * np.cos(0.30 * k * along + phase) * np.cos(0.22 * x + start)
        out += np.square(envelope) * (2.0 * np.square(0.5 + 0.5 * np.cos(x + phase)) - 0.8)
    return 0.5 * out
