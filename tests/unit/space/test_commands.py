"""What people ask of the world, done and refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_world_steps import BATON, STEP_NS, Play, reaching, take_baton

from vistel.figure.posture import Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.space.commands import actions as ask
from vistel.space.commands.actions import Action, Along, Shown, Towards, Where, Which
from vistel.space.commands.create import SHAPES
from vistel.space.commands.history import MOST
from vistel.space.commands.reference import COLOURS, name_of_colour
from vistel.space.commands.reshape import curved, extent, joined, scaled, stretched
from vistel.space.inputs import CommandInput, StepInputs
from vistel.space.room import TABLE_HEIGHT, meeting_room
from vistel.space.solids import solids
from vistel.space.things import Thing
from vistel.space.view import Outcome
from vistel.space.world import World

ROOM = meeting_room(3)


def stands(x: float, z: float, heading: float) -> Posture:
    return replace(standing(), stance=Stance(np.array([x, standing().stance.position[1], z]), heading))


class Talk:
    """Ann stands at the table's side and says things; at -Z she faces +Z, so that her right hand is towards -X."""

    def __init__(self, *people: str) -> None:
        self.play = Play(*(people or ("ann",)))
        self.k = 0
        self.play.step({"ann": stands(0.0, -0.9, 0.0)})

    def say(self, action: Action | None, who: str = "ann") -> Outcome:
        self.k += 1
        return self.play.step({}, CommandInput(f"c{self.k}", who, action)).outcomes[-1]

    def wait(self, steps: int) -> None:
        for _ in range(steps):
            self.play.step({})

    def thing(self, name: str) -> Thing:
        return next(t for t in self.play.views[-1].things if t.id == name)

    def place(self, name: str) -> np.ndarray:
        return self.play.thing(name).position


def done(outcome: Outcome) -> tuple[str, ...]:
    assert outcome.done, outcome.reason
    return outcome.things


def refused(outcome: Outcome) -> str:
    assert not outcome.done
    return outcome.reason


# -- which things ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("which", "thing"),
    [
        (Which("ball"), "ball"), (Which(name="ball"), "ball"), (Which(name="Yellow Ball"), "ball"),
        (Which(shape="cylinder"), "can"), (Which(colour="blue"), "box"), (Which(colour="red", shape="baton"), "baton"),
        (Which(colour="violet"), "ring"), (Which(colour="orange"), "cone"), (Which(colour="white"), "tile"),
    ],
)  # fmt: skip
def test_a_thing_is_known_by_id_name_shape_or_colour(which: Which, thing: str) -> None:
    assert done(Talk().say(ask.Select(which))) == (thing,)


def test_every_colour_is_called_by_its_name() -> None:
    assert {name: name_of_colour(value) for name, value in COLOURS.items()} == {name: name for name in COLOURS}


def test_what_is_not_there_and_what_may_be_several_is_told() -> None:
    talk = Talk()
    assert refused(talk.say(ask.Paint(Which(colour="pink"), COLOURS["red"]))) == "there is no pink thing in the room"
    done(talk.say(ask.Copy(Which("ball"))))
    said = refused(talk.say(ask.Delete(Which(shape="ball"))))
    assert said.startswith("2 things may be meant (the yellow ball, the yellow ball 2)")
    assert set(done(talk.say(ask.Delete(Which(shape="ball", every=True))))) == {"ball", "ball-2"}


def test_this_is_what_was_selected_then_what_is_held() -> None:
    talk = Talk()
    done(talk.say(ask.Select(Which("can"))))
    assert done(talk.say(ask.Paint(ask.THIS, COLOURS["red"]))) == ("can",)
    done(talk.say(ask.Select(nothing=True)))
    take_baton(talk.play)
    assert done(talk.say(ask.Paint(ask.THIS, COLOURS["green"]))) == (BATON,)
    assert done(talk.say(ask.Paint(Which(shown=Shown.HELD), COLOURS["blue"]))) == (BATON,)


