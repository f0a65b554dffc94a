"""What is written in a room: the one place where strokes come into its state, and where it is seen to how many there are."""

from collections.abc import Sequence

from vistel.space.boards.stroke import MOST_POINTS, Stroke, packed
from vistel.space.history import History
from vistel.space.state import State

MOST_STROKES = 2000
"""In the room; one participant may have half of them."""
MOST_INK = 30_000
"""Points of all strokes in the room; one participant may have half of them."""


class FullError(Exception):
    """There is no room for more; the text is one line for the person who writes."""


def written(state: State, new: Stroke, points: Sequence[tuple[int, int]]) -> State:
    """The state with a stroke through points (x, y) on the grid, one at least, remembered as its writer's doing. new: what the
    stroke is like, its number and ink count for nothing; where the writer has one of the same id, not empty, on that board, it
    grows.

    Raises FullError, also for a stroke of more than `MOST_POINTS`.
    """
    known = (s for s in reversed(state.strokes) if (s.by, s.board, s.id) == (new.by, new.board, new.id))
    before = next(known, None) if new.id else None
    if before is not None:
        now = before.grown(points)
        strokes, marks = tuple(now if s is before else s for s in state.strokes), state.marks
    else:
        now = Stroke(state.marks, new.board, new.by, new.id, new.colour, new.width, packed(points))
        strokes, marks = (*state.strokes, now), state.marks + 1
    if now.count > MOST_POINTS:
        raise FullError(f"a stroke has at most {MOST_POINTS} points, and one for each 6 cm, not {now.count}; begin another one")
    _check_room(strokes, now.by)
    return state.but(strokes=strokes, marks=marks, history=state.history.with_stroke(now.by, before, now))


def _check_room(strokes: Sequence[Stroke], by: str) -> None:
    """Raises FullError where these are too many, or those of a participant among them."""
    for some, whose, most in (([s for s in strokes if s.by == by], "you have written", 2), (strokes, "the room has", 1)):
        if len(some) > MOST_STROKES // most:
            raise FullError(f"{whose} {MOST_STROKES // most} strokes, as many as can be kept; wipe a board first")
        if sum(s.count for s in some) > MOST_INK // most:
            raise FullError(f"{whose} {MOST_INK // most} points of strokes, as many as can be kept; wipe a board first")


def without(state: State, by: str, gone: Sequence[Stroke]) -> State:
    """The state after a participant has rubbed strokes out."""
    numbers = {s.number for s in gone}
    if not numbers:
        return state
    left = tuple(s for s in state.strokes if s.number not in numbers)
    return state.but(strokes=left, history=state.history.with_rubbed(by, tuple(gone)))


def reverted(state: State, there: Sequence[Stroke], instead: Sequence[Stroke], history: History) -> State:
    """The state with the strokes `instead` in place of `there`, as far as the boards are still there and the room is not full."""
    if not (there or instead):
        return state.but(history=history)
    numbers = {s.number for s in (*there, *instead)}
    strokes = [s for s in state.strokes if s.number not in numbers]
    ink = sum(s.count for s in strokes)
    for back in instead:
        if back.board in state.rows and len(strokes) < MOST_STROKES and ink + back.count <= MOST_INK:
            strokes.append(back)
            ink += back.count
    return state.but(strokes=tuple(sorted(strokes, key=lambda s: s.number)), history=history)
