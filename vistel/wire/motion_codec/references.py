"""Which frame refers to which: what a lost frame costs, against what the stream costs.

A plan repeats. It says of each frame how many frames back it refers to; 0 is a full frame, which refers to none. The
nearer the reference the fewer bytes; the fewer frames it takes to get back to a full one, the less is lost with each.
A receiver holds eight key frames, so that none may refer past eight others.
"""

from __future__ import annotations

from typing import Literal, get_args

Losses = Literal["rare", "some", "many"]
"""How often single frames are expected to be lost on their way."""

_GROUP = (1, 1, 1, 1, 1)
PLANS: dict[Losses, tuple[int, ...]] = {
    # Groups of six, each frame to the one before it, the first to that of the group before: the cheapest.
    "rare": (0, *_GROUP, 6, *_GROUP, 6, *_GROUP, 6, *_GROUP),
    # A binary tree: at most four others.
    "some": (0, 1, 2, 1, 4, 1, 2, 1, 8, 1, 2, 1, 4, 1, 2, 1),
    # Only to the last full frame: one other.
    "many": (0, 1, 2, 3, 4),
}
LOSSES: tuple[Losses, ...] = get_args(Losses)


def kept(plan: tuple[int, ...]) -> frozenset[int]:
    """Which frames of a plan others refer to: its key frames."""
    return frozenset(i - back for i, back in enumerate(plan) if back)
