"""Things that are led from outside, step by step: by a receiver on them, or by somebody's mouse.

What a mouse has led is a doing of whoever led it: it can be taken back like a command (`commands.history`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from vistel.space.dynamics.dynamics import FREE, HELD
from vistel.space.dynamics.solids import Solids
from vistel.space.history import Change, Stood
from vistel.space.holding import holding
from vistel.space.inputs import PropInput
from vistel.space.state import State
from vistel.space.things.props import Tracked, heard


def followed(state: State, s: Solids, news: Iterable[PropInput], dt: float) -> State:
    """The state with led things where they are led to; what was let go of, or of which nothing is heard, is free. dt: [s]."""
    was = holding.tracked_things(state)
    tracked, over = heard(state.tracked, news, [t.id for t in s.things if not t.fixed], state.t_ns)
    for t in tracked:
        if t.thing not in was:
            state = holding.woken_round(state, s, state.rows[t.thing])  # what lay on it
    m = state.motions.copy()
    begun: list[Tracked] = []
    for t in tracked:
        n = state.rows[t.thing]
        if t.thing not in was and t.news.led_by:
            begun.append(replace(t, stood=(m.position[n].copy(), m.rotation[n].copy())))
        holding.guide(m, n, *t.at(state.t_ns), dt)
        if t.thing not in was:
            m.velocity[n], m.spin[n] = 0.0, 0.0  # where it lay before, it never was
        m.mode[n], m.still[n] = HELD, 0
    done: list[Change] = []
    for t in over:
        n = state.rows[t.thing]
        m.velocity[n], m.spin[n] = 0.0, 0.0
        if t.news.let_go:
            # From a step ago on it goes by its own speed, which this step still moves it by.
            m.position[n], m.rotation[n] = t.at(state.t_ns, dt)
            m.velocity[n], m.spin[n] = t.news.velocity, t.news.spin
        if not holding.holders(state, t.thing):
            m.mode[n], m.still[n] = FREE, 0
        if t.news.led_by and t.stood is not None and any(f.name == t.news.led_by for f in state.figures):
            thing = s.things[n]
            after = Stood(thing, m.position[n].copy(), m.rotation[n].copy())
            done.append(Change(t.news.led_by, (Stood(thing, *t.stood),), (after,)))
    history = state.history
    for change in done:
        history = history.with_change(change)
    known = {t.thing: t for t in begun}
    return replace(state, motions=m, tracked=tuple(known.get(t.thing, t) for t in tracked), history=history)
