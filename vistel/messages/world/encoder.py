"""Encodes the steps of a world as messages: changes since the message before, and at intervals a key frame with everything.

The bytes depend on the steps since the last key frame alone, so that a re-run from a recorded state gives the same messages from
the next key frame on."""

from collections.abc import Mapping
from typing import NamedTuple

from vistel.messages.boards import stroke_message
from vistel.messages.world.encode import (
    NO_SIGNALS,
    bond_message,
    dent_message,
    grasp_message,
    selections,
    signals,
    thing_message,
    world_state,
)
from vistel.messages.world.interest import InterestFilter
from vistel.messages.world.touching import Touching
from vistel.space.eyes import Eyes
from vistel.space.things.things import Thing
from vistel.space.view import GraspView, WorldView
from vistel.v1.world_pb2 import Grasp, WorldDetail, WorldState
from vistel.v1.world_pb2 import Thing as ThingMessage
from vistel.wire.world.codec.bits import FrameError
from vistel.wire.world.codec.frame import MOST_ENCODED, Book, ChangedLists, Moves, read_key, write_book, write_changes, write_key
from vistel.wire.world.codec.poses import GridPose, rounded
from vistel.wire.world.codec.touches import Pair, TouchCode
from vistel.wire.world.decoder import check_of, crc_of, crc_of_marks

KEY_STEPS = 120
"""Steps from one whole message to the next: two seconds."""
MOST_KEYED = 100
"""Rooms with up to this many things publish every key frame to everybody. In larger rooms only those who ask get one, so that the
stream of the others does not grow with the room."""
TOGETHER = 2
"""Steps in a message."""


class EncodedStep(NamedTuple):
    """state: for `world_state`, None when more steps go into it; whole: for `world_key`, with key frames."""

    state: WorldState | None = None
    whole: WorldState | None = None


