"""Which frame refers to which: what a lost frame costs, against what the stream costs.

A plan repeats. It lists how many frames back each frame refers; 0 is a full frame, which refers to none. The nearer the
reference, the fewer bytes; the shorter the chain back to a full frame, the less is lost with each frame. A receiver keeps
eight key frames, so no frame may refer past eight others.
"""

from __future__ import annotations

from typing import Literal, get_args

Losses = Literal["rare", "some", "many"]
"""How often single frames are expected to be lost."""

_GROUP = (1, 1, 1, 1, 1)
PLANS: dict[Losses, tuple[int, ...]] = {
    # Groups of six: each frame refers to the one before it, the first to the first of the group before. Fewest bytes.
    "rare": (0, *_GROUP, 6, *_GROUP, 6, *_GROUP, 6, *_GROUP),
    # A binary tree: a frame needs at most four others.
    "some": (0, 1, 2, 1, 4, 1, 2, 1, 8, 1, 2, 1, 4, 1, 2, 1),
    # Each refers to the last full frame: it needs one other.
    "many": (0, 1, 2, 3, 4),
}
LOSSES: tuple[Losses, ...] = get_args(Losses)


def key_frames(plan: tuple[int, ...]) -> frozenset[int]:
    """Places in a plan of the frames to which others refer."""
    return frozenset(i - back for i, back in enumerate(plan) if back)
