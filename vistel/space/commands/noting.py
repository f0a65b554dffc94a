"""The command for sticky notes: one is written, on a blank one or a new one."""

from dataclasses import replace

import numpy as np

from vistel.geometry.rotation import quaternion_from_matrix
from vistel.one_line import one_line
from vistel.space import actions as ask
from vistel.space.actions import Refused
from vistel.space.arguments import Towards, Where
from vistel.space.commands.context import Answer, Context, changed, performs
from vistel.space.commands.create import unused
from vistel.space.commands.placing import free_spot, place_meant
from vistel.space.history import PlacedThing
from vistel.space.notes.note import MOST_TEXT, SHAPE, note, text_of
from vistel.space.things.things import Thing

MOST_OF_ONE = 12
"""Notes that one participant may have in the room."""
MOST_NOTES = 48
"""In the room."""
FARTHER_M = 0.35
"""Than other new things [m]: what lies as near as these is below what one sees who looks straight ahead."""
PAPER = 0xF2D95CFF
"""Colour of a new note."""


@performs(ask.WriteNote)
def write_note(context: Context, action: ask.WriteNote) -> Answer:
    """Lay a note before the speaker, to be read by them; its id says whose it is."""
    text = one_line(action.text)
    if len(text) > MOST_TEXT:
        raise Refused(f"a note has room for {MOST_TEXT} letters, not {len(text)}")
    things = context.state.things
    blank = next((n for n, t in enumerate(things) if _is_of(t, context.who) and not text_of(t)), None)
    if text and blank is not None:
        after = replace(context.placed(blank), thing=replace(things[blank], name=text))
        return changed(context, (blank,), [after]), (things[blank].id,)
    new = note(id_of_new(context), text, PAPER)
    ahead = context.speaker.direction(Towards.AHEAD)
    up = np.array([0.0, 1.0, 0.0])
    rotation = quaternion_from_matrix(np.stack([np.cross(ahead, up), ahead, up], axis=1))
    spot = free_spot(context, new, place_meant(context, Where.HERE) + FARTHER_M * ahead, rotation)
    return changed(context, (), [PlacedThing(replace(new, position=spot, rotation=rotation), spot, rotation)]), (new.id,)


def id_of_new(context: Context) -> str:
    """The id of one more note of the speaker's. Raises Refused where there are too many."""
    notes = [t for t in context.state.things if t.shape == SHAPE]
    if sum(_is_of(t, context.who) for t in notes) >= MOST_OF_ONE:
        raise Refused(f"you have {MOST_OF_ONE} notes in the room; delete one first")
    if len(notes) >= MOST_NOTES:
        raise Refused(f"the room has {MOST_NOTES} notes; delete one first")
    return unused(f"{SHAPE}-{context.who}", context.ids())


def _is_of(thing: Thing, who: str) -> bool:
    """Whether a thing is a note of somebody's."""
    return thing.shape == SHAPE and thing.id.rpartition("-")[0] == f"{SHAPE}-{who}"
