"""Interest: which details each participant gets. `world_state` leaves some things to prediction. Of these, each participant
receives the poses that would look most wrong from where their eyes are. So everyone receives a bounded number of things, however
many move and however many people receive them.
"""

from collections.abc import Mapping

import numpy as np

from vistel.arrays import F64, I64
from vistel.space.eyes import Eyes
from vistel.v1.world_pb2 import WorldDetail
from vistel.wire.world.codec.detail import HOLD_STEPS, coded, write_detail
from vistel.wire.world.codec.frame import Book
from vistel.wire.world.codec.poses import POSITION_STEP, GridPose

MOST_DETAILED = 16
"""Things in one detail message, at most."""
DETAIL_BITS = 900
"""Size of one detail message."""
TURNS = 2
"""Everybody gets a detail with every second message. A corrected thing goes on as predicted, from the right place."""
SEEN = 2.0
"""Half millimetres at a metre: smaller errors are not visible."""
NEAREST = 0.25
"""Distances to the eyes are taken to be at least this [m]."""
ASIDE = 0.25
"""Factor of a thing to the side: people turn their heads."""
WIDE = 0.5
"""Cosine of the angle from the direction of the head beyond which a thing is to the side."""


class InterestFilter:
    """Details for everybody in one room."""

    def __init__(self) -> None:
        self._known: dict[str, I64] = {}  # (N, 7) corrections that a participant received and that still hold
        self._epoch = 0

    def encode(
        self, book: Book, poses: Mapping[int, GridPose], steps: int, eyes: Mapping[str, Eyes], t_ns: int
    ) -> dict[str, WorldDetail]:
        """What goes with a frame that has just been written, by participant. poses: of the newest of its `steps` steps, by
        number; eyes: of whoever is in the room."""
        count, epoch = len(book.tracks), book.step // HOLD_STEPS
        if not book.crowded or epoch != self._epoch:
            self._known.clear()
        self._epoch = epoch
        if not book.crowded:
            return {}
        tracks = [book.tracks[n] for n in book.moving]
        rows = np.array(book.moving)
        wanted = np.array([t.correction(poses.get(n, t.pose)) for n, t in zip(book.moving, tracks, strict=True)], np.int64)
        place = np.array([t.pose[:3] for t in tracks], np.float64) * POSITION_STEP
        forgotten = np.ones(count, bool)
        forgotten[rows] = [t.untold < steps for t in tracks]
        self._known = {name: self._known.get(name, np.zeros((count, 7), np.int64)) for name in eyes}
        out: dict[str, WorldDetail] = {}
        bits: dict[int, str] = {}
        for turn, (name, known) in enumerate(self._known.items()):
            known[forgotten] = 0
            if (book.step // 2 + turn) % TURNS:
                continue
            chosen = _most_seen(wanted - known[rows], place, eyes[name])
            if not len(chosen):
                continue
            corrections: dict[int, str] = {}
            left = DETAIL_BITS
            for i in chosen.tolist():
                if i not in bits:
                    bits[i] = coded(tuple(wanted[i].tolist()))
                corrections[book.moving[i]] = bits[i]
                known[rows[i]] = wanted[i]
                left -= len(bits[i])
                if left <= 0:
                    break
            out[name] = message = WorldDetail(step=book.step, frame=write_detail(corrections))
            message.header.t_ns = t_ns
        return out


def _most_seen(wrong: I64, place: F64, eye: Eyes) -> I64:
    """Rows of what looks most wrong, the worst first. wrong: (M, 7) in steps of a pose; place: (M, 3) [m]."""
    size = np.abs(wrong)
    amount = size[:, :3].sum(1) + size[:, 3:].sum(1) / 4.0
    way = place - eye.position
    far = np.maximum(np.sqrt((way * way).sum(1)), NEAREST)
    looks = amount / far
    looks[way @ eye.facing < WIDE * far] *= ASIDE
    order = np.argsort(-looks, kind="stable")[:MOST_DETAILED]
    return order[looks[order] >= SEEN]
