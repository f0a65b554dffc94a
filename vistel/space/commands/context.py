"""The room at the time of a command, and the state that follows a change of things."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.actions import Action, Refused
from vistel.space.arguments import Which
from vistel.space.commands.reference import Speaker, meant
from vistel.space.dynamics.dynamics import FREE, HELD, Motions
from vistel.space.dynamics.solids import Solids, outline
from vistel.space.history import Change, PlacedThing
from vistel.space.holding import holding
from vistel.space.memory.dents import DentRecord
from vistel.space.people import pose_figure
from vistel.space.room import Room
from vistel.space.state import State
from vistel.space.things.things import Thing


@dataclass(frozen=True)
class Context:
    """The room as it is when somebody asks."""

    state: State
    solids: Solids
    room: Room
    who: str

    @cached_property
    def speaker(self) -> Speaker:
        """The participant who asks."""
        figure = next((f for f in self.state.figures if f.name == self.who), None)  # the host has none
        selected = dict(self.state.selected).get(self.who, ())
        held = tuple(g.thing for g in self.state.grasps if g.participant == self.who)
        posed = pose_figure(figure, self.state.t_ns) if figure is not None else None
        return Speaker(self.who, posed, selected, held)

    def rows(self, which: Which, *, hidden: bool = False, among: Sequence[int] = ()) -> list[int]:
        """hidden: of the hidden things. among: rows of those one of which is meant; none given: of all."""
        all_of = self.state.things
        rows = [n for n in among or range(len(all_of)) if all_of[n].hidden or not hidden]
        # As if they were visible: hidden things are meant.
        things = [replace(all_of[n], hidden=False) for n in rows] if hidden else [all_of[n] for n in rows]
        position, radius = self.state.motions.position[rows], self.solids.radius[rows]
        return [rows[k] for k in meant(which, self.speaker, things, position, radius)]

    def one(self, which: Which, among: Sequence[int] = ()) -> int:
        """The row of the one thing that is meant; among: see `rows`. Raises Refused where none is, or several are."""
        rows = self.rows(which, among=among)
        if len(rows) > 1:
            raise Refused("this can be done with one thing at a time")
        return rows[0]

    def mine(self, which: Which, *, tracked: bool = False) -> list[int]:
        """Rows of things that are the speaker's to change. tracked: also those that follow a tracker. Raises Refused."""
        rows = self.rows(which)
        for n in rows:
            self.check_mine(n, tracked=tracked)
        return rows

    def check_mine(self, n: int, *, tracked: bool = False, held: bool = False) -> None:
        """Raises Refused for a thing that is not the speaker's to change. held: even when somebody else holds it."""
        thing = self.state.things[n]
        if thing.fixed:
            raise Refused(f"the {thing.name} is fixed to the room")
        others = [h for h in holding.holders(self.state, thing.id) if h != self.who]
        if others and not held:
            raise Refused(f"the {thing.name} is held by {others[0]}", thing.id)
        led = next((t.measured.led_by for t in self.state.tracked if t.thing == thing.id), None)
        if led is not None and not tracked:
            how = f"is on the mouse of {led}" if led else "follows its own tracker; move the real one"
            raise Refused(f"the {thing.name} {how}")

    def loose(self, which: Which, *, on_joints: bool = False) -> list[int]:
        """The same, and in nobody's hand. on_joints: also what hangs on a joint."""
        rows = self.mine(which)
        for n in rows:
            thing = self.state.things[n]
            if not on_joints:
                self.check_free(n)
            if holding.holders(self.state, thing.id):
                raise Refused(f"the {thing.name} is in your own hand; let go of it first")
        return rows

    def check_free(self, n: int) -> None:
        """Raises Refused for a thing that hangs on a joint."""
        thing = self.state.things[n]
        if thing.id in self.solids.joined.of_thing:
            raise Refused(f"the {thing.name} hangs on a joint; it can be opened and closed, pushed and pulled")

    def placed(self, n: int) -> PlacedThing:
        """A thing and where it stands."""
        m = self.state.motions
        return PlacedThing(self.state.things[n], m.position[n].copy(), m.rotation[n].copy())

    def dents(self, n: int) -> tuple[DentRecord, ...]:
        """The dents of a thing."""
        return tuple(d for d in self.state.dents if d.thing == self.state.things[n].id)

    def ids(self, *, put_away: bool = True) -> set[str]:
        """All ids in use, those of parts and of what can be brought back as well; put_away: also those of panels that can be."""
        past = [s.thing for c in (*self.state.history.done, *self.state.history.undone) for s in (*c.before, *c.after)]
        kept = [t for t in past if put_away or t.pages is None]
        return {t.id for t in _with_parts([*self.state.things, *kept])}


