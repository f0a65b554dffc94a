"""What is written on boards, as a browser's page is told."""

import json
from base64 import b64encode
from collections.abc import Iterator, Mapping

from vistel.space.boards.board import SHAPE as BOARD
from vistel.space.boards.board import Face, face_of, front_of
from vistel.space.commands.panel import SHAPE as PANEL
from vistel.space.things.things import Thing
from vistel.v1.world_pb2 import Stroke

KIND = "ink"
"""Of the words that say it."""


class WrittenWords:
    """The words for those who watch a room together: all that is written, once, and each change from then on."""

    def __init__(self) -> None:
        self._said: Mapping[int, Stroke] = {}
        self._whole = True

    def again(self) -> None:
        """Say all of it with the next words: somebody has come."""
        self._whole = True

    def words(self, strokes: Mapping[int, Stroke]) -> Iterator[tuple[str, str]]:
        """Kinds and JSON of what has changed; of each kind the newest counts."""
        before, self._said = self._said, strokes
        if self._whole:
            self._whole = False
            yield KIND, _json(list(strokes.values()), whole=True)
            return
        if strokes is before:
            return
        for number in sorted(before.keys() | strokes.keys()):
            if (now := strokes.get(number)) is not before.get(number):
                yield f"{KIND} {number}", _json([now] if now else [], gone=[] if now else [number])


def face_rows(thing: Thing) -> dict[str, list[list[float]] | str | None]:
    """Where one writes on a thing (`face`), and where one reads on it (`front`: of a board and of a panel), as a page reads them:
    a corner, and the edges across and up (3,) [m]; and whose screen a panel shows (`screen`: a participant). None where it has
    none."""
    front = front_of(thing) if thing.shape in (BOARD, PANEL) and thing.primitives else None
    screen = thing.pages.by if thing.pages is not None and thing.pages.live else None
    return {"face": _row(face_of(thing)), "front": _row(front), "screen": screen}


def _row(face: Face | None) -> list[list[float]] | None:
    return None if face is None else [edge.tolist() for edge in (face.corner, face.across, face.up)]


def _json(strokes: list[Stroke], whole: bool = False, gone: list[int] | None = None) -> str:
    rows = [
        {
            "number": s.number,
            "board": s.board,
            "by": s.by,
            "id": s.id,
            "colour": f"#{s.colour >> 8:06x}",
            "width": s.width,
            "ink": b64encode(s.ink).decode(),
        }
        for s in strokes
    ]
    return json.dumps({"kind": KIND, "whole": whole, "strokes": rows, "gone": gone or []})
