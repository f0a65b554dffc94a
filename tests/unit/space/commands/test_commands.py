"""Whatever people ask of the world is done or refused in one line, and done the same again."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from talking import Talk
from test_world_steps import BATON, STEP_NS

from vistel.space import actions as ask
from vistel.space.actions import Action
from vistel.space.arguments import THIS, Along, Shown, Towards, Where, Which
from vistel.space.commands.names import SHAPES
from vistel.space.inputs import StepInputs
from vistel.space.world import World


def test_a_world_restored_between_commands_goes_on_the_same() -> None:
    talk = Talk()
    said: list[Action] = [
        ask.Create("cone"),
        ask.Bend(Which(BATON), 1.0),
        ask.Scale(Which("box"), 1.3),
        ask.MoveBy(Which("can"), Towards.UP, 0.3),
        ask.Select(Which("tile")),
        ask.Move(Which("can"), np.array([0.08, 0.8, 0.02]), np.array([0, 0, 0, 1.0])),
        ask.Attach(Which("box"), Which("can")),
        ask.Undo(),
        ask.Redo(),
        ask.Paint(THIS, 0x123456FF),
        ask.Undo(),
        ask.Copy(Which("ball")),
        ask.Undo(),
        ask.Redo(),
        ask.Dent(Which("ball")),
        ask.Sharpen(Which("cone"), 0.5),
        ask.Hide(Which("tile")),
        ask.Align(Which(every=True)),
        ask.Show(),
        ask.Undo(),
        ask.Reset(),
    ]
    for action in said:
        talk.say(action)
        again = World.restore(talk.play.world.snapshot())
        assert again.snapshot() == talk.play.world.snapshot()
        for k in range(3):
            inputs = StepInputs(talk.play.k + 1, (talk.play.k + 1) * STEP_NS)
            view = again.step(inputs)
            mine = talk.play.step({})
            assert [s.position.tobytes() for s in view.states] == [s.position.tobytes() for s in mine.states], (action, k)
        assert again.snapshot() == talk.play.world.snapshot()


NUMBER = st.one_of(st.floats(-3.0, 3.0), st.floats(), st.sampled_from([0.0, 1e-9, 1e9, -1e9]))
WHICH = st.builds(
    Which,
    st.sampled_from(["", "", "box", BATON, "table", "unicorn", "cone-2"]),
    st.sampled_from(["", "ball", "red"]),
    st.sampled_from(["", "cylinder"]),
    st.sampled_from(["", "white"]),
    st.sampled_from([None, None, *Shown]),
    st.booleans(),
)
COLOUR = st.integers(0, 0xFFFFFFFF)
PLACE = st.tuples(NUMBER, NUMBER, NUMBER).map(np.array)
ANYTHING = st.one_of(
    st.builds(ask.Select, WHICH, st.booleans()),
    st.builds(ask.Move, WHICH, PLACE, st.tuples(NUMBER, NUMBER, NUMBER, NUMBER).map(np.array)),
    st.builds(ask.MoveBy, WHICH, st.sampled_from(Towards), NUMBER), st.builds(ask.Place, WHICH, st.sampled_from(Where)),
    st.builds(ask.Turn, WHICH, NUMBER, st.sampled_from(Along)),
    st.builds(ask.Scale, WHICH, NUMBER, st.sampled_from([None, *Along])), st.builds(ask.Bend, WHICH, NUMBER),
    st.builds(ask.Twist, WHICH, NUMBER), st.builds(ask.Paint, WHICH, COLOUR), st.builds(ask.Harden, WHICH, NUMBER),
    st.builds(ask.Copy, WHICH), st.builds(ask.Create, st.sampled_from([*SHAPES, "", "sphinx"]), NUMBER, COLOUR),
    st.builds(ask.Delete, WHICH), st.builds(ask.Grip, WHICH), st.builds(ask.Release, WHICH),
    st.builds(ask.Attach, WHICH, WHICH), st.builds(ask.Detach, WHICH), st.just(ask.Undo()), st.just(ask.Redo()),
    st.just(ask.Stop()), st.just(ask.Reset()), st.builds(ask.Sharpen, WHICH, NUMBER),
    st.builds(ask.Open, WHICH, NUMBER), st.builds(ask.Dent, WHICH, NUMBER),
    st.builds(ask.Hide, WHICH), st.builds(ask.Show, WHICH), st.builds(ask.Align, WHICH),
)  # fmt: skip


@settings(max_examples=100)
@given(st.lists(ANYTHING, min_size=1, max_size=18))
def test_whatever_is_asked_is_done_or_refused_in_one_line_and_the_room_stays_sound(asked: list[Action]) -> None:
    talk = Talk()
    for action in asked:
        outcome = talk.say(action)
        assert outcome.done != bool(outcome.reason)
        assert "\n" not in outcome.reason
    state = talk.play.world._state  # pyright: ignore[reportPrivateUsage]
    for values in (state.motions.position, state.motions.rotation, state.motions.velocity, state.motions.spin):
        assert np.isfinite(values).all()
    assert len({t.id for t in state.things}) == len(state.things) == len(state.motions.mode)
    assert World.restore(talk.play.world.snapshot()).snapshot() == talk.play.world.snapshot()
