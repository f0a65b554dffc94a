"""The content of a room file: the room for the world, and the polymeshes of its things."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from vistel.space.files.faults import RoomFileError
from vistel.space.files.model import Polymesh
from vistel.space.joints.joint import Joint, check_joints
from vistel.space.room import Room
from vistel.space.things.things import Look, Thing


@dataclass(frozen=True, eq=False)
class Interior:
    """room; models: the polymeshes of its things, by digest; notes: remarks from reading the file."""

    room: Room
    models: Mapping[str, Polymesh] = field(default_factory=lambda: MappingProxyType({}))
    notes: tuple[str, ...] = ()

    def with_things(self, things: tuple[Thing, ...], models: Mapping[str, Polymesh] | None = None) -> "Interior":
        """The same room with other things; models: of those that are new. Those that nobody needs are left out, and joints of
        things that are there no more.

        Raises RoomFileError where two have one id, and where a joint cannot be.
        """
        ids = [t.id for t in things]
        twice = next((i for i in ids if ids.count(i) > 1), None)
        if twice is not None:
            raise RoomFileError(f"{twice}: two things have this id; give one of them another")
        every = {**self.models, **(models or {})}
        used = {k.model for t in things for k in looks_of(t)}
        kept = {digest: model for digest, model in every.items() if digest in used}
        here = (j for j in self.room.joints if j.thing in ids and (not j.base or j.base in ids))
        joints = tuple(_with_lamp_of(j, ids) for j in here)
        try:
            check_joints(joints, things)
        except ValueError as fault:
            raise RoomFileError(str(fault)) from fault
        return replace(self, room=replace(self.room, things=things, joints=joints), models=MappingProxyType(kept))

    def thing(self, thing_id: str) -> Thing:
        """The thing of that id. Raises RoomFileError that names those there are."""
        try:
            return self.room.thing(thing_id)
        except KeyError:
            there = ", ".join(t.id for t in self.room.things[:12]) + (", ..." if len(self.room.things) > 12 else "")
            raise RoomFileError(f"{thing_id}: no such thing in the room; there are {there or 'none'}") from None


def _with_lamp_of(j: Joint, ids: Sequence[str]) -> Joint:
    """The joint, without the lamp that its button switches if that is not among `ids`."""
    if j.button is None or not j.button.lights or j.button.lights in ids:
        return j
    return replace(j, button=replace(j.button, lights=""))


def looks_of(thing: Thing) -> list[Look]:
    """The looks of a thing, of its parts and of the thing it was bent from."""
    out = list(thing.looks)
    for part in thing.parts:
        out += looks_of(part.thing)
    return out + (looks_of(thing.curve.straight) if thing.curve else [])
