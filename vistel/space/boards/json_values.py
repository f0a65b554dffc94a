"""Strokes as JSON values."""

from base64 import b64decode, b64encode
from typing import Any

from vistel.space.boards.stroke import Stroke, unpacked


def from_stroke(s: Stroke) -> list[Any]:
    """A stroke as JSON values."""
    return [s.number, s.board, s.by, s.id, s.colour, s.width, b64encode(s.ink).decode()]


def to_stroke(d: Any) -> Stroke:
    """The stroke. Raises ValueError or TypeError for what is none."""
    number, board, by, name, colour, width, ink = d
    made = b64decode(ink, validate=True)
    unpacked(made)
    return Stroke(int(number), str(board), str(by), str(name), int(colour), int(width), made)
