"""The room as a program sees it: one value per step of the world."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vistel.arrays import F64
from vistel.messages.boards import stroke_of
from vistel.space.boards.stroke import Stroke
from vistel.wire.world.decoder import RoomState


@dataclass(frozen=True, eq=False)
class ThingView:
    """A thing at one step.

    position: (3,) metres, room frame. rotation: (4,) unit quaternion (x, y, z, w), room frame. colour: 0xRRGGBBAA.
    holders: participants who hold it, the one who carries it first. still: it has not moved lately.
    """

    id: str
    name: str
    shape: str
    colour: int
    position: F64
    rotation: F64
    holders: tuple[str, ...] = ()
    still: bool = False


@dataclass(frozen=True, eq=False)
class RoomView:
    """The room at one step of the world. t_ns: conference time. things: by id. touching: pairs of ids and participants where
    the first is pressed by the second. written: strokes of each board that has some, by its id, the oldest first."""

    step: int = 0
    t_ns: int = 0
    things: Mapping[str, ThingView] = field(default_factory=dict[str, ThingView])
    people: tuple[str, ...] = ()
    touching: frozenset[tuple[str, str]] = frozenset()
    written: Mapping[str, tuple[Stroke, ...]] = field(default_factory=dict[str, tuple[Stroke, ...]])

    def apart(self, a: str, b: str) -> float:
        """Distance between the centres of two things, metres; infinite when one of them is not there."""
        if a not in self.things or b not in self.things:
            return float("inf")
        return float(np.linalg.norm(self.things[a].position - self.things[b].position))

    def touched(self, thing: str) -> bool:
        """Whether anybody or anything presses a thing."""
        return any(thing in pair for pair in self.touching)


def view_of(now: RoomState) -> RoomView:
    """What a program sees of a decoded room."""
    things = {
        t.id: ThingView(t.id, t.name, t.shape, t.colour, *now.poses[t.id], now.holders(t.id), t.id not in now.moving)
        for t in now.things.values()
        if t.id in now.poses
    }
    written: dict[str, tuple[Stroke, ...]] = {}
    for number in sorted(now.strokes):
        stroke = stroke_of(now.strokes[number])
        written[stroke.board] = (*written.get(stroke.board, ()), stroke)
    touching = frozenset((t.target, t.source) for t in now.touches)
    return RoomView(now.step, now.t_ns, things, now.participants, touching, written)
