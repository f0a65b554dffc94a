"""The Motion message: a participant's posture in some forty bytes, sixty times a second.

Every number is rounded to whole steps (`MOTION_FIELDS`) and predicted from a recent frame; the residual is entropy coded.
A plan (`PLANS`) fixes which frame refers to which: with `losses="many"` every frame decodes from the last full frame alone;
with "rare" it needs those between, for fewer bytes. A full frame comes at least every 0.4 s: late joiners begin there, as
does whoever lost a frame that others refer to. docs/reference/motion-stream.md describes the bytes.
"""

from functools import cache

import numpy as np

from vistel.wire.motion_codec.decoder import ListFrame, MotionDecoder, MotionFrame
from vistel.wire.motion_codec.encoder import FULL_INTERVAL_NS, MotionEncoder
from vistel.wire.motion_codec.layout import COUNTS, MOTION_FIELDS, PARTS, MotionField
from vistel.wire.motion_codec.references import LOSSES, PLANS, Losses
from vistel.wire.motion_codec.sample import MotionSample, StalePart

__all__ = (
    "COUNTS",
    "FULL_INTERVAL_NS",
    "LOSSES",
    "MOTION_FIELDS",
    "PARTS",
    "PLANS",
    "ListFrame",
    "Losses",
    "MotionDecoder",
    "MotionEncoder",
    "MotionField",
    "MotionFrame",
    "MotionSample",
    "StalePart",
    "warm_up",
)


@cache
def warm_up() -> None:
    """Compile the codec, so that the first frame is as quick as the others."""
    encoder, decoder = MotionEncoder(), MotionDecoder()
    for seq in (1, 2):
        decoder.decode(encoder.encode(MotionSample(seq, 0, np.zeros(25), np.zeros((2, 20)), np.zeros(4))))
