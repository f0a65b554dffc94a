"""Soft things that give way, as pages are told it: corners of their files that lie elsewhere than at rest.

The file of a soft thing has the surface that the sites' renderers deform (`vistel.render.things.soft`): what is sent is how far its
corners are moved, as with skin. The stream has a few places for dented things, so that what changes on one does not send another
again, and what waits for a slow viewer is replaced by what is newer.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from vistel.figure.body import pose_body
from vistel.figure.posture.posture import pose_joints
from vistel.geometry.pose import Pose
from vistel.render.glb_files import ThingFile
from vistel.render.pressed_skin import MOST_PEOPLE, LookTimes, Pressed, PressedFigure, PressedSkin
from vistel.render.room_gltf import FURNITURE
from vistel.render.stage.stage import Instant, ParticipantInfo
from vistel.render.things.soft import Reshaped, SoftThing, SoftThings, is_soft, pulls_of
from vistel.space.things.things import Thing

MOVED_M = 1e-4
"""What moves less, and is not turned either, is left as it is [m]."""
TURNED = 0.998
"""Cosine of the angle from which a corner is lit otherwise than at rest."""
CHANGED_M = 5e-4
"""A thing is told anew where a corner has moved by more since it was told [m]."""
MOST_THINGS = 8
"""Things that are seen dented at once; those that somebody presses go before those that keep a dent."""
MOST_CORNERS = 12_000
"""Of one thing, those that move farthest: 160 kB."""
STEP_BYTES = 4_000
"""Of all things for each frame, over time: after much has been sent, the next look is later."""
Figures = Callable[[ParticipantInfo], PressedFigure | None]
Files = Callable[[Thing], ThingFile | None]


def pressed_thing(soft: SoftThing, shape: Reshaped, pose: Pose) -> Pressed | None:
    """Corners of a thing's file that are moved; shape: as the thing is reshaped where it is now. None: nothing that is seen."""
    rest, back = soft.surface, np.concatenate(soft.skin.back)
    positions, normals = shape.positions.astype(np.float64), shape.normals.astype(np.float64)
    if shape.in_room:
        positions, normals = (positions - pose.position) @ shape.turn, normals @ shape.turn
    offset = positions - rest.vertices
    far = np.abs(offset).max(axis=1)
    seen = (far > MOVED_M) | (np.einsum("ij,ij->i", normals, rest.normals) < TURNED)
    corner = np.flatnonzero(seen[back])
    if len(corner) > MOST_CORNERS:
        corner = np.sort(corner[np.argsort(-far[back[corner]], kind="stable")[:MOST_CORNERS]])
    if not len(corner):
        return None
    own = np.concatenate([piece.surface.normals for piece in soft.skin.pieces])[corner]  # its edges stay sharp
    vertex = back[corner]
    turned = np.where(shape.bent[vertex, None], normals[vertex], own)
    return Pressed(corner.astype(np.uint32), offset[vertex], turned)


@dataclass(eq=False)
class _Place:
    """In the stream. shape: of which the thing was found pressed as it is told; words: JSON; thing: its id, empty: nobody's."""

    words: str
    thing: str = ""
    file: str = ""
    shape: Reshaped | None = None
    told: Pressed | None = None