class WorldEncoder:
    """Encodes the steps of one world. begins: the first step given is the first of a world that has just started. Otherwise
    nothing is published before the next step at which a key frame is due, or, in a large room, before `continue_from`."""

    def __init__(self, begins: bool = True) -> None:
        self._begins, self._silent = begins, not begins
        self._book = Book()
        self._interest = InterestFilter()
        self._newest: Mapping[int, GridPose] = {}
        self._steps = 0
        self._published: WorldView | None = None
        self._last = 0
        self._moves: list[Moves] = []
        self._fresh: set[int] = set()
        self._gone: set[int] = set()
        self._hash = 0
        self._rows: Mapping[str, int] = {}
        self._things: tuple[Thing, ...] = ()
        self._described: dict[str, tuple[Thing, ThingMessage]] = {}
        self._things_crc = 0
        self._people: tuple[str, ...] = ()
        self._grasps: tuple[object, ...] = ()
        self._published_grasps: list[Grasp] = []
        self._selected: tuple[tuple[str, tuple[str, ...]], ...] = ()
        self._signals = NO_SIGNALS
        self._touching = Touching()

    def encode(self, view: WorldView) -> EncodedStep:
        """The messages of a step."""
        due = view.step // KEY_STEPS > self._last // KEY_STEPS or self._begins
        self._last = view.step
        if self._silent and (view.step % KEY_STEPS or view.changed or len(view.things) > MOST_KEYED):
            return EncodedStep()
        changed = view.things != self._things
        renamed = changed and [t.id for t in view.things] != [t.id for t in self._things]
        key = renamed or self._silent or (due and len(view.things) <= MOST_KEYED) or self._begins
        out = self._key(view, changed, renamed) if key else self._step(view, changed, due)
        self._begins = self._silent = False
        return EncodedStep(out, self._whole(view, out) if due and out is not None else None)

    @property
    def silent(self) -> bool:
        """Whether nothing has been published yet, because the encoder did not begin with the world."""
        return self._silent

    def continue_from(self, view: WorldView, whole: WorldState) -> None:
        """Go on from a step at which another world has published the whole of a large room. Raises FrameError."""
        book, _ = read_key(whole.frame, view.step)
        if len(book.tracks) != len(view.things) or len(book.tracks) <= MOST_KEYED:
            raise FrameError("a frame of another room")
        self._book, self._last = book, view.step
        self._begins = self._silent = False
        self._describe(view, WorldState())
        self._people, self._selected, self._signals = view.participants, view.selected, view.signals
        self._encode_grasps(view, WorldState())
        self._touching.begin(view)
        self._touches(view)
        self._newest = {n: rounded(view.states[n].position, view.states[n].rotation) for n in book.moving}
        book.crowded = len(book.moving) > MOST_ENCODED
        self._steps = 1

    def snapshot(self, words: bool) -> WorldState | None:
        """Everything published so far, in one message that refers to no other; None before anything was. words: also in the
        readable fields, which a `WorldDecoder` does not need. Changes nothing."""
        view = self._published
        if view is None:
            return None
        things = [message for _, message in self._described.values()]
        if words:
            out = world_state(view, things)
            del out.grasps[:]
        else:
            out = WorldState(step=view.step, key=True, things=things, participants=view.participants)
            out.header.t_ns = view.t_ns
            out.dents.extend(dent_message(d) for d in view.dents)
            out.bonds.extend(bond_message(b) for b in view.bonds)
            out.strokes.extend(stroke_message(s) for s in view.strokes)
            if view.selected:
                out.selections.CopyFrom(selections(view))
            if view.signals != NO_SIGNALS:
                out.signals.CopyFrom(signals(view))
        out.grasps.extend(self._published_grasps)
        out.frame, out.check = write_book(self._book), self._check(view)
        out.ClearField("hash")
        return out

    def details(self, eyes: Mapping[str, Eyes], t_ns: int) -> dict[str, WorldDetail]:
        """Details to publish before the message of the newest step, by participant. eyes: of everybody."""
        return self._interest.encode(self._book, self._newest, self._steps, eyes, t_ns)

    # -- the two kinds -----------------------------------------------------------------------------------------

    def _key(self, view: WorldView, changed: bool, renamed: bool) -> WorldState:
        out = WorldState(step=view.step, key=True, participants=view.participants)
        if changed:
            self._describe(view, out)
            if not self._silent and renamed:
                out.order.extend(t.id for t in view.things)
        if self._silent:
            del out.things[:]  # published before
        self._people, self._selected, self._signals = view.participants, view.selected, view.signals
        if view.selected:
            out.selections.CopyFrom(selections(view))
        if view.signals != NO_SIGNALS:
            out.signals.CopyFrom(signals(view))
        self._encode_grasps(view, out)
        self._touching.begin(view)
        poses = [rounded(s.position, s.rotation) for s in view.states]
        moving = [n for n, s in enumerate(view.states) if s.moved]
        out.frame = write_key(self._book, view.step, poses, moving, self._touches(view))
        self._remember_marks(view)
        return self._finish(view, out)

    def _step(self, view: WorldView, changed: bool, due: bool) -> WorldState | None:
        followed = set(self._book.moving)
        poses = {n: rounded(s.position, s.rotation) for n, s in enumerate(view.states) if s.moved or n in followed}
        self._moves.append(Moves(view.step, poses))
        (self._touching.begin if due else self._touching.step)(view)
        self._remember_marks(view)
        if not (due or changed or view.step % TOGETHER == 0 or len(self._moves) >= TOGETHER):
            return None
        out = WorldState(step=view.step)
        if changed:
            self._describe(view, out)
        people = view.participants != self._people
        if people:
            self._people = view.participants
            out.participants.extend(view.participants)
        if view.selected != self._selected:
            self._selected = view.selected
            out.selections.CopyFrom(selections(view))
        if view.signals != self._signals:
            self._signals = view.signals
            out.signals.CopyFrom(signals(view))
        grasps = due or _rough(view.grasps) != self._grasps
        if grasps:
            self._encode_grasps(view, out)
        out.frame = write_changes(self._book, self._moves, self._touches(view), ChangedLists(people, grasps))
        self._newest, self._steps = poses, len(self._moves)
        return self._finish(view, out, due)

    def _finish(self, view: WorldView, out: WorldState, due: bool = False) -> WorldState:
        out.header.t_ns = view.t_ns
        out.dents.extend(dent_message(d) for d in view.dents if d.number in self._fresh)
        out.bonds.extend(bond_message(b) for b in view.bonds if b.number in self._fresh)
        out.strokes.extend(stroke_message(s) for s in view.strokes if s.number in self._fresh)
        out.gone.extend(sorted(self._gone))
        if self._hash:
            out.hash = self._hash
        if out.key or due or self._hash:
            out.check = self._check(view)
        self._moves, self._hash, self._published = [], 0, view
        self._fresh.clear()
        self._gone.clear()
        return out

    def _check(self, view: WorldView) -> int:
        dents = {d.number: dent_message(d) for d in view.dents}
        bonds = {b.number: bond_message(b) for b in view.bonds}
        strokes = {s.number: stroke_message(s) for s in view.strokes}
        marks = crc_of_marks(dents, bonds, strokes)
        return check_of(self._things_crc, marks, self._book, self._published_grasps, view.participants)

    def _whole(self, view: WorldView, said: WorldState) -> WorldState:
        """Everything, in readable fields and as the frame of the message beside it."""
        out = world_state(view, [self._described[t.id][1] for t in view.things])
        out.frame = said.frame if said.key else write_book(self._book)
        out.ClearField("hash")
        for name in ("check", "hash"):
            if said.HasField(name):
                setattr(out, name, getattr(said, name))
        return out

    # -- parts -------------------------------------------------------------------------------------------------

    def _describe(self, view: WorldView, out: WorldState) -> None:
        """What things are, of those that are new or not what they were."""
        known = self._described
        self._described = {}
        for t in view.things:
            old = known.get(t.id)
            if old is None or old[0] is not t:
                old = t, thing_message(t)
                out.things.append(old[1])
            self._described[t.id] = old
        self._things, self._rows = view.things, {t.id: n for n, t in enumerate(view.things)}
        self._things_crc = crc_of(message for _, message in self._described.values())

    def _encode_grasps(self, view: WorldView, out: WorldState) -> None:
        self._grasps = _rough(view.grasps)
        self._published_grasps = [grasp_message(g) for g in view.grasps]
        out.grasps.extend(self._published_grasps)

    def _remember_marks(self, view: WorldView) -> None:
        self._fresh.update(view.fresh)
        self._gone.update(view.gone)
        self._hash = view.hash or self._hash

    def _touches(self, view: WorldView) -> dict[Pair, TouchCode]:
        bodies = {name: n for n, name in enumerate(view.participants)}
        first = len(bodies)
        for name, row in self._rows.items():
            bodies.setdefault(name, first + row)
        return {(bodies[a], bodies[b]): touch for (a, b), touch in self._touching.now(bodies).items()}


def _rough(grasps: tuple[GraspView, ...]) -> tuple[object, ...]:
    """Grasps as far as anybody would notice a change."""
    return tuple(
        (
            g.participant,
            g.right,
            g.thing,
            g.since_ns,
            rounded(g.position, g.rotation),
            rounded(g.seen_position, g.seen_rotation),
            g.fingers.tobytes(),
        )
        for g in grasps
    )
