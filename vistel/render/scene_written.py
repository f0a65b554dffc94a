"""What is written on boards, in the picture."""

from collections.abc import Mapping

import numpy as np

from vistel.arrays import F32
from vistel.messages.boards import stroke_of
from vistel.render.painter import Painter
from vistel.render.room.room import linear
from vistel.space.boards.board import Face, face_of
from vistel.space.boards.ribbon import ribbon
from vistel.space.things.tessellate import Surface3, join
from vistel.space.things.things import Thing
from vistel.v1 import world_pb2

TOGETHER = 32
"""Strokes in one piece of the picture: only a piece in which one is new or gone is made anew."""


class Written:
    """Keeps the painter's strokes as the world's are. pieces: what is drawn where each board is, by its id."""

    def __init__(self, painter: Painter) -> None:
        self._painter = painter
        self._seen: Mapping[int, world_pb2.Stroke] = {}
        self._boards: dict[str, Thing] = {}
        self._made: dict[str, tuple[world_pb2.Stroke, ...]] = {}
        self.pieces: dict[str, list[str]] = {}

    def meet(self, things: Mapping[str, Thing], strokes: Mapping[int, world_pb2.Stroke]) -> None:
        """Make what is new of strokes. things: that are shown."""
        boards = {name: things[name] for name in {s.board for s in strokes.values()} if name in things}
        if strokes is self._seen and boards == self._boards:
            return
        changed = {name for name, board in boards.items() if self._boards.get(name) is not board}
        self._seen, self._boards = strokes, boards
        wanted: dict[str, list[world_pb2.Stroke]] = {}
        self.pieces = {}
        for number in sorted(strokes):
            s = strokes[number]
            if s.board in boards:
                wanted.setdefault(f"{s.board} ink {number // TOGETHER}", []).append(s)
        for piece in self._made.keys() - wanted.keys():
            self._painter.drop_thing(piece)
            del self._made[piece]
        for piece, some in wanted.items():
            board, face = some[0].board, face_of(boards[some[0].board])
            if face is None:
                continue  # it is bent
            if board in changed or self._made.get(piece) != tuple(some):
                self._made[piece] = tuple(some)
                self._painter.set_thing(piece, *_drawn(some, face))
            self.pieces.setdefault(board, []).append(piece)


def _drawn(messages: list[world_pb2.Stroke], face: Face) -> tuple[Surface3, F32]:
    """Strokes as one surface, and the colours of its vertices (n, 3)."""
    ribbons: list[Surface3] = []
    colours: list[F32] = []
    for message in messages:
        ribbons.append(ribbon(stroke_of(message), face))
        colours.append(np.tile(np.array(linear(message.colour), np.float32), (len(ribbons[-1].vertices), 1)))
    return join(ribbons), np.concatenate(colours)
