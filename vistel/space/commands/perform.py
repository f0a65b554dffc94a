"""Doing commands: each gives the state that follows, or is refused in one line for the person who asked."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from vistel.host import HOST
from vistel.space.actions import Action, RaiseHand, React, Refused, absent
from vistel.space.commands import (
    choosing,
    denting,
    edges,
    lining,
    moving_on_joint,
    noting,
    placing,
    presenting,
    shaping,
    signalling,
    writing,
)
from vistel.space.commands.context import PERFORMERS, Context, exchanged
from vistel.space.dynamics.solids import Solids
from vistel.space.holding import ownership
from vistel.space.inputs import CommandInput
from vistel.space.room import Room
from vistel.space.state import State
from vistel.space.view import Outcome

PERFORMING = (choosing, denting, edges, lining, moving_on_joint, noting, placing, presenting, shaping, signalling, writing)
"""The modules whose functions are under `context.performs`."""


OF_FIGURES = (RaiseHand, React)
"""What is shown at the figure of who asks, so that the host, who has none, cannot ask for it."""


def obey(state: State, s: Solids, room: Room, command: CommandInput) -> tuple[State, Outcome]:
    """The state after a command, and what became of it. s: of the state's things; room: as it began.

    A command that was answered before is answered again and not done again.
    """
    if (known := state.ledger.answer_to(command)) is not None:
        return state, known
    spent = state.ledger.spend(command.participant)
    if spent is None:
        return state, Outcome(command.id, command.participant, False, "too many commands; wait a second", state.step)
    reason, things = "", ()
    try:
        state, things = _done(state, s, room, command)
    except Refused as e:
        reason = str(e)
        state = ownership.rejected(state, command.participant, e.thing)
    outcome = Outcome(command.id, command.participant, not reason, reason, state.step, things)
    return state.but(ledger=spent.with_answer(outcome)), outcome


def forgotten(state: State, s: Solids, participant: str) -> State:
    """The state after a participant has left: their selection and history are dropped, and what showed their screen goes. s: of the
    state's things."""
    if live := presenting.live_of(state, participant):
        state = exchanged(state, s, live, ())
    return replace(
        state,
        history=state.history.without(participant),
        selected=tuple(chosen for chosen in state.selected if chosen[0] != participant),
    )


def _done(state: State, s: Solids, room: Room, command: CommandInput) -> tuple[State, tuple[str, ...]]:
    if not command.id:
        raise Refused("the command has no id; give each command its own")
    seen = any(f.name == command.participant for f in state.figures)
    if not seen and (command.participant != HOST or isinstance(command.action, OF_FIGURES)):
        raise Refused(absent(command.participant))
    if command.action is None:
        raise Refused("the command asks for nothing this world can do")
    for number in _numbers(command.action):
        if not math.isfinite(number):
            raise Refused("the command holds a number that is not finite")
    return PERFORMERS[type(command.action)](Context(state, s, room, command.participant), command.action)


def _numbers(action: Action) -> Iterable[float]:
    for value in vars(action).values():
        if isinstance(value, float):
            yield value
        elif isinstance(value, np.ndarray):
            yield from np.asarray(value, np.float64).ravel().tolist()