def test_a_finger_shows_the_thing_on_its_line_and_another_one_when_that_is_gone() -> None:
    talk = Talk()
    posture = reaching(np.array([0.0, 1.1, -0.35]), 0.0)
    talk.play.step({"ann": posture})
    joints = pose_joints(standard_skeleton(1.75), posture).position
    base, tip = (joints[JOINT_INDEX[f"right_index_{part}"]] for part in ("proximal", "distal"))
    line = (tip - base) / np.linalg.norm(tip - base)
    aside = np.cross(line, (0.0, 1.0, 0.0))
    still = np.array([0.0, 0.0, 0.0, 1.0])
    done(talk.say(ask.Move(Which("can"), tip + 0.3 * line + 0.04 * aside, still)))
    done(talk.say(ask.Move(Which("box"), tip + 0.3 * line, still)))
    assert done(talk.say(ask.Select(Which(shown=Shown.POINTED)))) == ("box",)
    done(talk.say(ask.Delete(Which("box"))))
    done(talk.say(ask.Move(Which("can"), tip + 0.3 * line + 0.04 * aside, still)))
    assert done(talk.say(ask.Select(Which(shown=Shown.POINTED)))) == ("can",)


def test_the_eyes_show_what_they_look_at() -> None:
    talk = Talk()
    eyes = pose_joints(standard_skeleton(1.75), stands(0.0, -0.9, 0.0)).position[JOINT_INDEX["left_eye"]]
    still = np.array([0.0, 0.0, 0.0, 1.0])
    done(talk.say(ask.Move(Which("ring"), eyes + np.array([0.0, 0.0, 0.8]), still)))
    assert done(talk.say(ask.Select(Which(shown=Shown.LOOKED_AT)))) == ("ring",)


def test_nobody_can_show_anything_before_it_is_known_where_they_are() -> None:
    talk = Talk("ann", "bob")
    assert "nothing is meant by this" in refused(talk.say(ask.Paint(ask.THIS, 255), "bob"))
    assert "nobody knows yet where bob is" in refused(talk.say(ask.MoveBy(Which("ball"), Towards.LEFT), "bob"))


# -- where things are ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("towards", "axis", "sign"),
    [
        (Towards.RIGHT, 0, -1.0), (Towards.LEFT, 0, 1.0), (Towards.UP, 1, 1.0), (Towards.AHEAD, 2, 1.0), (Towards.BACK, 2, -1.0),
    ],
)  # fmt: skip
def test_directions_are_those_of_the_speaker(towards: Towards, axis: int, sign: float) -> None:
    talk = Talk()
    before = talk.place("ball").copy()
    done(talk.say(ask.MoveBy(Which("ball"), towards, 0.1)))
    farthest = before.copy()
    for _ in range(14):
        talk.wait(1)
        if sign * (talk.place("ball") - farthest)[axis] > 0:
            farthest = talk.place("ball").copy()
    moved = farthest - before
    assert sign * moved[axis] == pytest.approx(0.1, abs=0.012)


def test_a_thing_glides_and_does_not_jump() -> None:
    talk = Talk()
    done(talk.say(ask.MoveBy(Which("box"), Towards.UP, 0.5)))
    before, steps = talk.place("box").copy(), []
    for _ in range(60):
        talk.wait(1)
        steps.append(float(np.linalg.norm(talk.place("box") - before)))
        before = talk.place("box").copy()
    assert max(steps) < 0.02
    assert sum(steps) > 0.5


def test_stop_leaves_it_where_it_is_and_it_falls() -> None:
    talk = Talk()
    done(talk.say(ask.MoveBy(Which("box"), Towards.UP, 1.0)))
    talk.wait(20)
    height = talk.place("box")[1]
    assert done(talk.say(ask.Stop())) == ("box",)
    talk.wait(4)
    assert talk.place("box")[1] < height + 0.01
    talk.wait(60)
    assert talk.place("box")[1] == pytest.approx(ROOM.thing("box").position[1], abs=0.02)


