"""How much a folded elbow or knee must bulge for the limbs beside it to keep their volume."""

from collections.abc import Callable

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.limb_segments import SEGMENTS, Cut, LimbSegment, limb_segment
from vistel.figure.posture.posture import ANKLE, DOF_COUNT, ELBOW, KNEE, Posture
from vistel.figure.rigid.bulge import BENDS, HINGES
from vistel.figure.skeleton import Skeleton

MOST = 0.28
"""A limb is at most so much thicker for being folded (share of its radius)."""
_ROUNDS = 4
_SEGMENT = {"upper_arm": "upper arm", "lower_arm": "forearm", "upper_leg": "thigh", "lower_leg": "shank"}


def fit_bulges(skeleton: Skeleton, rest: F32, triangles: I32, table: F64, pose: Callable[[Posture], F32]) -> None:
    """Fill the table (H, K, 2) of `RigidSkin.bulges` in place.

    pose: the skin (V, 3) in a posture with the table as it is then. A limb whose skin cannot be cut keeps zeros.
    """
    pieces: dict[tuple[int, int], LimbSegment] = {}
    for h, hinge in enumerate(HINGES):
        for k in (0, 1):
            piece = _piece(skeleton, rest, triangles, hinge[k])
            if piece is not None:
                pieces[h, k] = piece
    volume = {at: piece.volume(rest) for at, piece in pieces.items()}
    for k in range(1, len(BENDS)):
        table[:, k] = table[:, k - 1]
        posture = _folded(float(BENDS[k]))
        before: dict[tuple[int, int], tuple[float, float]] = {}
        for _ in range(_ROUNDS):
            skin = pose(posture)
            for at, piece in pieces.items():
                lost = 1.0 - piece.volume(skin) / volume[at]
                now = float(table[at[0], k, at[1]])
                # Volume grows by about as much as the girth's square over the belly, half of the segment.
                gain = 0.7
                if at in before and abs(now - before[at][0]) > 1e-4:
                    gain = min(2.0, max(0.3, (before[at][1] - lost) / (now - before[at][0])))
                before[at] = now, lost
                table[at[0], k, at[1]] = min(MOST, max(-0.1, now + lost / gain))


def _piece(skeleton: Skeleton, rest: F32, triangles: I32, joint: str) -> LimbSegment | None:
    side, _, limb = joint.partition("_")
    cuts: tuple[Cut, Cut] = SEGMENTS[_SEGMENT[limb]]
    try:
        piece = limb_segment(skeleton, rest, triangles, side, cuts)
    except ValueError:
        return None
    return piece if piece.volume(rest) > 1e-6 else None


def _folded(bend: float) -> Posture:
    """Arms sideways, half sitting: little but the folded limbs touches, hips and ankles bend as little as they can."""
    dofs = np.zeros(DOF_COUNT)
    dofs[ELBOW["left"]] = dofs[ELBOW["right"]] = dofs[KNEE] = bend
    dofs[ANKLE] = 0.3 * bend
    return Posture(dofs)