class PressedThings:
    """Of a room. figure: somebody's; file: a thing's; None while they are being made, and where there are none."""

    def __init__(self, figure: Figures, file: Files) -> None:
        self._figure, self._file = figure, file
        self._soft = SoftThings()
        self._kept: dict[str, tuple[str, SoftThing]] = {}
        """What `_soft` has, and digests of the files, by id."""
        self._places = [_Place(_words(n, None)) for n in range(MOST_THINGS)]
        self._looked: tuple[object, ...] = ()
        self._times, self._pause = LookTimes(), 0

    def words(self, now: Instant) -> Iterator[tuple[str, str]]:
        """For each place the kind of message, and JSON: which thing is dented how, as of the last look. Asked for each frame."""
        when, stands = self._times.at(now.now_ns)
        self._pause -= 1
        if stands or self._pause <= 0:
            self._look(now, when)
        for n, place in enumerate(self._places):
            yield f"dents{n}", place.words

    def _look(self, now: Instant, when: int) -> None:
        """when: nothing is looked at twice at the same one."""
        people = {person.about.name: person for person in now.people}
        pressing = {(g.source, g.target) for g in now.world.ghosts if g.source in people}
        pressing |= {(b.body, b.thing) for b in now.world.bonds.values()}
        files = self._files(now, {thing for _, thing in pressing})
        acting = sorted({body for body, thing in pressing if thing in files and body in people})[:MOST_PEOPLE]
        figures = {name: made for name in acting if (made := self._figure(people[name].about)) is not None}
        looked = when, tuple(files.values()), tuple(figures)
        if looked == self._looked:
            return
        self._looked = looked
        for name in self._kept.keys() - files.keys():
            self._soft.drop(name)
        for _, soft in files.values():
            self._soft.keep(soft)
        self._kept = files
        joints = {name: pose_joints(made.skeleton, people[name].posture) for name, made in figures.items()}
        posed = {name: pose_body(made.body, joints[name]) for name, made in figures.items()}
        shapes = self._soft.reshaped(now, figures, posed, pulls_of(now, posed, joints, figures)[0])
        self._tell(now, {name: shape for name, shape in shapes.items() if shape is not None})

    def _files(self, now: Instant, live: set[str]) -> dict[str, tuple[str, SoftThing]]:
        """Things that may be dented now, and digests of their files, by id. live: what somebody presses, or sticks to."""
        dented = live | {d.thing for d in now.world.dents.values()}
        here = [name for name in dented & now.things.keys() & now.world.poses.keys() if _shown_soft(now.things[name])]
        chosen = sorted(here, key=lambda name: (name not in live, name))[:MOST_THINGS]
        made = {name: file for name in chosen if (file := self._file(now.things[name])) is not None}
        return {name: (file.digest, file.soft) for name, file in made.items() if file.soft is not None}

    def _tell(self, now: Instant, shapes: dict[str, Reshaped]) -> None:
        for n, place in enumerate(self._places):
            if place.thing and place.thing not in shapes:
                self._places[n] = _Place(_words(n, None))
        sent = 0
        for name, shape in shapes.items():
            at = [n for n, place in enumerate(self._places) if place.thing == name]
            n = at[0] if at else next(n for n, place in enumerate(self._places) if not place.thing)
            sent += self._tell_one(n, name, shape, now.world.poses[name])
        self._pause = sent // STEP_BYTES

    def _tell_one(self, n: int, name: str, shape: Reshaped, pose: Pose) -> int:
        """How many bytes are sent."""
        before, (digest, soft) = self._places[n], self._kept[name]
        if before.shape is shape:
            return 0
        found = pressed_thing(soft, shape, pose)
        known = before.told if before.file == digest else None
        if found is not None and known is not None and not found.differs(known, CHANGED_M):
            before.shape = shape
            return 0
        words = _words(n, found and found.row(name) | {"file": digest})
        self._places[n] = _Place(words, name, digest, shape, found)
        return len(words)


class PressedRoom:
    """All that gives way in a room, as pages are told it: people's skin and soft things."""

    def __init__(self, figure: Figures, file: Files) -> None:
        self._skin, self._things = PressedSkin(figure), PressedThings(figure, file)

    def words(self, now: Instant) -> Iterator[tuple[str, str]]:
        """Kinds of messages, and JSON."""
        yield "skin", self._skin.words(now)
        yield from self._things.words(now)


def _shown_soft(thing: Thing) -> bool:
    """Whether it has a file of its own whose corners can move."""
    return is_soft(thing) and not thing.hidden and thing.shape not in FURNITURE


def _words(place: int, row: dict[str, object] | None) -> str:
    return json.dumps({"kind": "dents", "place": place, "thing": row})
