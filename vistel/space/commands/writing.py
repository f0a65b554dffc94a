"""Commands for boards: one is put up, written on, rubbed and wiped. What a stroke may be like is checked here, once for all."""

from dataclasses import replace

import numpy as np

from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.arguments import Which
from vistel.space.boards.board import SHAPE, board, face_of
from vistel.space.boards.stroke import ACROSS, MOST_NAME, MOST_POINTS, UPWARDS, WIDTH, WIDTHS, Stroke, touches
from vistel.space.commands import create
from vistel.space.commands.context import Answer, Context, changed, performs
from vistel.space.commands.names import COLOURS
from vistel.space.commands.panel_place import panel_place
from vistel.space.commands.presenting import name_from
from vistel.space.history import PlacedThing
from vistel.space.ink import FullError, without, written

MOST_BOARDS = 4
"""In the room."""
SPONGE = 80
"""Width of a way that rubs and says none, in units of the grid: 4 cm."""
MOST_SPONGE = 400
"""The widest such way: 20 cm."""


@performs(ask.PutUpBoard)
def put_up(context: Context, action: ask.PutUpBoard) -> Answer:
    """Put up a board where people see it best, turned to them."""
    if sum(t.shape == SHAPE for t in context.state.things) >= MOST_BOARDS:
        raise Refused(f"the room has {MOST_BOARDS} boards; take one away first")
    names = (t.name for t in context.state.things)
    new = board(*create.called(name_from(action.title), SHAPE, context.ids(), names))
    spot, rotation = panel_place(context, new)
    new = replace(new, position=spot, rotation=rotation)
    return changed(context, (), [PlacedThing(new, spot, rotation)]), (new.id,)


@performs(ask.Draw)
def draw(context: Context, action: ask.Draw) -> Answer:
    """Draw a stroke, or go on with it."""
    points = _points(action.points)
    colour = COLOURS["black"] if action.colour is None else action.colour
    if not 0 <= colour <= 0xFFFFFFFF or colour & 0xFF != 0xFF:
        raise Refused(f"a stroke has a colour 0xRRGGBBFF, such as 0xC23B32FF for red, not {colour:#x}")
    width = WIDTH if action.width is None else action.width
    if not WIDTHS[0] <= width <= WIDTHS[1]:
        raise Refused(f"a stroke is {WIDTHS[0]} to {WIDTHS[1]} units of 0.5 mm wide, not {width}")
    if len(action.stroke) > MOST_NAME:
        raise Refused(f"a stroke is called something of {MOST_NAME} letters at most, not {len(action.stroke)}")
    on = _board_meant(context, action.which)
    try:
        return written(context.state, Stroke(0, on, context.who, action.stroke, colour, width, b""), points), (on,)
    except FullError as full:
        raise Refused(str(full)) from full


@performs(ask.Rub)
def rub(context: Context, action: ask.Rub) -> Answer:
    """Rub out strokes, whoever has drawn them."""
    path = np.array(_points(action.points), np.int64)
    width = SPONGE if action.width is None else action.width
    if not WIDTHS[0] <= width <= MOST_SPONGE:
        raise Refused(f"one rubs {WIDTHS[0]} to {MOST_SPONGE} units of 0.5 mm wide, not {width}")
    on = _board_meant(context, action.which)
    gone = [s for s in context.state.strokes if s.board == on and touches(s, path, width)]
    return without(context.state, context.who, gone), (on,)


@performs(ask.Wipe)
def wipe(context: Context, action: ask.Wipe) -> Answer:
    """Rub out all strokes of a board."""
    on = _board_meant(context, action.which)
    return without(context.state, context.who, [s for s in context.state.strokes if s.board == on]), (on,)


def _points(flat: tuple[int, ...]) -> list[tuple[int, int]]:
    if not 2 <= len(flat) <= 2 * MOST_POINTS or len(flat) % 2:
        raise Refused(f"expected x and y of 1 to {MOST_POINTS} points, got {len(flat)} numbers")
    if min(flat) < 0 or max(flat[::2]) > ACROSS or max(flat[1::2]) > UPWARDS:
        raise Refused(f"a point is not on the board: x is 0 to {ACROSS} from the left, y 0 to {UPWARDS} from below")
    return list(zip(flat[::2], flat[1::2], strict=True))


def _board_meant(context: Context, which: Which) -> str:
    """The id of the board that is meant."""
    things = context.state.things
    if not which.is_this:
        thing = things[context.one(which)]
        if thing.shape != SHAPE:
            raise Refused(f"the {thing.name} is no board; nothing can be written on it")
    else:
        boards = [t for t in things if t.shape == SHAPE]
        if not boards:
            raise Refused("there is no board in the room; put one up first")
        thing = boards[-1]
    if face_of(thing) is None:
        raise Refused(f"the {thing.name} is bent; make it straight to write on it")
    return thing.id
