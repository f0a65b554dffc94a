"""The world: things, people, contacts, grasps, in fixed steps. It knows no clock, no bus and no random number.

`World.step` takes all new inputs (`StepInputs`) and returns the state of the room (`WorldView`). The same inputs
from the same state give the same bytes; `World.snapshot` is that state, and `World.restore` continues from it.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.implicit.contacts.contact import ContactArray
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space import snapshot
from vistel.space.commands.perform import forgotten, obey
from vistel.space.contact.near import Bodies, PlacedPrimitives, placed
from vistel.space.dynamics.dynamics import ASLEEP, FIXED, FREE, HELD, Motions, Pushes, advance
from vistel.space.dynamics.motion_kernels import lost  # pyright: ignore[reportUnknownVariableType]
from vistel.space.dynamics.solids import Solids, solids
from vistel.space.earlier import resumed
from vistel.space.eyes import Eyes, eyes_of
from vistel.space.gestures import gestured
from vistel.space.guided_things import guided
from vistel.space.hands import grasp as hands
from vistel.space.holding import holding, ownership
from vistel.space.holding.displayed_hands import displayed_contacts
from vistel.space.holding.forces import Reached, due_at, hand_forces, nothing
from vistel.space.holding.sharing import Pull, with_pulls
from vistel.space.inputs import CommandInput, StepInputs, usable
from vistel.space.joints.buttons import ButtonEvent, button_events, pressed_after
from vistel.space.lamps import lamps_switched
from vistel.space.materials import bond_forces
from vistel.space.materials.dents_and_bonds import changes, remembered
from vistel.space.people import PersonState, Posed, pose_figure
from vistel.space.reach import reaching
from vistel.space.room import ROOM_RADIUS, Extra, Room
from vistel.space.state import State
from vistel.space.sticking_notes import stuck
from vistel.space.thing_views import ThingViews
from vistel.space.things.things import Thing
from vistel.space.touch import Touches
from vistel.space.view import ContactView, GhostView, GraspView, HandForce, Outcome, WorldView
from vistel.space.writing_hands import written_by_hand

DT = 1.0 / 60.0
"""Seconds of one step."""
HASH_STEPS = 60
"""Steps from one published hash to the next."""
MAX_CONTACTS = 96
APPEARING_STEPS = 45
"""A participant pushes nothing for so many steps after appearing: they may stand inside a thing, and sensors need to settle."""
RESTING_SPEED = 0.05
"""A thing that takes dents counts as resting when it moves up or down no faster than this [m/s]."""
RESTING_KEEPS = 0.8
"""Share of its motion that a resting thing which takes dents keeps in each step: it does not slide on what it dents."""


class World:
    """One room and everything in it."""

    def __init__(self, room: Room, state: State | None = None, known: Solids | None = None) -> None:
        """state: by default the room's beginning; known: arrays that are already computed for some of its things."""
        self._room = room
        self._state: State = state if state is not None else State(things=room.things, motions=_begin(room.things))
        self._solids: Solids = solids(self._state.things, known, room.joints)
        self._last: dict[str, Posed] = {}  # of the step before; saves time, is no state
        self._said = ThingViews()  # the same
        self._touches = Touches()  # the same
        self._touching: frozenset[str] = frozenset()  # the same
        self._rest: dict[str, tuple[PrimitiveSet, PlacedPrimitives, ContactArray]] = {}  # the same

    @property
    def step_number(self) -> int:
        """The last step done; 0 before the first."""
        return self._state.step

    @property
    def t_ns(self) -> int:
        """Conference time of the last step."""
        return self._state.t_ns

    @property
    def seats(self) -> int:
        """Seats of the room."""
        return len(self._room.seats)

    @property
    def extras(self) -> tuple[Extra, ...]:
        """The things that the conference file added to the room."""
        return self._room.extras

    @property
    def room(self) -> Room:
        """The room as it began."""
        return self._room

    @property
    def things_now(self) -> tuple[Thing, ...]:
        """Everything in the room, where it is now."""
        m = self._state.motions
        return tuple(replace(t, position=m.position[n], rotation=m.rotation[n]) for n, t in enumerate(self._state.things))

    @property
    def source(self) -> str:
        """Digest of the room's files; empty for the built-in room."""
        return self._room.source

    @property
    def participants(self) -> tuple[str, ...]:
        """The participants in the room, sorted."""
        return tuple(f.name for f in self._state.figures)

    @property
    def heard(self) -> dict[str, int]:
        """Capture time of the newest motion of each participant in the room [ns]; 0 before the first."""
        return {f.name: f.t_ns for f in self._state.figures}

    def answered(self, participant: str, command: str) -> bool:
        """Whether the command with this id was answered, of late."""
        return any((a.id, a.participant) == (command, participant) for a in self._state.ledger.answers)

    @property
    def reaching(self) -> frozenset[str]:
        """Who touches somebody by hand, or is touched so, or may soon move a thing, as of the last step."""
        return self._touching | reaching(self._last, self._state.motions.position[self._state.motions.mode != FIXED])

    @property
    def eyes(self) -> dict[str, Eyes]:
        """Eyes of each participant in the last step, without participants that have no motion yet."""
        return eyes_of(self._last.values())

    def snapshot(self) -> bytes:
        """The whole state; equal states give equal bytes."""
        return snapshot.encode(self._room, self._state)

    @staticmethod
    def restore(data: bytes, like: "World | None" = None) -> "World":
        """A world that goes on from `snapshot`. Raises ValueError when the bytes are none, or of another version.

        like: one of the same room a moment ago, whose things need not be made and weighed again.
        """
        room, state = snapshot.decode(data) if like is None else snapshot.decode(data, like._room, like._state.things)
        return World(room, state, like._solids if like is not None else None)

    def resumed(self, room: Room, t_ns: int) -> "World":
        """This room of an earlier meeting as `room`, at `t_ns`: things lie where they were left, and everybody has gone."""
        begins = World(room)
        return World(room, resumed(self._room, self._state, room, begins._state, t_ns), begins._solids)

    def step(self, inputs: StepInputs) -> WorldView:
        """Advance by one step of DT. Bad motions and commands are refused one by one; the step always happens."""
        before = self._state
        self._state = before.but(step=inputs.step, t_ns=inputs.t_ns, ledger=before.ledger.next_step())
        self._take_people(inputs)
        outcomes = tuple(self._obey(c) for c in inputs.commands)
        if inputs.props or self._state.tracked:
            self._state = guided(self._state, self._solids, inputs.props, DT)
        posed = {f.name: p for f in self._state.figures if (p := pose_figure(f, inputs.t_ns, self._last.get(f.name))) is not None}
        self._last = posed
        self._state = gestured(self._state, posed)

        m = self._state.motions
        bodies, rows = Bodies([p.cones for p in posed.values()]), self._solids.loose_rows
        loose = placed(self._solids.loose(m.matrices(), m.position))
        near = {name: _renamed(c, rows) for name, c in zip(posed, bodies.with_things(loose, hands.MARGIN), strict=True)}
        solids_ = self._solids
        heard = _heard(before, self._state)
        self._state = ownership.lapsed(before, self._state, heard)
        self._state = holding.let_go(before, self._state, solids_, posed, near, DT)
        drawn = bond_forces.bond_forces(self._state, solids_, posed) if self._state.bonds else []
        anchors = bond_forces.anchors(drawn, self._state, solids_) if drawn else holding.NOTHING
        self._state = holding.carry(self._state, solids_, posed, DT, anchors)
        self._state = holding.glide(self._state, solids_, DT)
        self._state = holding.take_hold(self._state, solids_, posed, near, DT)
        self._state = holding.forget_let_go(self._state, solids_, near, posed)
        self._state, claims = ownership.settled(before, self._state, heard)
        names = tuple(posed)
        skin = {(names[a], names[b]): c for (a, b), c in bodies.with_each_other().items()}
        by_hand = (
            two for two, c in skin.items() if any(posed[n].build.of_hand[i].any() for n, i in zip(two, (c.a, c.b), strict=True))
        )
        self._touching = frozenset(name for two in by_hand for name in two)
        rest = self._with_fixed(posed, bodies)
        on_loose = displayed_contacts(self._state, solids_, posed, near)
        contacts, ghosts = self._touches.step(posed, skin, rest, on_loose, solids_, MAX_CONTACTS)
        if drawn:
            self._state = self._state.but(motions=bond_forces.with_bond_impulses(self._state.motions, solids_, drawn, DT))
        self._advance(before, posed, near)
        self._bring_back()
        self._state = written_by_hand(self._state, self._solids, posed)
        self._state, torn = remembered(self._state, self._solids, posed, DT)
        reached = {name: Reached(rest[name], near[name]) for name in posed}
        stuck = bond_forces.pulls(drawn, self._state, posed)
        buttons = self._press_buttons(near)
        view = self._view(before, outcomes, contacts, ghosts, self._feel(posed, skin, reached, anchors, stuck))
        return replace(view, claims=claims, torn=torn, buttons=buttons)

    # -- people ------------------------------------------------------------------------------------------------

    def _take_people(self, inputs: StepInputs) -> None:
        figures = {f.name: f for f in self._state.figures}
        for person in inputs.people:
            old = figures.get(person.participant)
            sound = math.isfinite(person.height) and 0.5 <= person.height <= 2.6
            usual = person if sound else replace(person, height=1.75)
            figures[person.participant] = replace(old, person=usual) if old else PersonState(usual)
        for motion in inputs.motions:
            if motion.participant in figures and usable(motion.posture):
                figures[motion.participant] = figures[motion.participant].moved(motion, inputs.step)
        for name in inputs.left:
            if figures.pop(name, None) is not None:
                self._state = holding.drop(self._state, lambda g, name=name: g.participant == name)
                self._state = forgotten(self._state, self._solids, name)
                self._renew_solids()
        self._state = self._state.but(figures=tuple(figures[name] for name in sorted(figures)))

    # -- commands ----------------------------------------------------------------------------------------------

    def _obey(self, command: CommandInput) -> Outcome:
        self._state, outcome = obey(self._state, self._solids, self._room, command)
        self._renew_solids()
        return outcome

    def _renew_solids(self) -> None:
        """Arrays of the things, where these have changed."""
        if self._state.things != self._solids.things:
            self._solids = solids(self._state.things, self._solids, self._room.joints)

    # -- contacts and motion -----------------------------------------------------------------------------------

    def _with_fixed(self, posed: dict[str, Posed], bodies: Bodies) -> dict[str, ContactArray]:
        """Contacts of people with fixed things, found anew for those who have moved. bodies: of all people."""
        fixed, last = self._solids.fixed_placed, self._rest
        same = {n for n, p in posed.items() if n in last and last[n][0] is p.primitives and last[n][1] is fixed}
        moved = [name for name in posed if name not in same]
        theirs = bodies if len(moved) == len(posed) else Bodies([posed[name].cones for name in moved])
        found = dict(zip(moved, theirs.with_things(fixed), strict=True))
        self._rest = {n: last[n] if n in same else (p.primitives, fixed, found[n]) for n, p in posed.items()}
        return {name: contacts for name, (_, _, contacts) in self._rest.items()}

    def _feel(
        self,
        posed: dict[str, Posed],
        skin: dict[tuple[str, str], ContactArray],
        reached: dict[str, Reached],
        anchors: Iterable[str],
        stuck: Sequence[Pull],
    ) -> tuple[HandForce, ...]:
        """The hand forces at the end of the step. anchors: things that stick to something; stuck: pulls of bonds on hands."""
        held = [(g.participant, g.right, g.thing) for g in self._state.grasps]
        let_go = [(e.participant, e.right, e.thing) for e in self._state.let_go]
        due = due_at(self._state.step, tuple(posed))
        hands_now = hand_forces(posed, skin, reached, self._solids, self._state.motions, held, let_go, due)
        pulls = [
            p
            for p in (*holding.pulled(self._state, posed, {*anchors, *self._solids.joined.of_thing}), *stuck)
            if p.participant in due
        ]
        hands_now = with_pulls(hands_now, pulls, posed)
        felt = {(h.participant, h.right) for h in hands_now}
        waiting = {hand for hand in self._state.felt if hand[0] in posed and hand[0] not in due}
        ended = [nothing(hand) for hand in self._state.felt if hand not in felt | waiting]
        self._state = self._state.but(felt=tuple(sorted(felt | waiting)))
        return tuple(sorted([*hands_now, *ended], key=lambda h: (h.participant, h.right)))

    def _advance(self, begin: State, posed: dict[str, Posed], near: dict[str, ContactArray]) -> None:
        free = (self._state.motions.mode == FREE) | (self._state.motions.mode == ASLEEP)
        ignored = {(e.participant, e.right, self._index(e.thing)) for e in self._state.let_go}
        parts: list[tuple[NDArray[np.int64], F64, F64, F64, F64]] = []
        for name in sorted(posed):
            p, c = posed[name], near[name]
            if len(c) == 0 or self._state.step - p.figure.appeared < APPEARING_STEPS:
                continue
            thing = self._solids.owner[c.b]
            chosen = free[thing] & (c.depth > -0.004)
            for who, right, n in sorted(ignored):
                if who == name:
                    hand = (p.build.digit[c.a] >= 0) & (p.build.digit[c.a] // 6 == int(right))
                    chosen &= ~(hand & (thing == n))
            gap = self._solids.give[thing[chosen]] - c.depth[chosen]
            parts.append((thing[chosen], c.point[chosen], c.normal[chosen], gap, p.velocity[c.a[chosen]]))
        pushes = Pushes(*(np.concatenate(x) for x in zip(*parts, strict=True))) if parts else Pushes.none()
        before = self._state.motions
        moved, _ = advance(self._solids, before, pushes, DT)
        moved = _as_before(moved, before, self._solids.boards & (before.mode == ASLEEP))
        moved = stuck(begin, self._state, _settled(moved, self._solids), self._solids, self._room.shell)
        self._state = self._state.but(motions=moved)

    def _bring_back(self) -> None:
        """Things outside of the room, or with invalid numbers, return to their first pose."""
        m = self._state.motions
        is_lost: Any = lost(m.position, m.rotation, m.velocity, m.spin, ROOM_RADIUS + 1.0, 10.0)
        rows = np.flatnonzero(np.asarray(is_lost) & (m.mode != HELD))
        if len(rows) == 0:
            return
        m = m.copy()
        for n in rows:
            start = self._solids.things[int(n)]
            m.position[n], m.rotation[n], m.velocity[n], m.spin[n] = start.position, start.rotation, 0.0, 0.0
            m.mode[n], m.still[n] = FIXED if start.fixed else FREE, 0
        self._state = self._state.but(motions=m)

    def _press_buttons(self, near: dict[str, ContactArray]) -> tuple[ButtonEvent, ...]:
        """What has become of buttons in this step; their lamps change colour. near: contacts of people with loose things."""
        s = self._state
        events = button_events(s.pressed, self._solids.joined, s.motions.position, s.motions.rotation)
        if not events:
            return ()
        leading = {t.thing: t.measured.led_by for t in s.tracked} | {g.thing: g.participant for g in s.glides}
        events = tuple(replace(e, participant=leading.get(e.thing) or self._nearest(near, self._index(e.thing))) for e in events)
        lit = {e.joint for e in events if e.pressed}
        things = lamps_switched(s.things, self._room, [j for j in self._solids.joined.joints if j.id in lit])
        self._state = replace(s, things=things, pressed=pressed_after(s.pressed, events))
        self._solids = solids(things, self._solids, self._room.joints)
        return events

    def _nearest(self, near: dict[str, ContactArray], n: int) -> str:
        """Who is nearest to thing n; empty when nobody is within reach."""
        best, deepest = "", -hands.MARGIN
        for name in sorted(near):
            depths = near[name].depth[self._solids.owner[near[name].b] == n]
            if len(depths) and float(depths.max()) > deepest:
                best, deepest = name, float(depths.max())
        return best

    # -- the view ------------------------------------------------------------------------------------------

    def _view(
        self,
        before: State,
        outcomes: tuple[Outcome, ...],
        contacts: tuple[ContactView, ...],
        ghosts: tuple[GhostView, ...],
        felt: tuple[HandForce, ...],
    ) -> WorldView:
        s = self._state
        grasps = tuple(
            GraspView(g.participant, g.right, g.thing, *g.lie(s.t_ns), g.since_ns, g.fingers, *g.seen(s.t_ns)) for g in s.grasps
        )
        digest = snapshot.digest(self._room, s) if s.step % HASH_STEPS == 0 else 0
        return WorldView(
            s.step,
            s.t_ns,
            s.things,
            s.things != before.things,
            self._said.states(before, s),
            contacts,
            ghosts,
            grasps,
            tuple(f.name for f in s.figures),
            outcomes,
            digest,
            felt,
            s.dents,
            s.bonds,
            *changes(before, s),
            selected=s.selected,
            strokes=s.strokes,
            signals=s.signals,
        )

    # -- small things ------------------------------------------------------------------------------------------

    def _index(self, thing: str) -> int:
        return self._state.rows[thing]


def _renamed(near: ContactArray, rows: NDArray[np.int64]) -> ContactArray:
    """Contacts with the index of each thing's primitive among all primitives."""
    if len(near) == 0:
        return near
    return replace(near, b=rows[near.b].astype(np.int32))


def _heard(before: State, now: State) -> frozenset[str]:
    """Participants with a new motion."""
    was = {f.name: (f.seq, f.t_ns) for f in before.figures}
    return frozenset(f.name for f in now.figures if was.get(f.name) != (f.seq, f.t_ns))


def _begin(things: tuple[Thing, ...]) -> Motions:
    """Things as they begin: loose ones asleep where the room puts them."""
    n = len(things)
    return Motions(
        np.array([t.position for t in things]).reshape(n, 3),
        np.array([t.rotation for t in things]).reshape(n, 4),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.array([FIXED if t.fixed else ASLEEP for t in things], np.int64),
        np.zeros(n, np.int64),
    )


def _as_before(m: Motions, before: Motions, rows: NDArray[np.bool_]) -> Motions:
    """Things of these rows have not moved: who writes on a board that stands does not push it away."""
    if not rows.any():
        return m
    out = m.copy()
    for name in Motions.__dataclass_fields__:
        getattr(out, name)[rows] = getattr(before, name)[rows]
    return out


def _settled(m: Motions, s: Solids) -> Motions:
    """Things that take dents come to rest: they do not roll on as their undented shape would."""
    soft = (s.give > 0.0) & (m.mode == FREE)
    if not soft.any():
        return m
    lying = soft & (np.abs(m.velocity[:, 1]) < RESTING_SPEED)
    out = m.copy()
    out.spin[lying] *= RESTING_KEEPS
    out.velocity[lying] *= RESTING_KEEPS
    return out