def test_nothing_is_sent_through_the_table_or_out_of_the_room() -> None:
    talk = Talk()
    assert refused(talk.say(ask.MoveBy(Which("box"), Towards.DOWN, 0.2))) == "the round table is in the way"
    assert "outside the room" in refused(talk.say(ask.MoveBy(Which("box"), Towards.LEFT, 5.0)))
    assert "fixed to the room" in refused(talk.say(ask.MoveBy(Which("table"), Towards.LEFT)))


def test_a_turn_on_the_spot_and_a_tip_over() -> None:
    talk = Talk()
    done(talk.say(ask.Turn(Which("can"), 0.5 * math.pi, Along.ACROSS)))
    talk.wait(120)
    assert talk.place("can")[1] == pytest.approx(TABLE_HEIGHT + 0.032, abs=0.004)
    assert np.hypot(*(talk.place("can") - ROOM.thing("can").position)[[0, 2]]) < 0.08


def test_here_is_before_the_speaker_on_the_table() -> None:
    talk = Talk()
    done(talk.say(ask.Place(Which("tile"), Where.HERE)))
    talk.wait(120)
    x, y, z = talk.place("tile")
    assert abs(x) < 0.15
    assert y == pytest.approx(TABLE_HEIGHT + 0.009, abs=0.01)
    assert z < -0.3


# -- what things are -------------------------------------------------------------------------------------------


def test_a_larger_thing_stands_on_the_same_table_and_weighs_more() -> None:
    talk = Talk()
    done(talk.say(ask.Scale(Which("box"), 1.5)))
    assert talk.thing("box").mass == pytest.approx(ROOM.thing("box").mass * 1.5**3)
    assert talk.thing("box").primitives[0].params[:3] == pytest.approx((0.0675, 0.045, 0.048))
    talk.wait(90)
    assert talk.place("box")[1] == pytest.approx(TABLE_HEIGHT + 0.045, abs=0.005)
    assert talk.play.views[-1].things[0] is not None


def test_taller_is_along_the_upright_axis_whatever_the_thing_lies_on() -> None:
    talk = Talk()
    done(talk.say(ask.Scale(Which("can"), 1.5, Along.UP)))
    assert talk.thing("can").primitives[0].params[:3] == pytest.approx((0.032, 0.032, 0.0825))
    done(talk.say(ask.Scale(Which("ball"), 2.0, Along.ACROSS)))
    ball = talk.thing("ball").primitives[0]
    assert (ball.kind, ball.params[:3]) == ("superellipsoid", pytest.approx((0.038, 0.038, 0.076)))


def test_thicker_is_across_the_longest_axis_and_a_ball_stays_as_long() -> None:
    talk = Talk()
    before = extent(solids([talk.thing("baton")]))
    done(talk.say(ask.Scale(Which("baton"), 1.2, Along.GIRTH)))
    grown = np.ptp(extent(solids([talk.thing("baton")])), axis=0) / np.ptp(before, axis=0)
    longest = int(np.argmax(np.ptp(before, axis=0)))
    assert abs(grown[longest] - 1.0) < 0.05
    assert all(abs(grown[k] - 1.2) < 0.1 for k in {0, 1, 2} - {longest})
    assert "one axis" in refused(talk.say(ask.Turn(Which("baton"), 0.5, Along.GIRTH)))


def test_the_largest_and_the_smallest_of_several_are_meant() -> None:
    talk = Talk()
    large = done(talk.say(ask.Create("ball", 0.07)))
    small = done(talk.say(ask.Create("ball", 0.02)))
    assert done(talk.say(ask.Select(Which(shape="ball", size=ask.Size.LARGEST)))) == large
    assert done(talk.say(ask.Select(Which(shape="ball", size=ask.Size.SMALLEST)))) == small


