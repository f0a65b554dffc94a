"""The room as it is told: WorldState messages to `RoomState`, and what a late joiner is given.

A message says what has changed since the one before. Who has missed one, or finds that what it knows is not what
`WorldState.check` says, is `lost` until it gets a `WorldSnapshot` or a key frame. docs/reference/world-stream.md
"""

from __future__ import annotations

import zlib
from array import array
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.v1.world_pb2 import Bond, Dent, Grasp, Signals, Stroke, Thing, WorldDetail, WorldSnapshot, WorldState
from vistel.wire.world.codec.bits import FrameError
from vistel.wire.world.codec.frame import Book, ChangedLists, RoomStep, is_key, read_changes, read_key
from vistel.wire.world.codec.poses import place
from vistel.wire.world.codec.touches import force_of
from vistel.wire.world.detail import Details

STEP_NS = 16_666_667
"""Between two steps of the world."""
WAITING_MOST = 240
"""Messages kept for when a snapshot comes: eight seconds."""


class Touch(NamedTuple):
    """The field of `source` deforms the participant `target` at these primitives of theirs; force: between the two [N], to
    half an octave."""

    target: str
    source: str
    limbs: tuple[int, ...]
    force: float


@dataclass(frozen=True, eq=False)
class RoomState:
    """The room at one step. poses: position (3,) [m] and unit quaternion (4,) (x, y, z, w) of every thing, room frame, within
    0.5 mm and 0.1 degrees; moving: ids of things that have moved lately; grasps: oldest first; dents, bonds, strokes: by
    number."""

    step: int = 0
    t_ns: int = 0
    things: Mapping[str, Thing] = field(default_factory=dict[str, Thing])
    poses: Mapping[str, tuple[F64, F64]] = field(default_factory=dict[str, tuple[F64, F64]])
    moving: frozenset[str] = frozenset()
    touches: tuple[Touch, ...] = ()
    grasps: tuple[Grasp, ...] = ()
    participants: tuple[str, ...] = ()
    dents: Mapping[int, Dent] = field(default_factory=dict[int, Dent])
    bonds: Mapping[int, Bond] = field(default_factory=dict[int, Bond])
    strokes: Mapping[int, Stroke] = field(default_factory=dict[int, Stroke])
    selected: tuple[tuple[str, tuple[str, ...]], ...] = ()
    """Ids of the things that people have selected, by participant."""
    signals: Signals = field(default_factory=Signals)

    def holders(self, thing: str) -> tuple[str, ...]:
        """Who holds a thing; the first carries it."""
        return tuple(dict.fromkeys(g.participant for g in self.grasps if g.thing == thing))


def check_of(things: int, marks: int, book: Book, grasps: Iterable[Grasp], participants: Iterable[str]) -> int:
    """What `WorldState.check` says of a room. things, marks: `crc_of` the things in order, and of dents, bonds and strokes."""
    numbers = array("q", (things, marks, book.step, *book.moving))
    for track in book.tracks:
        numbers.extend(track.pose)
    for pair in sorted(book.touches):
        numbers.extend((*pair, book.touches[pair].level))
    limbs = ",".join(f"{book.touches[pair].limbs:x}" for pair in sorted(book.touches))
    texts = (limbs.encode(), ",".join(participants).encode(), *(g.SerializeToString(deterministic=True) for g in grasps))
    return zlib.crc32(b"".join((_little(numbers), *texts))) or 1


def crc_of(messages: Iterable[Thing | Dent | Bond | Stroke]) -> int:
    """CRC-32 of messages in their order."""
    crc = 0
    for message in messages:
        crc = zlib.crc32(message.SerializeToString(deterministic=True), crc)
    return crc


def crc_of_marks(dents: Mapping[int, Dent], bonds: Mapping[int, Bond], strokes: Mapping[int, Stroke]) -> int:
    """CRC-32 of dents, bonds and strokes by their numbers."""
    if not (dents or bonds or strokes):
        return 0
    return crc_of(some[n] for some in (dents, bonds, strokes) for n in sorted(some))


def _little(numbers: array[int]) -> bytes:
    return np.array(numbers, "<i8").tobytes()