Answer = tuple[State, tuple[str, ...]]
"""The state that follows, and the ids of the things that a command was done to or made."""

A = TypeVar("A", bound=Action)

PERFORMERS: dict[type[Action], Callable[[Context, Any], Answer]] = {}
"""What each action does."""


def performs(action: type[A]) -> Callable[[Callable[[Context, A], Answer]], Callable[[Context, A], Answer]]:
    """The function below does this. It raises Refused, with one line for the person who asked."""

    def registered(function: Callable[[Context, A], Answer]) -> Callable[[Context, A], Answer]:
        PERFORMERS[action] = function
        return function

    return registered


def _with_parts(things: Iterable[Thing]) -> Iterable[Thing]:
    for thing in things:
        yield thing
        yield from _with_parts(p.thing for p in thing.parts)


def exchanged(state: State, s: Solids, before: Sequence[int], after: Sequence[PlacedThing]) -> State:
    """The state with `after` in place of the rows `before`; what keeps its id keeps its row and who holds it."""
    for n in before:
        state = holding.woken_round(state, s, n)
    new = {x.thing.id: x for x in after}
    gone = {state.things[n].id for n in before} - new.keys()
    as_before = {id(thing) for thing in state.things}
    reshaped = {x.thing.id for x in after if id(x.thing) not in as_before}
    state = holding.drop(state, lambda g: g.thing in gone)
    kept = [n for n, t in enumerate(state.things) if t.id not in gone]
    added = [x for x in after if x.thing.id not in state.rows]
    things = [new[state.things[n].id].thing if state.things[n].id in new else state.things[n] for n in kept]
    m = state.motions
    zero = np.zeros((len(added), 3))
    m = Motions(
        np.concatenate([m.position[kept], np.array([x.position for x in added]).reshape(-1, 3)]),
        np.concatenate([m.rotation[kept], np.array([x.rotation for x in added]).reshape(-1, 4)]),
        np.concatenate([m.velocity[kept], zero]),
        np.concatenate([m.spin[kept], zero]),
        np.concatenate([m.mode[kept], np.full(len(added), FREE, np.int64)]),
        np.concatenate([m.still[kept], np.zeros(len(added), np.int64)]),
    )
    state = replace(
        state,
        things=(*things, *(x.thing for x in added)),
        motions=m,
        dents=(
            *(d for d in state.dents if d.thing not in gone | reshaped),
            *(d for x in after if x.thing.id in reshaped for d in x.dents),
        ),
        bonds=tuple(b for b in state.bonds if b.thing not in gone | reshaped),
        strokes=tuple(k for k in state.strokes if k.board not in gone) if gone else state.strokes,
        glides=tuple(g for g in state.glides if g.thing not in gone | new.keys()),
        selected=tuple((who, tuple(t for t in ids if t not in gone)) for who, ids in state.selected),
    )
    for x in after:
        state = _placed(state, x)
    return state


def _placed(state: State, x: PlacedThing) -> State:
    """A thing stands still at a place, unless it is held."""
    n = state.rows[x.thing.id]
    if state.motions.mode[n] == HELD and holding.holders(state, x.thing.id):
        return state
    m = state.motions.copy()
    m.position[n], m.rotation[n], m.velocity[n], m.spin[n] = x.position, x.rotation, 0.0, 0.0
    m.mode[n], m.still[n] = FREE, 0
    return state.but(motions=m)


def changed(context: Context, before: Sequence[int], after: Sequence[PlacedThing]) -> State:
    """The same, remembered as the speaker's doing."""
    as_before = {id(x.thing) for x in after}
    was = tuple(
        context.placed(n) if id(context.state.things[n]) in as_before else replace(context.placed(n), dents=context.dents(n))
        for n in before
    )
    state = exchanged(context.state, context.solids, before, after)
    gone = tuple(k for k in context.state.strokes if k.board not in state.rows)
    return state.but(history=state.history.with_change(Change(context.who, was, tuple(after), rubbed=gone)))


def lowest(thing: Thing, position: F64, rotation: F64) -> float:
    """Height of a thing's lowest point above the floor [m]. position (3,), rotation (4,): in the room."""
    one = outline(thing)
    heights = one.contact_point @ matrix_from_quaternion(rotation)[1] - one.contact_point_radius
    return float(position[1] + heights.min())


def on_its_foot(old: PlacedThing, thing: Thing) -> PlacedThing:
    """A thing in the place of another one, its lowest point as high."""
    rise = lowest(old.thing, old.position, old.rotation) - lowest(thing, old.position, old.rotation)
    return PlacedThing(thing, old.position + np.array([0.0, rise, 0.0]), old.rotation)
