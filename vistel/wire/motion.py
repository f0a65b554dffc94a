"""The Motion message: a participant's posture in some forty bytes, sixty times a second.

Every number is rounded to a whole number of steps (`MOTION_FIELDS`), foreseen from a frame that was sent shortly before,
and what is left is entropy coded. Which frame that is says a plan (`PLANS`): with `losses="many"` every frame decodes
from the last full frame, with "rare" it takes those between, for fewer bytes. At least every 0.4 s a full frame refers to
nothing: a late joiner, and whoever lost a frame that others refer to, goes on there. docs/reference/motion-stream.md has
the layout of the bytes.
"""

from __future__ import annotations

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


def warm_up() -> None:
    """Have the codec compiled, so that the first frame is as quick as the others."""
    encoder, decoder = MotionEncoder(), MotionDecoder()
    for seq in (1, 2):
        decoder.decode(encoder.encode(MotionSample(seq, 0, np.zeros(25), np.zeros((2, 20)), np.zeros(4))))