class WorldDecoder:
    """Decodes WorldState messages, in their order, into the room at each step."""

    def __init__(self) -> None:
        self.lost = True
        """Something is missing: a snapshot is needed, or the next key frame."""
        self.missed, self.differed = 0, 0
        """How often a message was missing, and how often what was known was not what the sender knew."""
        self.agreed = 0
        """How often it was."""
        self.now = RoomState()
        self._book: Book | None = None
        self._order: tuple[str, ...] = ()
        self._things_crc, self._marks_crc = 0, 0
        self._marks_known = True
        self._waiting: deque[WorldState] = deque(maxlen=WAITING_MOST)
        self._details = Details()

    def receive_detail(self, message: WorldDetail) -> None:
        """Exact poses of some things, to be given before the message of the same step. Changes what `read` returns for that
        step, not the state that is checked."""
        self._details.receive(message)

    def read(self, message: WorldState) -> list[RoomState]:
        """The steps in this message, in order; none while it cannot be decoded."""
        if not message.frame:
            return self._read_words(message)
        if not self.lost and message.step <= self.now.step and message.header.t_ns <= self.now.t_ns:
            return []  # one that has come twice, or that a snapshot has overtaken
        try:
            if is_key(message.frame):
                out = self._read_key(message)
            else:
                out = self._read_changes(message)
        except FrameError:
            self._lose(message)
            self.missed += 1
            return []
        if out and message.HasField("check"):
            if self._check() == message.check:
                self.agreed += 1
            else:
                self.differed += 1
                self.lost = True
        return out

    def begin(self, snapshot: WorldSnapshot) -> RoomState | None:
        """The newest step that a snapshot and what has come since tell of; None when they tell nothing new."""
        if not self.lost and self._book is not None:
            return None
        waiting = list(self._waiting)
        self._waiting.clear()
        if not snapshot.HasField("state"):
            return None
        before = self.now
        for message in (snapshot.state, *snapshot.since, *waiting):
            self.read(message)
        return self.now if self.now is not before else None

    # -- whole and changed -------------------------------------------------------------------------------------

    def _read_key(self, message: WorldState) -> list[RoomState]:
        whole = bool(message.things) and not message.order
        things = self._things(message, whole)
        order = tuple(t.id for t in message.things) if whole else tuple(message.order) or self._order
        book, lists = read_key(message.frame, message.step)
        if len(book.tracks) != len(order) or any(name not in things for name in order):
            raise FrameError("a key frame tells of things that are not known")
        if whole or message.order or message.things:
            self._things_crc = crc_of(things[name] for name in order)
        self._book, self._order, self.lost = book, order, False
        self._waiting.clear()
        self._details.forget()
        poses = {name: place(track.pose) for name, track in zip(order, book.tracks, strict=True)}
        now = self._state_of(message, lists, things, whole)
        self.now = replace(now, step=message.step, t_ns=message.header.t_ns, poses=poses)
        return [self.now]

    def _read_changes(self, message: WorldState) -> list[RoomState]:
        book = self._book
        if self.lost or book is None:
            self._waiting.append(message)
            return []
        steps, lists = read_changes(message.frame, book, message.step)
        things = self._things(message, False)
        if message.things:
            self._things_crc = crc_of(things[name] for name in self._order)
        now = self._state_of(message, lists, things, False)
        out = [now := self._step(message, step, now) for step in steps]
        self.now = now
        exact = self._details.poses(book, self._order, len(steps))
        # Steps before the newest are told of by nobody exactly: whoever is shown more than the frame says goes without.
        return [replace(now, poses={**now.poses, **exact})] if exact else out

    def _step(self, message: WorldState, step: RoomStep, now: RoomState) -> RoomState:
        poses = now.poses
        if step.poses:
            poses = dict(poses)
            poses.update((self._order[n], place(pose)) for n, pose in step.poses.items())
        t_ns = message.header.t_ns - (message.step - step.step) * STEP_NS
        return replace(now, step=step.step, t_ns=t_ns, poses=poses)

    def _state_of(self, message: WorldState, lists: ChangedLists, things: Mapping[str, Thing], whole: bool) -> RoomState:
        """What was known with everything new but step and poses."""
        book, before = self._book, self.now
        assert book is not None
        people = tuple(message.participants) if lists.people else before.participants
        moving = before.moving
        if book.touches_changed or lists.people:
            touches = self._touches(book, people)
        else:
            touches = before.touches
        names = frozenset(self._order[n] for n in book.moving)
        dents, bonds, strokes = self._marks(message, whole)
        grasps = tuple(message.grasps) if lists.grasps else before.grasps
        moving = moving if names == moving else names
        return replace(
            before,
            things=things,
            participants=people,
            touches=touches,
            dents=dents,
            bonds=bonds,
            strokes=strokes,
            moving=moving,
            grasps=grasps,
            selected=_selected(message, before),
            signals=_signals(message, before),
        )

    def _things(self, message: WorldState, whole: bool) -> Mapping[str, Thing]:
        if not (message.things or message.order):
            return self.now.things
        things: dict[str, Thing] = {} if whole else dict(self.now.things)
        things.update((t.id, t) for t in message.things)
        return {name: things[name] for name in message.order if name in things} if message.order else things

    def _touches(self, book: Book, people: Sequence[str]) -> tuple[Touch, ...]:
        bodies = (*people, *self._order)
        if any(max(pair) >= len(bodies) for pair in book.touches):
            raise FrameError("a frame names a body that is not there")
        return tuple(
            Touch(bodies[a], bodies[b], _set_of(touch.limbs), force_of(touch.level))
            for (a, b), touch in sorted(book.touches.items())
        )

    def _marks(self, message: WorldState, whole: bool) -> tuple[Mapping[int, Dent], Mapping[int, Bond], Mapping[int, Stroke]]:
        dents, bonds, strokes = self.now.dents, self.now.bonds, self.now.strokes
        if not (whole or message.dents or message.bonds or message.strokes or message.gone):
            return dents, bonds, strokes
        gone = frozenset(message.gone)
        dents = {n: d for n, d in dents.items() if not whole and n not in gone} | {d.number: d for d in message.dents}
        bonds = {n: b for n, b in bonds.items() if not whole and n not in gone} | {b.number: b for b in message.bonds}
        strokes = {n: s for n, s in strokes.items() if not whole and n not in gone} | {s.number: s for s in message.strokes}
        self._marks_known = False
        return dents, bonds, strokes

    def _check(self) -> int:
        assert self._book is not None
        if not self._marks_known:  # counted only when it is asked for: strokes come thirty times a second
            self._marks_crc, self._marks_known = crc_of_marks(self.now.dents, self.now.bonds, self.now.strokes), True
        return check_of(self._things_crc, self._marks_crc, self._book, self.now.grasps, self.now.participants)

    def _lose(self, message: WorldState) -> None:
        self.lost = True
        if not is_key(message.frame):
            self._waiting.append(message)

    # -- in words ----------------------------------------------------------------------------------------------

    def _read_words(self, m: WorldState) -> list[RoomState]:
        """A message without a frame, as logs of before have them: doubles, whole or only what moved."""
        before = self.now
        if not m.key and (self._book is not None or not before.step or m.step < before.step):
            return []
        self._book, self.lost = None, False
        poses = {} if m.key else dict(before.poses)
        for s in m.states:
            p, q = s.pose.position, s.pose.rotation
            turn = np.array((q.x, q.y, q.z, q.w))
            size = float(np.sqrt(turn @ turn))
            poses[s.id] = np.array((p.x, p.y, p.z)), turn / size if size > 1e-6 else np.array((0.0, 0.0, 0.0, 1.0))
        force = {(c.body_a, c.body_b): c.force for c in m.contacts}
        dents, bonds, strokes = self._marks(m, m.key)
        self.now = RoomState(
            m.step,
            m.header.t_ns,
            {t.id: t for t in m.things} if m.key and m.things else before.things,
            poses,
            frozenset(s.id for s in m.states if not s.resting),
            tuple(Touch(g.target, g.source, tuple(g.target_primitives), force.get((g.target, g.source), 0.0)) for g in m.ghosts),
            tuple(m.grasps),
            tuple(m.participants),
            dents,
            bonds,
            strokes,
            _selected(m, before),
            _signals(m, before),
        )
        return [self.now]


