"""The recorded joints of a person, from any file.

Frames: metres, right-handed, Y up; rotations take the person's T-pose (facing +Z, left arm along +X) to the recorded
pose, so that they mean the same as the figure's own joint rotations.
"""

import math
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.calibration.pivots import fit_neck
from vistel.figure.posture.posture import collar_scale
from vistel.figure.skeleton import JOINT_INDEX, SPINE_SEGMENTS, Skeleton, measured_skeleton, standard_skeleton

SIDES = ("left", "right")
RECORDED = (
    "hips",
    "chest",
    "neck",
    "head",
    *(f"{side}_{part}" for side in SIDES for part in ("shoulder", "upper_arm", "lower_arm", "hand")),
)
"""Joints of a recording; "chest" carries the rotation of the rib cage, its position is midway between the collars."""
INDEX = {name: i for i, name in enumerate(RECORDED)}

NECK_ABOVE_SPINE = 0.03
"""How far the standard figure's neck joint is above the end of its spine [m]."""


@dataclass(frozen=True)
class Recording:
    """position (n, 12, 3) [m], rotation (n, 12, 3, 3): joints of RECORDED; rate_hz: frames per second."""

    name: str
    rate_hz: float
    position: F64
    rotation: F64

    @property
    def duration_s(self) -> float:
        return (len(self.position) - 1) / self.rate_hz

    def joint(self, name: str) -> tuple[F64, F64]:
        """Positions (n, 3) and rotations (n, 3, 3) of a joint."""
        return self.position[:, INDEX[name]], self.rotation[:, INDEX[name]]

    def offset(self, parent: str, child: str) -> F64:
        """(3,) median position of `child` in the frame of `parent` [m]."""
        p, r = self.joint(parent)
        return np.median(np.einsum("nji,nj->ni", r, self.joint(child)[0] - p), axis=0)

    def _neck(self) -> tuple[F64, F64]:
        """(3,) neck joint in the chest's frame, and (3,) from there to the head [m]."""
        p, chest = self.joint("chest")
        seen = np.einsum("nji,nj->ni", chest, self.joint("head")[0] - p)
        turned = np.einsum("nji,njk->nik", chest, self.joint("head")[1])
        neck = self.offset("chest", "neck")
        a, b = fit_neck(turned, seen, neck, np.median(seen, axis=0) - neck).vectors
        return a, b

    def _collars(self, shortening: float) -> tuple[dict[str, F64], float]:
        """(3,) from each collar joint to its shoulder in the T-pose, for a bone that loses `shortening` with the arm
        overhead; and how far shoulders are off it [m], root mean square."""
        _, chest = self.joint("chest")
        bones: dict[str, F64] = {}
        squares = 0.0
        for side, sign in (("left", 1.0), ("right", -1.0)):
            _, arm = self.joint(f"{side}_upper_arm")
            d = self.joint(f"{side}_upper_arm")[0] - self.joint(f"{side}_shoulder")[0]
            local = np.einsum("nji,nj->ni", chest, d)
            shoulder = np.einsum("nji,njk->nik", chest, arm)
            scale = np.array([collar_scale(np.ascontiguousarray(m), sign, shortening) for m in shoulder])
            bones[side] = np.median(local / scale[:, None], axis=0)
            squares += float(((scale[:, None] * bones[side] - local) ** 2).sum(axis=1).mean())
        return bones, math.sqrt(squares / 2.0)

    def measured(self) -> Skeleton:
        """The skeleton of the person recorded: their own spine, shoulders and arms; legs after their hips' height."""
        hips_height = float(np.percentile(self.joint("hips")[0][:, 1], 90))
        standard = standard_skeleton(min(2.6, max(0.5, 1.75 * hips_height / 0.94)))
        scale = standard.height / 1.75
        chest_to_neck = self.offset("chest", "neck")
        spine = float(np.median(np.linalg.norm(self.joint("chest")[0] - self.joint("hips")[0], axis=1)))
        spine += max(0.0, float(chest_to_neck[1])) - NECK_ABOVE_SPINE * scale
        first = standard.offsets[JOINT_INDEX["spine_1"]]
        top = np.array([0.0, spine, 0.0])
        # From the end of the spine; the neck stands straight above it.
        collars = top + np.array([0.0, NECK_ABOVE_SPINE * scale, 0.0]) - chest_to_neck
        spine_8 = np.array([0.0, spine * (SPINE_SEGMENTS - 1) / SPINE_SEGMENTS, 0.0])
        offsets = {f"spine_{k}": np.array([0.0, spine / SPINE_SEGMENTS, 0.0]) for k in range(2, SPINE_SEGMENTS + 1)}
        offsets |= {"spine_1": first, "hips": np.array([0.0, hips_height, 0.0])}
        neck, offsets["head"] = self._neck()
        offsets["neck"] = collars + neck - spine_8
        shortening = min((0.0, 0.06, 0.12, 0.18, 0.24), key=lambda share: self._collars(share)[1])
        bones, _ = self._collars(shortening)
        for side in SIDES:
            offsets[f"{side}_shoulder"] = collars + self.offset("chest", f"{side}_shoulder") - spine_8
            sign = 1.0 if side == "left" else -1.0
            offsets[f"{side}_upper_arm"] = bones[side]
            for parent, child in (("upper_arm", "lower_arm"), ("lower_arm", "hand")):
                p, q = self.joint(f"{side}_{parent}")[0], self.joint(f"{side}_{child}")[0]
                # Nearly the longest seen, so that the hand stays in reach.
                length = float(np.percentile(np.linalg.norm(q - p, axis=1), 95))
                offsets[f"{side}_{child}"] = np.array([sign * length, 0.0, 0.0])
        return measured_skeleton(standard, offsets, shortening)


def beginning(recording: Recording, seconds: float) -> Recording:
    """Its first `seconds`, two frames at least."""
    n = max(2, int(seconds * recording.rate_hz))
    return Recording(recording.name, recording.rate_hz, recording.position[:n], recording.rotation[:n])


def resampled(recording: Recording, rate_hz: float) -> Recording:
    """The nearest recorded frames at another rate."""
    n = max(2, int(recording.duration_s * rate_hz) + 1)
    at = np.minimum(len(recording.position) - 1, np.round(np.arange(n) / rate_hz * recording.rate_hz)).astype(int)
    return Recording(recording.name, rate_hz, recording.position[at], recording.rotation[at])
