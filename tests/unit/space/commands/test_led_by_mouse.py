"""Things led by a mouse: free from the moment they are let go of, and one doing that can be taken back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from talking import ROOM, done, refused, stands
from test_world_steps import STEP_NS, Play

from vistel.space import actions as ask
from vistel.space.arguments import Towards, Which
from vistel.space.inputs import CommandInput, PropInput, StepInputs
from vistel.space.things.props import SILENT_NS
from vistel.space.view import Outcome, WorldView
from vistel.space.world import DT, World

UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])
START = ROOM.thing("ball").position
STILL, UP = np.zeros(3), np.array([0.0, 1.0, 0.0])


class Drag(Play):
    """Ann and Bob stand far from the table; somebody leads the ball."""

    def __init__(self) -> None:
        super().__init__("ann", "bob")
        self.step({"ann": stands(0.0, -2.2, 0.0), "bob": stands(0.0, 2.2, np.pi)})
        self.asked = 0

    def put(self, *props: PropInput, commands: tuple[CommandInput, ...] = ()) -> WorldView:
        self.k += 1
        inputs = StepInputs(self.k, self.k * STEP_NS, (), (), (), commands, props)
        self.inputs.append(inputs)
        self.views.append(self.world.step(inputs))
        return self.views[-1]

    def lead(self, place: np.ndarray, velocity: np.ndarray = STILL, who: str = "ann", let_go: bool = False) -> WorldView:
        """One step in which a mouse of `who` says that the ball is there."""
        t_ns = (self.k + 1) * STEP_NS
        return self.put(PropInput("ball", place, UPRIGHT, t_ns, velocity, STILL, who, let_go))

    def say(self, action: ask.Action, who: str = "ann") -> Outcome:
        self.asked += 1
        return self.put(commands=(CommandInput(f"c{self.asked}", who, action),)).outcomes[-1]

    @property
    def ball(self) -> np.ndarray:
        return self.thing("ball").position

    def drawn_up(self, height: float = 0.4, who: str = "ann") -> np.ndarray:
        """The ball, drawn up in a third of a second, stands there for a moment."""
        for k in range(1, 21):
            self.lead(START + height * k / 20 * UP, who=who)
        top = START + height * UP
        for _ in range(5):
            self.lead(top, who=who)
        return top


def test_what_is_let_go_of_falls_at_once_and_without_a_word_after_half_a_second() -> None:
    told, lost = Drag(), Drag()
    top = told.drawn_up()
    lost.drawn_up()
    told.lead(top, let_go=True)
    assert told.ball == pytest.approx(top, abs=0.01)
    silent = 0
    for k in range(1, 60):
        told.put()
        lost.put()
        fallen = 0.5 * 9.81 * (k * DT) ** 2
        if top[1] - fallen > 1.0:
            assert top[1] - told.ball[1] == pytest.approx(fallen, abs=0.02 + 0.1 * fallen)
        silent += lost.ball[1] == pytest.approx(top[1], abs=1e-9)
    assert silent == pytest.approx(SILENT_NS / STEP_NS, abs=2)


@given(st.floats(-2.5, 2.5), st.floats(-1.0, 2.0), st.floats(-2.5, 2.5), st.integers(0, 3))
@settings(max_examples=10)
def test_what_is_thrown_goes_on_as_fast_as_it_was_led_without_a_jump(x: float, y: float, z: float, late: int) -> None:
    play, v = Drag(), np.array([x, y, z])
    at = START + 0.5 * UP
    places = []
    for k in range(12):
        play.lead(at + k * DT * v, v)
        places.append(play.ball.copy())
    for _ in range(late):  # messages that come late: the last one's speed carries it on
        play.put()
        places.append(play.ball.copy())
    play.lead(at + (11 + late + 1) * DT * v, v, let_go=True)
    places.append(play.ball.copy())
    for _ in range(6):
        play.put()
        places.append(play.ball.copy())
    steps = np.diff(places, axis=0) / DT
    # Between two steps its speed changes by no more than weight and air make of it.
    assert np.abs(steps[1:] - v).max() < 9.81 * 8 * DT + 0.15 + 0.02 * np.abs(v).max()
    assert np.abs(np.diff(steps[1:], axis=0)).max() < 9.81 * DT + 0.15 + 0.02 * np.abs(v).max()


def test_a_drag_is_one_doing_that_is_taken_back_and_done_again() -> None:
    play = Drag()
    done(play.say(ask.Paint(Which("box"), 0xFF0000FF)))
    top = play.drawn_up()
    play.lead(top, let_go=True)
    for _ in range(120):
        play.put()
    assert play.ball[1] < top[1] - 0.2
    assert done(play.say(ask.Undo())) == ("ball",)
    assert play.ball == pytest.approx(START, abs=2e-3)
    assert done(play.say(ask.Redo())) == ("ball",)
    assert play.ball == pytest.approx(top, abs=0.02)
    assert done(play.say(ask.Undo())) == ("ball",)
    assert done(play.say(ask.Undo())) == ("box",)  # one drag was one doing
    assert "nothing" in refused(play.say(ask.Undo()))


def test_one_whose_last_word_was_lost_can_be_taken_back_as_well() -> None:
    play = Drag()
    play.drawn_up()
    for _ in range(60):
        play.put()
    assert done(play.say(ask.Undo())) == ("ball",)
    assert play.ball == pytest.approx(START, abs=2e-3)


def test_it_is_the_doing_of_whose_mouse_it_was_and_of_nobody_who_is_not_there() -> None:
    play = Drag()
    top = play.drawn_up(who="bob")
    play.lead(top, who="bob", let_go=True)
    assert "nothing" in refused(play.say(ask.Undo(), "ann"))
    assert done(play.say(ask.Undo(), "bob")) == ("ball",)
    stranger = Drag()
    stranger.lead(stranger.drawn_up(who="eve"), who="eve", let_go=True)
    assert not stranger.world._state.history.done


def test_what_was_done_to_it_meanwhile_stays_when_the_drag_is_taken_back() -> None:
    play = Drag()
    top = play.drawn_up()
    done(play.say(ask.Copy(Which("box")), "bob"))
    play.lead(top, let_go=True)
    done(play.say(ask.Paint(Which("ball"), 0x00FF00FF), "bob"))
    assert "changed since" in refused(play.say(ask.Undo()))
    done(play.say(ask.Undo(), "bob"))
    done(play.say(ask.Undo()))
    assert play.ball == pytest.approx(START, abs=2e-3)


def test_while_it_is_on_a_mouse_no_command_moves_it_and_the_refusal_says_whose_mouse() -> None:
    play = Drag()
    play.drawn_up()
    assert refused(play.say(ask.MoveBy(Which("ball"), Towards.UP, 0.1), "bob")) == "the yellow ball is on the mouse of ann"


def test_the_first_of_two_mice_has_it_until_it_lets_go_and_a_tracker_comes_before_both() -> None:
    play = Drag()
    top = play.drawn_up()
    aside = START + np.array([0.3, 0.3, 0.0])
    t_ns = (play.k + 1) * STEP_NS
    anns = PropInput("ball", top, UPRIGHT, t_ns, STILL, STILL, "ann")
    bobs = PropInput("ball", aside, UPRIGHT, t_ns, STILL, STILL, "bob")
    play.put(anns, bobs)
    assert play.ball == pytest.approx(top)
    play.lead(aside, who="bob", let_go=True)  # he never had it
    assert play.ball == pytest.approx(top)
    play.lead(top, let_go=True)
    play.lead(aside, who="bob")
    assert play.ball == pytest.approx(aside)
    real = START + np.array([-0.3, 0.3, 0.0])
    play.put(PropInput("ball", real, UPRIGHT, (play.k + 1) * STEP_NS))
    play.lead(aside, who="bob")
    assert play.ball == pytest.approx(real)


def test_what_was_drawn_over_another_thing_falls_onto_it_and_comes_back() -> None:
    play = Drag()
    can, over = ROOM.thing("can").position, START + 0.15 * UP
    for _ in range(20):
        play.put(PropInput("can", over, UPRIGHT, (play.k + 1) * STEP_NS, STILL, STILL, "ann"))
    assert play.thing("can").position == pytest.approx(over)
    play.put(PropInput("can", over, UPRIGHT, (play.k + 1) * STEP_NS, STILL, STILL, "ann", True))
    for _ in range(90):
        play.put()
    assert play.thing("can").position[1] < START[1] + 0.13
    done(play.say(ask.Undo()))
    assert play.thing("can").position == pytest.approx(can, abs=2e-3)


def test_a_world_that_is_restored_in_the_middle_of_a_drag_goes_on_bit_for_bit() -> None:
    play = Drag()
    top = play.drawn_up()
    copy = World.restore(play.world.snapshot())
    assert copy.snapshot() == play.world.snapshot()
    rest = [
        lambda k: StepInputs(k, k * STEP_NS, props=(PropInput("ball", top, UPRIGHT, k * STEP_NS, STILL, STILL, "ann", True),)),
        lambda k: StepInputs(k, k * STEP_NS),
        lambda k: StepInputs(k, k * STEP_NS, commands=(CommandInput("u", "ann", ask.Undo()),)),
        lambda k: StepInputs(k, k * STEP_NS, commands=(CommandInput("r", "ann", ask.Redo()),)),
    ]
    for more in rest:
        play.k += 1
        inputs = more(play.k)
        play.views.append(play.world.step(inputs))
        copy.step(inputs)
        assert copy.snapshot() == play.world.snapshot()
        assert World.restore(copy.snapshot()).snapshot() == copy.snapshot()
    assert all(o.done for v in play.views[-2:] for o in v.outcomes)


def test_who_leaves_in_the_middle_of_a_drag_leaves_a_thing_that_falls() -> None:
    play = Drag()
    top = play.drawn_up()
    play.k += 1
    play.views.append(play.world.step(StepInputs(play.k, play.k * STEP_NS, left=("ann",))))
    for _ in range(90):
        play.put()
    assert play.ball[1] < top[1] - 0.2
    assert not play.world._state.history.done
