"""What somebody hears of the room beyond `world_state`: where things are exactly that it leaves to foresight."""

from collections.abc import Mapping, Sequence
from operator import add

from vistel.arrays import F64
from vistel.v1.world_pb2 import WorldDetail
from vistel.wire.world.codec.bits import FrameError
from vistel.wire.world.codec.detail import HOLD_STEPS, read_detail
from vistel.wire.world.codec.frame import Book
from vistel.wire.world.codec.poses import GridPose, place

AHEAD = 16
"""Details kept whose frames have not come yet."""


class Details:
    """Corrections by step and thing. What has been corrected stays so until a frame tells of the thing."""

    def __init__(self) -> None:
        self.broken = 0
        """How many could not be read."""
        self._coming: dict[int, dict[int, GridPose]] = {}
        self._held: dict[int, GridPose] = {}
        self._epoch = 0

    def receive(self, message: WorldDetail) -> None:
        """One detail; several of a step count together."""
        try:
            corrections = read_detail(message.frame)
        except FrameError:
            self.broken += 1
            return
        self._coming.setdefault(message.step, {}).update(corrections)
        while len(self._coming) > AHEAD:
            del self._coming[min(self._coming)]

    def forget(self) -> None:
        """Things have new numbers."""
        self._coming.clear()
        self._held.clear()

    def poses(self, book: Book, order: Sequence[str], steps: int) -> Mapping[str, tuple[F64, F64]]:
        """Position (3,) [m] and quaternion (4,) of what is known better than `book` has it after a frame of `steps` steps, by
        id; order: ids by number."""
        if not (self._coming or self._held):
            return {}
        epoch = book.step // HOLD_STEPS
        fresh = self._coming.pop(book.step, {})
        self._coming = {step: c for step, c in self._coming.items() if step > book.step}
        moving = frozenset(book.moving)
        holds = book.crowded and epoch == self._epoch
        held = {n: c for n, c in self._held.items() if book.tracks[n].untold >= steps} if holds else {}
        self._held = {n: c for n, c in (held | fresh).items() if n in moving}
        self._epoch = epoch
        out: dict[str, tuple[F64, F64]] = {}
        for n, correction in self._held.items():
            out[order[n]] = place(tuple(map(add, book.tracks[n].pose, correction)))
        return out