def _selected(message: WorldState, before: RoomState) -> tuple[tuple[str, tuple[str, ...]], ...]:
    if not (message.key or message.HasField("selections")):
        return before.selected
    return tuple((s.participant, tuple(s.things)) for s in message.selections.of)


def _signals(message: WorldState, before: RoomState) -> Signals:
    return message.signals if message.key or message.HasField("signals") else before.signals


def _set_of(bits: int) -> tuple[int, ...]:
    return tuple(i for i in range(bits.bit_length()) if bits >> i & 1)


class SnapshotBuilder:
    """Keeps what a late joiner needs: the last whole message, and all since."""

    def __init__(self) -> None:
        self._whole: WorldState | None = None
        self._since: list[WorldState] = []

    def key(self, whole: WorldState) -> None:
        """A whole message, as it goes on `world_key`."""
        self._whole = whole
        self._since = [m for m in self._since if m.step > whole.step]

    def add(self, message: WorldState) -> None:
        """A message as it goes on `world_state`."""
        if self._whole is not None and message.step > self._whole.step:
            self._since.append(message)

    def snapshot(self) -> WorldSnapshot:
        """All of it; empty before the first whole message."""
        out = WorldSnapshot(since=self._since)
        if self._whole is not None:
            out.state.CopyFrom(self._whole)
        return out
