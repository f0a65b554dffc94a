"""Strokes on boards as messages, and back."""

from functools import lru_cache

from vistel.space.boards.stroke import Stroke, unpacked
from vistel.space.ink import MOST_STROKES
from vistel.v1 import world_pb2


@lru_cache(2 * MOST_STROKES)
def stroke_message(s: Stroke) -> world_pb2.Stroke:
    """A stroke as the world tells it; what has been made is used again."""
    return world_pb2.Stroke(number=s.number, board=s.board, by=s.by, id=s.id, colour=s.colour, width=s.width, ink=s.ink)


def stroke_of(message: world_pb2.Stroke) -> Stroke:
    """A stroke that was told. Raises ValueError for ink that is none."""
    m = message
    return _made(m.number, m.board, m.by, m.id, m.colour, m.width, m.ink)


@lru_cache(2 * MOST_STROKES)
def _made(number: int, board: str, by: str, id: str, colour: int, width: int, ink: bytes) -> Stroke:
    unpacked(ink)
    return Stroke(number, board, by, id, colour, width, ink)
