"""What a guest's page asks of the world in words, checked: to write on a board, whole numbers on the face, short names, known
colours; to write on a note; to raise a hand; to react."""

import re
from typing import Any, cast

from vistel.space.actions import Action, Draw, PutUpBoard, RaiseHand, React, Rub, Undo, Wipe, WriteNote
from vistel.space.arguments import Reaction, Which
from vistel.space.boards.stroke import ACROSS, MOST_NAME, MOST_POINTS
from vistel.space.notes.note import MOST_TEXT

GUEST_COMMANDS = frozenset(
    ("present", "turn_page", "put_away", "put_up_board", "draw", "rub", "wipe", "write_note", "undo", "raise_hand", "react")
)
"""What guests may ask of the world besides what their hands do, by its field in the message `Command`."""
_REACTIONS = {r.value: r for r in Reaction}
_COLOUR = re.compile(r"#[0-9a-f]{6}")


def written_by(words: dict[str, object]) -> Action | None:
    """The action that words of a page ask for; None for what is none, or cannot be."""
    board = words.get("board", "")
    if isinstance(down := words.get("hand_down"), bool):
        return RaiseHand(down)
    if isinstance(react := words.get("react"), str):
        return React(_REACTIONS[react]) if react in _REACTIONS else None
    if words.get("new_board") is True:
        return PutUpBoard()
    if isinstance(text := words.get("note"), str):
        return WriteNote(text) if len(text) <= MOST_TEXT else None
    if words.get("undo") is True:
        return Undo()
    if _short(words.get("wipe")):
        return Wipe(Which(str(words["wipe"])))
    if not _short(board):
        return None
    which = Which(str(board))
    if (way := _way(words.get("rub"))) is not None:
        return Rub(way, which)
    way, stroke, colour = _way(words.get("draw")), words.get("stroke"), words.get("colour")
    if way is None or not _short(stroke) or not isinstance(colour, str) or _COLOUR.fullmatch(colour) is None:
        return None
    return Draw(way, which, int(colour[1:] + "ff", 16), None, str(stroke))


def _short(name: object) -> bool:
    return isinstance(name, str) and 0 < len(name) <= MOST_NAME


def _way(numbers: Any) -> tuple[int, ...] | None:
    """x and y of each point in turn; what is no whole number, such as NaN, is on no board."""
    if not isinstance(numbers, list):
        return None
    flat = cast("list[object]", numbers)
    if not 2 <= len(flat) <= 2 * MOST_POINTS or len(flat) % 2:
        return None
    whole = tuple(n for n in flat if type(n) is int and 0 <= n <= ACROSS)
    return whole if len(whole) == len(flat) else None
