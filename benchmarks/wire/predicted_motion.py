"""How far a predicted motion is off, beside the newest posture held as it is: on recordings that nothing was tuned on."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.row import Row, ratio_at_most
from benchmarks.wire.motion_streams import RATE_HZ, posture_of
from vistel.arrays import F64
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.render.stage.prediction import SPAN_NS, predicted

AHEAD_MS = (30, 60, 100)
MEASURED = [JOINT_INDEX[name] for name in ("left_hand", "right_hand", "head")]
STEP = 3
"""Every third frame is predicted from."""
NO_WORSE = ratio_at_most(1.0)


def rows(streams: Sequence[tuple[str, F64]]) -> Iterator[Row]:
    """For each stream (n, NUMBERS), by its name: hands and head, and fingers, so long ahead."""
    for name, stream in streams:
        for ahead_ms in AHEAD_MS:
            errors = _errors(stream, ahead_ms / 1e3)
            for what, unit, ours, held in (("hands and head", "mm", *errors[0]), ("fingers", "degrees", *errors[1])):
                metric = f"{what}, {ahead_ms} ms ahead, rms"
                yield Row("motion", f"prediction: {name}", metric, unit, ours, "held", held, target=NO_WORSE)


def _errors(stream: F64, ahead_s: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Of what is predicted and of what is held: places [mm], angles of fingers [degrees]; rms."""
    skeleton, span = standard_skeleton(), math.ceil(SPAN_NS * 1e-9 * RATE_HZ)
    ahead = ahead_s * RATE_HZ
    places: list[F64] = []
    angles: list[F64] = []

    def at(p: Posture) -> F64:
        return pose_joints(skeleton, p).position[MEASURED]

    for k in range(span, len(stream) - math.ceil(ahead), STEP):
        now = posture_of(stream[k])
        ours = predicted(posture_of(stream[k - span]), now, span / RATE_HZ, ahead_s)
        low = k + math.floor(ahead)
        u = k + ahead - low
        places.append(_off([at(ours), at(now)], (1 - u) * at(posture_of(stream[low])) + u * at(posture_of(stream[low + (u > 0)]))))
        fingers = (1 - u) * posture_of(stream[low]).hands + u * posture_of(stream[low + (u > 0)]).hands
        angles.append(_off([ours.hands, now.hands], fingers))
    mm, degrees = (np.sqrt(np.mean(np.array(x), 0)) for x in (places, angles))
    return (1e3 * float(mm[0]), 1e3 * float(mm[1])), (math.degrees(degrees[0]), math.degrees(degrees[1]))


def _off(found: list[F64], true: F64) -> F64:
    """(2,) mean squared lengths of what two are off."""
    return np.array([np.mean(np.sum((f - true) ** 2, -1)) if true.shape[-1] == 3 else np.mean((f - true) ** 2) for f in found])
