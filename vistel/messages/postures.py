"""Conversion between `Motion` messages and postures of figures. Neither depends on the other."""

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import Posture, Stance
from vistel.wire.motion import MotionSample, StalePart
from vistel.wire.motion_codec.sample import NOTHING_STALE

SIDES = ("left", "right")
LEGS = tuple(f"{side}_{part}" for side in SIDES for part in ("upper_leg", "lower_leg", "foot", "toes"))
COLLARS = tuple(f"{side}_shoulder" for side in SIDES)
JAW = ("jaw",)


def posture_of(sample: MotionSample) -> Posture:
    """The posture in a decoded motion."""
    joints: dict[str, F64] = {}
    for names, rotations in ((LEGS, sample.legs), (COLLARS, sample.collars), (JAW, sample.jaw)):
        if rotations is not None:
            joints |= dict(zip(names, np.reshape(rotations, (-1, 3)), strict=True))
    gaze = np.zeros(2) if sample.gaze is None else sample.gaze
    stance = Stance(sample.stance[:3], float(sample.stance[3]))
    # A face that is no longer measured is unknown: the last expression must not stay.
    face = None if sample.face is None or sample.stale & StalePart.FACE else np.reshape(sample.face, (-1, 2))
    lids = None if sample.stale & StalePart.GAZE else sample.lids
    return Posture(sample.body, sample.hands, stance, gaze, joints, face, lids)


def sample_of(
    posture: Posture, seq: int, t_ns: int, *, gaze: F64 | None, face: F64 | None, lids: F64 | None, stale: StalePart = NOTHING_STALE
) -> MotionSample:
    """The part of a posture that is encoded. gaze: (2,) [rad], face: (26,) marks [m, head frame], lids: (2,); None where not
    known."""
    return MotionSample(
        seq=seq,
        t_ns=t_ns,
        body=posture.dofs,
        hands=posture.hands,
        stance=np.array([*posture.stance.position, posture.stance.heading]),
        gaze=gaze,
        face=face,
        lids=lids,
        legs=rotations_of(posture, LEGS),
        collars=rotations_of(posture, COLLARS),
        jaw=rotations_of(posture, JAW),
        stale=stale,
    )


def rotations_of(posture: Posture, names: tuple[str, ...]) -> F64 | None:
    """(n, 3) rotation vectors of these joints for the wire; None where the posture does not give all of them."""
    found = [posture.joints.get(name) for name in names]
    given = [rotation for rotation in found if rotation is not None]
    return np.array(given) if len(given) == len(names) else None