@pytest.mark.parametrize("factor", [0.0, -1.0, 1e9, 1000.0, 0.001, math.nan, math.inf])
def test_absurd_sizes_are_refused_and_the_thing_stays_as_it_was(factor: float) -> None:
    talk = Talk()
    before = talk.thing("box")
    assert refused(talk.say(ask.Scale(Which("box"), factor)))
    assert talk.thing("box") is before


def test_a_bar_bends_upwards_and_becomes_straight_again() -> None:
    talk = Talk()
    before = talk.thing(BATON).primitives[0].params
    done(talk.say(ask.Bend(Which(BATON), 1.5)))
    bent = talk.thing(BATON)
    ends = [bent.primitives[0].params[:3], bent.primitives[-1].params[3:6]]
    middle = bent.primitives[len(bent.primitives) // 2].params[:3]
    assert min(e[1] for e in ends) > middle[1] + 0.02
    done(talk.say(ask.Bend(Which(BATON), 0.0)))
    assert talk.thing(BATON).primitives[0].params == pytest.approx(before)
    assert "round about its axis" in refused(talk.say(ask.Twist(Which(BATON), 1.0)))


def test_soft_and_painted_things_are_told_as_such() -> None:
    talk = Talk()
    done(talk.say(ask.Harden(Which("box"), 0.2)))
    done(talk.say(ask.Paint(Which("box"), COLOURS["pink"])))
    assert talk.thing("box").compliance == pytest.approx(0.8)
    assert done(talk.say(ask.Select(Which(colour="pink")))) == ("box",)


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_can_be_made_and_lies_still_on_the_table(shape: str) -> None:
    talk = Talk()
    (made,) = done(talk.say(ask.Create(shape)))
    talk.wait(150)
    assert TABLE_HEIGHT < talk.place(made)[1] < TABLE_HEIGHT + 0.06
    assert talk.play.views[-1].states[-1].id == made


def test_copies_have_names_of_their_own_and_stand_apart() -> None:
    talk = Talk()
    names = [done(talk.say(ask.Copy(Which("ball"))))[0] for _ in range(3)]
    assert names == ["ball-2", "ball-3", "ball-4"]
    places = np.array([talk.place(n) for n in ("ball", *names)])
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + np.eye(4)
    assert apart.min() > 0.07


def test_what_is_attached_moves_as_one_and_comes_apart_where_it_is() -> None:
    talk = Talk()
    box = talk.place("box")
    done(talk.say(ask.Move(Which("can"), box + np.array([0.08, 0.03, 0.0]), ROOM.thing("can").rotation)))
    gap = refused(talk.say(ask.Attach(Which("can"), Which("tile"))))
    assert "are apart" in gap
    assert done(talk.say(ask.Attach(Which("box"), Which("can")))) == ("box", "can")
    assert talk.thing("box").name == "blue box with green can"
    assert talk.thing("box").mass == pytest.approx(0.55)
    assert [p.colour for p in talk.thing("box").primitives] == [ROOM.thing("box").colour, ROOM.thing("can").colour]
    assert "there is no thing 'can'" in refused(talk.say(ask.Delete(Which("can"))))
    done(talk.say(ask.MoveBy(Which("box"), Towards.UP, 0.3)))
    talk.wait(30)
    assert set(done(talk.say(ask.Detach(Which("box"))))) == {"box", "can"}
    assert np.linalg.norm(talk.place("box") - talk.place("can")) == pytest.approx(np.hypot(0.08, 0.03), abs=0.02)


# -- second thoughts -------------------------------------------------------------------------------------------


def test_everybody_takes_back_their_own_doings_one_after_the_other() -> None:
    talk = Talk("ann", "bob")
    done(talk.say(ask.Paint(Which("box"), COLOURS["red"])))
    done(talk.say(ask.Scale(Which("box"), 1.2)))
    done(talk.say(ask.Paint(Which("can"), COLOURS["red"]), "bob"))
    assert done(talk.say(ask.Undo())) == ("box",)
    assert talk.thing("box").primitives[0].params == ROOM.thing("box").primitives[0].params
    assert done(talk.say(ask.Undo())) == ("box",)
    assert talk.thing("box") is ROOM_OF(talk).thing("box")
    assert "nothing" in refused(talk.say(ask.Undo()))
    assert done(talk.say(ask.Redo())) == ("box",)
    assert done(talk.say(ask.Redo())) == ("box",)
    assert talk.thing("box").primitives[0].params[0] == pytest.approx(0.054)
    assert "nothing back" in refused(talk.say(ask.Redo()))


def ROOM_OF(talk: Talk):
    return talk.play.world._room  # pyright: ignore[reportPrivateUsage]


def test_what_others_have_changed_since_is_not_taken_back() -> None:
    talk = Talk("ann", "bob")
    done(talk.say(ask.Paint(Which("box"), COLOURS["red"])))
    done(talk.say(ask.Scale(Which("box"), 1.1), "bob"))
    assert refused(talk.say(ask.Undo())) == "the blue box has been changed since"


def test_deleted_created_moved_and_joined_things_come_back() -> None:
    talk = Talk()
    done(talk.say(ask.Delete(Which("ball"))))
    assert done(talk.say(ask.Undo())) == ("ball",)
    assert talk.place("ball") == pytest.approx(ROOM.thing("ball").position, abs=1e-3)
    (made,) = done(talk.say(ask.Create("box")))
    done(talk.say(ask.Undo()))
    assert made not in {s.id for s in talk.play.views[-1].states}
    assert done(talk.say(ask.Redo())) == (made,)
    start = talk.place("tile").copy()
    done(talk.say(ask.MoveBy(Which("tile"), Towards.UP, 0.2)))
    done(talk.say(ask.Undo()))
    talk.wait(30)
    assert talk.place("tile") == pytest.approx(start, abs=2e-3)


def test_no_more_than_so_many_changes_are_remembered() -> None:
    talk = Talk()
    for k in range(MOST + 4):
        done(talk.say(ask.Paint(Which("box"), 0x11111100 * (k % 10) + 0xFF)))
        talk.wait(8)
    undone = 0
    while talk.say(ask.Undo()).done:
        undone += 1
        talk.wait(8)
    assert undone == MOST


def test_who_leaves_takes_their_doings_along() -> None:
    talk = Talk("ann", "bob")
    done(talk.say(ask.Paint(Which("box"), COLOURS["red"]), "bob"))
    talk.play.step({}, left=("bob",))
    state = talk.play.world._state  # pyright: ignore[reportPrivateUsage]
    assert not state.history.done
    assert not state.selected


def test_a_hand_takes_hold_when_it_is_asked_to_and_only_where_it_is() -> None:
    talk = Talk()
    assert "none of your free hands" in refused(talk.say(ask.Grip(Which(BATON))))
    for _ in range(10):
        talk.play.step({"ann": reaching(ROOM.thing(BATON).position, 0.4)})
    done(talk.say(ask.Grip(Which(BATON))))
    assert talk.play.grasps() == ["ann"]
    done(talk.say(ask.Release()))
    assert talk.play.grasps() == []


def test_commands_about_what_others_hold_are_refused() -> None:
    talk = Talk("ann", "bob")
    take_baton(talk.play)
    for action in (ask.Scale(Which(BATON), 2.0), ask.Paint(Which(BATON), 255), ask.MoveBy(Which(BATON), Towards.UP),
                   ask.Delete(Which(BATON))):  # fmt: skip
        assert refused(talk.say(action, "bob")) in ("the red baton is held by ann", "nobody knows yet where bob is")
    done(talk.say(ask.Scale(Which(BATON), 1.3)))
    assert talk.play.grasps() == ["ann"]


# -- the same again --------------------------------------------------------------------------------------------


def test_a_world_restored_between_commands_goes_on_the_same() -> None:
    talk = Talk()
    said: list[Action] = [
        ask.Create("cone"), ask.Bend(Which(BATON), 1.0), ask.Scale(Which("box"), 1.3), ask.MoveBy(Which("can"), Towards.UP, 0.3),
        ask.Select(Which("tile")), ask.Move(Which("can"), np.array([0.08, 0.8, 0.02]), np.array([0, 0, 0, 1.0])),
        ask.Attach(Which("box"), Which("can")), ask.Undo(), ask.Redo(), ask.Paint(ask.THIS, 0x123456FF), ask.Undo(),
        ask.Copy(Which("ball")), ask.Undo(), ask.Redo(), ask.Reset(),
    ]  # fmt: skip
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


# -- shapes ----------------------------------------------------------------------------------------------------

LOOSE = [t for t in ROOM.things if not t.fixed]


@given(st.sampled_from(LOOSE), st.floats(0.5, 2.0), st.floats(0.5, 2.0))
def test_scaling_twice_is_scaling_by_the_product(thing: Thing, a: float, b: float) -> None:
    twice, once = scaled(scaled(thing, a), b), scaled(thing, a * b)
    for p, q in zip(twice.primitives, once.primitives, strict=True):
        assert p.params == pytest.approx(q.params)
    assert twice.mass == pytest.approx(once.mass, rel=1e-9)


@given(st.sampled_from(LOOSE), st.integers(0, 2), st.floats(0.6, 1.8))
def test_stretching_back_gives_the_same_size(thing: Thing, axis: int, factor: float) -> None:
    along = np.eye(3)[axis]
    back = stretched(stretched(thing, factor, along), 1 / factor, along)
    assert extent(solids((back,))) == pytest.approx(extent(solids((thing,))), rel=0.02, abs=1e-3)
    assert back.mass == pytest.approx(thing.mass, rel=1e-6)


@given(st.floats(-4.0, 4.0), st.floats(0.0, 6.0))
def test_a_bent_bar_keeps_its_length_and_thickness(bend: float, turn: float) -> None:
    side = np.array([0.0, math.cos(turn), math.sin(turn)])
    baton = ROOM.thing(BATON)
    bent = curved(baton, bend, 0.0, side)
    if bent.curve is None:
        return
    params = [p.params for p in bent.primitives]
    length = sum(math.dist(p[:3], p[3:6]) for p in params)
    assert length == pytest.approx(0.176, rel=0.01)
    assert {round(r, 9) for p in params for r in p[6:]} == {0.012}
    middle = np.mean([p.position + 0.5 * (np.array(p.params[:3]) + np.array(p.params[3:6])) for p in bent.primitives], axis=0)
    assert middle == pytest.approx(np.zeros(3), abs=1e-9)


def test_joined_things_balance_about_their_common_centre() -> None:
    a, b = ROOM.thing("box"), ROOM.thing("can")
    whole, centre = joined(a, (np.array([0.1, 1.0, 0.0]), a.rotation), b, (np.array([0.2, 1.1, 0.0]), b.rotation))
    assert sum(p.thing.mass * p.position for p in whole.parts) == pytest.approx(np.zeros(3), abs=1e-12)
    assert centre == pytest.approx((0.25 * np.array([0.1, 1.0, 0]) + 0.3 * np.array([0.2, 1.1, 0])) / 0.55)


# -- anything at all -------------------------------------------------------------------------------------------

NUMBER = st.one_of(st.floats(-3.0, 3.0), st.floats(), st.sampled_from([0.0, 1e-9, 1e9, -1e9]))
WHICH = st.builds(
    Which, st.sampled_from(["", "", "box", BATON, "table", "unicorn", "cone-2"]), st.sampled_from(["", "ball", "red"]),
    st.sampled_from(["", "cylinder"]), st.sampled_from(["", "white"]), st.sampled_from([None, None, *Shown]), st.booleans(),
)  # fmt: skip
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
    st.just(ask.Stop()), st.just(ask.Reset()),
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
