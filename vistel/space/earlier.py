"""A room of an earlier meeting, resumed: things are where they were left, everybody has gone, and now is now."""

import numpy as np

from vistel.space.dynamics.dynamics import FREE, HELD, Motions
from vistel.space.history import History
from vistel.space.ledger import Ledger
from vistel.space.room import Room
from vistel.space.state import State
from vistel.space.things.things import Thing


def resumed(then: Room, state: State, room: Room, begin: State, t_ns: int) -> State:
    """The state of `then` in `room`, at `t_ns`. begin: how `room` begins.

    What stands fast, and what `then` did not have, is as `room` begins; what only `then` began with goes, and so does what showed
    somebody's screen. Answers to commands stay, so that none is done twice.
    """
    things: list[Thing] = []
    moved: list[tuple[Motions, int]] = []
    for n, thing in enumerate(state.things):
        own = room.by_id.get(thing.id)
        if own is None and (thing.id in then.by_id or (thing.pages is not None and thing.pages.live)):
            continue
        if own is not None and own.fixed:
            things.append(own)
            moved.append((begin.motions, begin.rows[thing.id]))
        else:
            things.append(thing)
            moved.append((state.motions, n))
    for thing in room.things:
        if thing.id not in then.by_id and thing.id not in state.rows:
            things.append(thing)
            moved.append((begin.motions, begin.rows[thing.id]))
    here = {thing.id for thing in things}
    m = Motions(*(np.array([getattr(source, name)[n] for source, n in moved]) for name in Motions.__dataclass_fields__))
    m.mode[m.mode == HELD] = FREE
    return State(
        tuple(things),
        m,
        state.step,
        t_ns,
        ledger=Ledger(state.ledger.answers),
        dents=tuple(d for d in state.dents if d.thing in here),
        bonds=tuple(b for b in state.bonds if b.thing in here and b.body in here),
        marks=state.marks,
        history=History(),
        strokes=tuple(k for k in state.strokes if k.board in here),
    )
