"""Lamps: things whose colour a button changes, and changes back."""

from collections.abc import Sequence

from vistel.space.commands.reshape import painted
from vistel.space.joints.joint import Joint
from vistel.space.room import Room
from vistel.space.things.things import Thing


def lamps_switched(things: tuple[Thing, ...], room: Room, pressed: Sequence[Joint]) -> tuple[Thing, ...]:
    """The things after the buttons of `pressed` joints were pressed. room: as it began; a lamp that goes out looks as there."""
    out = list(things)
    for joint in pressed:
        if joint.button is None or not joint.button.lights:
            continue
        for n, thing in enumerate(out):
            if thing.id == joint.button.lights:
                out[n] = _switched(thing, room.by_id.get(thing.id), joint.button.lit)
    return tuple(out) if any(a is not b for a, b in zip(out, things, strict=True)) else things


def _switched(thing: Thing, at_first: Thing | None, lit: int) -> Thing:
    if thing.colour != lit:
        return painted(thing, lit)
    return thing if at_first is None else painted(thing, at_first.colour)
