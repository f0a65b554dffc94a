"""Things guided from outside, step by step: by a receiver on them, or by a participant's mouse.

A motion by mouse counts as a change by that participant, who can undo it like a command (`vistel.space.history`).
"""

from collections.abc import Iterable
from dataclasses import replace

from vistel.arrays import F64
from vistel.space.dynamics.dynamics import FREE, HELD, Motions
from vistel.space.dynamics.solids import Solids
from vistel.space.history import Change, PlacedThing
from vistel.space.holding import holding, on_joints
from vistel.space.inputs import PropInput
from vistel.space.state import State
from vistel.space.things.props import Tracked, received


def guided(state: State, s: Solids, measured: Iterable[PropInput], dt: float) -> State:
    """The state with guided things at their measured poses. Things that were let go, or without new input, are free. dt: [s]."""
    was = holding.tracked_things(state)
    tracked, over = received(state.tracked, measured, [t.id for t in s.things if not t.fixed], state.t_ns)
    for t in tracked:
        if t.thing not in was:
            state = holding.woken_round(state, s, state.rows[t.thing])  # things that lay on it
    m = state.motions.copy()
    begun: list[Tracked] = []
    for t in tracked:
        n = state.rows[t.thing]
        if t.thing not in was and t.measured.led_by:
            begun.append(replace(t, begun_at=(m.position[n].copy(), m.rotation[n].copy())))
        holding.guide(m, n, *_pose(s, m, t, state.t_ns), dt)
        if t.thing not in was:
            m.velocity[n], m.spin[n] = 0.0, 0.0  # its former pose says nothing about its speed
        m.mode[n], m.still[n] = HELD, 0
    done: list[Change] = []
    for t in over:
        n = state.rows[t.thing]
        m.velocity[n], m.spin[n] = 0.0, 0.0
        if t.measured.let_go:
            # Its pose of one step ago: this step moves it on by its own speed.
            m.position[n], m.rotation[n] = _pose(s, m, t, state.t_ns, dt)
            m.velocity[n], m.spin[n] = t.measured.velocity, t.measured.spin
        if not holding.holders(state, t.thing):
            m.mode[n], m.still[n] = FREE, 0
        if t.measured.led_by and t.begun_at is not None and any(f.name == t.measured.led_by for f in state.figures):
            thing = s.things[n]
            after = PlacedThing(thing, m.position[n].copy(), m.rotation[n].copy())
            done.append(Change(t.measured.led_by, (PlacedThing(thing, *t.begun_at),), (after,)))
    history = state.history
    for change in done:
        history = history.with_change(change)
    known = {t.thing: t for t in begun}
    return state.but(motions=m, tracked=tuple(known.get(t.thing, t) for t in tracked), history=history)


def _pose(s: Solids, m: Motions, t: Tracked, t_ns: int, before_s: float = 0.0) -> tuple[F64, F64]:
    """Where a guided thing is at `t_ns`: on its joint, if it hangs on one; a button that a mouse has taken is pressed."""
    k = s.joined.of_thing.get(t.thing)
    if k is not None and s.joined.joints[k].button is not None and t.measured.led_by:
        return s.joined.posed(k, s.joined.joints[k].lower, m.position, m.rotation)
    return on_joints.led(s, m, t.thing, *t.at(t_ns, before_s))
