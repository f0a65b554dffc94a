"""The world as a function of its inputs: grasps, hand-overs, commands, snapshots, the same bytes twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.figure.body import standard_body
from vistel.figure.grip import closed_round
from vistel.figure.posture.hands import OPEN, hand_rotation
from vistel.figure.posture.posture import WRIST, Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.geometry.rotation import matrix_from_quaternion, rotvec_from_matrix
from vistel.space.actions import Delete, Move, Release, Reset
from vistel.space.arguments import Which
from vistel.space.inputs import CommandInput, MotionInput, ParticipantBody, StepInputs
from vistel.space.room import BATON, TABLE_HEIGHT, meeting_room
from vistel.space.snapshot import VERSION, decode, digest
from vistel.space.view import WorldView
from vistel.space.world import World

STEP_NS = 16_666_667
SKELETON = standard_skeleton()
GRIP = np.array([-0.088, -0.0255, 0.0])
FIST = closed_round(SKELETON, standard_body(SKELETON), "right", GRIP, 0.012)
MIDDLE = np.array([0.0, 0.0, -0.032])


def reaching(grip: np.ndarray, closing: float, heading: float = 0.0) -> Posture:
    """Somebody whose right palm lies on `grip` (room) from above; closing: 0 open, 1 round a baton.

    The stance does the reaching: the arm stays as it is, the feet stand where the hand comes right.
    """
    posture = standing()
    dofs = posture.dofs.copy()
    pose = pose_joints(SKELETON, Posture(dofs, stance=Stance(np.zeros(3), heading)))
    ahead = np.array([np.sin(heading), 0.0, np.cos(heading)])
    wanted = hand_rotation(-1.0, ahead, np.array([0.0, -1.0, 0.0]))
    forearm = pose.rotation[JOINT_INDEX["right_lower_arm"]]
    dofs[WRIST["right"]] = rotvec_from_matrix(np.ascontiguousarray(forearm.T @ wanted))
    hands = np.zeros((2, 20))
    hands[1] = OPEN + closing * (FIST - OPEN)
    pose = pose_joints(SKELETON, Posture(dofs, hands, Stance(np.zeros(3), heading)))
    hand = JOINT_INDEX["right_hand"]
    reached = pose.position[hand] + pose.rotation[hand] @ (GRIP + MIDDLE)
    return Posture(dofs, hands, Stance(grip - reached, heading))


class Play:
    """A world and its steps; keeps the inputs."""

    def __init__(self, *people: str) -> None:
        self.world = World(meeting_room(3))
        self.k = 0
        self.inputs: list[StepInputs] = []
        self.views: list[WorldView] = []
        self.new = tuple(ParticipantBody(p) for p in people)

    def step(self, postures: dict[str, Posture], *commands: CommandInput, left: tuple[str, ...] = ()) -> WorldView:
        self.k += 1
        motions = tuple(MotionInput(who, p, self.k, self.k * STEP_NS) for who, p in sorted(postures.items()))
        inputs = StepInputs(self.k, self.k * STEP_NS, self.new, motions, left, commands)
        self.new = ()
        self.inputs.append(inputs)
        self.views.append(self.world.step(inputs))
        return self.views[-1]

    def thing(self, name: str):
        return next(s for s in self.views[-1].states if s.id == name)

    def grasps(self) -> list[str]:
        return [g.participant for g in self.views[-1].grasps if g.thing == BATON]


START = meeting_room(3).thing(BATON).position


def at(x: float, y: float, z: float) -> np.ndarray:
    """A place, from where the baton begins."""
    return START + np.array([x, y, z])


def take_baton(play: Play, who: str = "ann") -> None:
    for k in range(25):
        play.step({who: reaching(START, k / 20 if k < 20 else 1.0)})


def test_a_hand_that_closes_round_the_baton_takes_and_lifts_it() -> None:
    play = Play("ann")
    take_baton(play)
    assert play.grasps() == ["ann"]
    assert play.thing(BATON).holders == ("ann",)
    for k in range(60):
        play.step({"ann": reaching(at(0.0, 0.004 * k, 0.0), 1.0)})
    assert play.thing(BATON).position[1] == pytest.approx(START[1] + 0.236, abs=0.01)
    assert not play.thing(BATON).resting


def test_an_open_hand_on_the_baton_takes_nothing() -> None:
    play = Play("ann")
    for _ in range(60):
        play.step({"ann": reaching(at(0.0, 0.01, 0.0), 0.0)})
    assert play.grasps() == []


def test_a_fist_that_was_closed_before_takes_nothing() -> None:
    play = Play("ann")
    for k in range(90):
        play.step({"ann": reaching(at(0.0, max(0.0, 0.3 - 0.005 * k), 0.0), 1.0)})
    assert play.grasps() == []


def test_opening_the_hand_drops_the_baton_on_the_table() -> None:
    play = Play("ann")
    take_baton(play)
    for k in range(40):
        play.step({"ann": reaching(at(0.10, 0.005 * k, 0.13), 1.0)})
    for k in range(12):
        play.step({"ann": reaching(at(0.10, 0.20, 0.13), 1.0 - k / 11)})
    assert play.grasps() == []
    for k in range(240):
        play.step({"ann": reaching(at(0.10, 0.20 + min(0.3, 0.01 * k), 0.13), 0.0)})
    baton = play.thing(BATON)
    assert baton.resting
    assert TABLE_HEIGHT < baton.position[1] < TABLE_HEIGHT + 0.06


def test_the_baton_goes_from_one_hand_to_another_without_a_jump() -> None:
    play = Play("ann", "bob")
    take_baton(play)
    up = at(0.0, 0.25, 0.0)
    for k in range(25):
        play.step({"ann": reaching(at(0.0, 0.01 * k, 0.0), 1.0)})
    far = at(0.064, 0.25, 0.0)  # the other end, from the other side of the table
    for k in range(40):
        play.step({"ann": reaching(up, 1.0), "bob": reaching(far, min(1.0, k / 25), np.pi)})
    assert play.grasps() == ["ann", "bob"]
    before = play.thing(BATON).position
    places = []
    for k in range(40):
        play.step({"ann": reaching(up, max(0.0, 1.0 - k / 15)), "bob": reaching(far, 1.0, np.pi)})
        places.append(play.thing(BATON).position)
    assert play.grasps() == ["bob"]
    assert np.abs(np.diff([before, *places], axis=0)).max() < 0.004
    play.step({"ann": reaching(up, 0.0), "bob": reaching(at(0.064, 0.30, 0.0), 1.0, np.pi)})
    assert play.thing(BATON).position[1] > places[-1][1] + 0.04


def test_who_leaves_lets_go() -> None:
    play = Play("ann")
    take_baton(play)
    play.step({}, left=("ann",))
    assert play.grasps() == []
    assert play.views[-1].participants == ()
    for _ in range(120):
        play.step({})
    assert play.thing(BATON).resting


def test_touching_people_deform_each_other() -> None:
    play = Play("ann", "bob")
    palms = {"ann": reaching(at(0.0, 0.3, 0.0), 0.0), "bob": reaching(at(0.0, 0.29, 0.01), 0.0, np.pi)}
    view = play.step(palms)
    assert any({c.body_a, c.body_b} == {"ann", "bob"} and c.force > 0 for c in view.contacts)
    pairs = {(g.target, g.source) for g in view.ghosts}
    assert {("ann", "bob"), ("bob", "ann")} <= pairs
    ghost = next(g for g in view.ghosts if g.target == "ann" and g.source == "bob")
    assert ghost.compliance_target == ghost.compliance_source == 1.0
    assert 0.0 < ghost.depth <= 0.5


def test_the_same_inputs_give_the_same_bytes() -> None:
    play = Play("ann", "bob")
    take_baton(play)
    for k in range(30):
        play.step(
            {"ann": reaching(at(0.0, 0.005 * k, 0.01 * k), 1.0), "bob": reaching(at(0.3, 0.1, 0.1), 0.0)},
            CommandInput(f"c{k}", "bob", Move(Which("ball"), np.array([0.01 * k, 1.0, 0.1]), np.array([0, 0, 0, 1.0]))),
        )
    again = World(meeting_room(3))
    for inputs, view in zip(play.inputs, play.views, strict=True):
        other = again.step(inputs)
        assert other.hash == view.hash
        for a, b in zip(other.states, view.states, strict=True):
            assert a.position.tobytes() == b.position.tobytes()
            assert a.rotation.tobytes() == b.rotation.tobytes()
    assert again.snapshot() == play.world.snapshot()


def test_a_restored_world_goes_on_bit_for_bit() -> None:
    play = Play("ann")
    take_baton(play)
    other = World.restore(play.world.snapshot())
    for k in range(60):
        posture = {"ann": reaching(at(0.0, 0.005 * k, 0.0), 1.0 if k < 30 else 0.0)}
        view = play.step(posture, CommandInput(str(k), "ann", Release(Which("ball"))))
        assert other.step(play.inputs[-1]).hash == view.hash
        assert other.snapshot() == play.world.snapshot()


def test_the_hash_is_the_same_for_what_was_restored_and_another_for_the_least_change() -> None:
    play = Play("ann")
    take_baton(play)
    room, state = decode(play.world.snapshot())
    once, again = (digest(*decode(World.restore(play.world.snapshot()).snapshot())) for _ in range(2))
    assert once == again == digest(room, state)
    moved = state.motions.copy()
    moved.velocity[2, 1] = np.nextafter(moved.velocity[2, 1], 1.0)
    bent = replace(state.grasps[0], tightest=np.nextafter(state.grasps[0].tightest, 9.0))
    others = [
        replace(state, motions=moved),
        replace(state, grasps=(bent,)),
        replace(state, marks=state.marks + 1),
        replace(state, grasps=()),
        replace(state, selected=(("ann", (BATON,)),)),
    ]
    assert len({digest(room, other) for other in [state, *others]}) == len(others) + 1


@pytest.mark.parametrize("data", [b"", b"{}", b"[1]", b'{"version": 1}', b'{"version": %d}' % (VERSION + 1), b"\xff\xfe"])
def test_bytes_that_are_no_snapshot_are_refused_in_one_line(data: bytes) -> None:
    with pytest.raises(ValueError, match="snapshot: ") as e:
        World.restore(data)
    assert "\n" not in str(e.value)


@settings(max_examples=25, deadline=None)
@given(st.data())
def test_a_damaged_snapshot_never_makes_a_world_that_fails(data: st.DataObject) -> None:
    good = bytearray(World(meeting_room(2)).snapshot())
    at = data.draw(st.integers(0, len(good) - 1))
    good[at] = data.draw(st.integers(0, 255))
    try:
        world = World.restore(bytes(good))
    except ValueError:
        return
    world.step(StepInputs(1, STEP_NS))


def command(play: Play, action: object, who: str = "ann", name: str | None = None) -> tuple[bool, str]:
    view = play.step({}, CommandInput(name or f"id-{play.k}", who, action))  # type: ignore[arg-type]
    return view.outcomes[-1].done, view.outcomes[-1].reason


def place(x: float, y: float, z: float) -> tuple[np.ndarray, np.ndarray]:
    return np.array([x, y, z]), np.array([0.0, 0.0, 0.0, 1.0])


def test_commands_move_delete_and_reset() -> None:
    play = Play("ann")
    play.step({})
    assert command(play, Move(Which("box"), *place(0.2, 0.9, 0.2)))[0]
    assert play.thing("box").position[1] > 0.85
    assert command(play, Delete(Which("can")))[0]
    assert "can" not in {s.id for s in play.views[-1].states}
    assert play.views[-1].changed
    assert command(play, Delete(Which("can"))) == (False, "there is no thing 'can' in the room")
    assert command(play, Reset())[0]
    assert play.thing("can").position == pytest.approx(meeting_room(3).thing("can").position)


def test_commands_that_make_no_sense_are_refused() -> None:
    play = Play("ann", "bob")
    take_baton(play)
    for action, who, what in [
        (Move(Which("baton"), *place(0, 1, 0)), "bob", "held by ann"),
        (Move(Which("baton"), *place(0, 1, 0)), "ann", "your own hand"),
        (Delete(Which("baton")), "bob", "held by ann"),
        (Release(Which("baton")), "bob", "does not hold"),
        (Move(Which("table"), *place(0, 1, 0)), "ann", "fixed"),
        (Move(Which("box"), *place(0, -1, 0)), "ann", "outside"),
        (Move(Which("box"), *place(1e9, 1, 0)), "ann", "outside"),
        (Move(Which("box"), *place(float("inf"), 1, 0)), "ann", "finite"),
        (Reset(), "eve", "not in the room"),
        (None, "ann", "nothing this world"),
    ]:
        done, reason = command(play, action, who)
        assert not done
        assert what in reason
    assert command(play, Release(Which("baton")), "ann")[0]
    assert play.grasps() == []


def test_a_command_sent_again_is_answered_again_and_not_done_again() -> None:
    play = Play("ann")
    play.step({})
    command(play, Move(Which("box"), *place(0.2, 0.9, 0.2)), name="once")
    for _ in range(30):
        play.step({})
    low = play.thing("box").position[1]
    assert command(play, Move(Which("box"), *place(0.2, 0.9, 0.2)), name="once")[0]
    assert play.thing("box").position[1] == pytest.approx(low, abs=0.05)


def test_too_many_commands_are_refused_until_a_while_has_passed() -> None:
    play = Play("ann")
    play.step({})
    outcomes = [command(play, Reset())[0] for _ in range(60)]
    assert outcomes[:20] == [True] * 20
    assert not all(outcomes)
    for _ in range(60):
        play.step({})
    assert command(play, Reset())[0]


def test_postures_that_are_no_numbers_are_left_out() -> None:
    play = Play("ann")
    good = reaching(START, 0.0)
    play.step({"ann": good})
    before = play.world.snapshot()
    for bad in (
        replace(good, dofs=np.full(25, np.nan)),
        replace(good, hands=np.full((2, 20), np.inf)),
        replace(good, stance=Stance(np.array([np.nan, 0, 0]), 0.0)),
        replace(good, stance=Stance(np.array([1e12, 0, 0]), 0.0)),
        replace(good, dofs=np.zeros(3)),
    ):
        play.step({"ann": bad})
    assert b"NaN" not in play.world.snapshot()
    assert len(play.world.snapshot()) == pytest.approx(len(before), rel=0.2)


def test_a_hand_that_jumps_does_not_shoot_things_away() -> None:
    play = Play("ann")
    take_baton(play)
    for k in range(60):
        play.step({"ann": reaching(at(1.0 if k % 2 else -1.0, 0.5, 0.0), 1.0)})
    play.step({"ann": reaching(at(0.0, 0.5, 0.0), 0.0)})
    for _ in range(200):
        play.step({"ann": reaching(at(0.0, 0.5, 0.0), 0.0)})
        assert np.hypot(*play.thing(BATON).position[[0, 2]]) < 6.0
    assert np.isfinite(play.thing(BATON).position).all()


def test_a_throw_keeps_the_hands_speed() -> None:
    play = Play("ann")
    take_baton(play)
    for k in range(30):
        play.step({"ann": reaching(at(0.0, 0.3, 0.02 * k), 1.0)})
    for k in range(5):
        play.step({"ann": reaching(at(0.0, 0.3, 0.6 + 0.02 * k), 1.0 - k / 4)})
    assert play.grasps() == []
    assert play.thing(BATON).velocity[2] > 0.6


def test_ten_seconds_without_anybody_change_nothing() -> None:
    play = Play()
    first = play.step({})
    for _ in range(600):
        view = play.step({})
    for a, b in zip(first.states, view.states, strict=True):
        assert a.position.tobytes() == b.position.tobytes()
        assert not b.moved


def test_a_turning_hand_turns_what_it_holds() -> None:
    play = Play("ann")
    take_baton(play)
    for _ in range(15):
        play.step({"ann": reaching(at(0.0, 0.2, 0.0), 1.0)})
    along = matrix_from_quaternion(play.thing(BATON).rotation)[:, 0]
    for k in range(21):
        play.step({"ann": reaching(at(0.0, 0.2, 0.0), 1.0, 0.05 * k)})
    turned = matrix_from_quaternion(play.thing(BATON).rotation)[:, 0]
    assert along @ turned == pytest.approx(np.cos(1.0), abs=0.01)


def test_who_appears_in_the_middle_of_a_thing_does_not_knock_it_over() -> None:
    play = Play("ann")
    for k in range(30):
        play.step({"ann": reaching(at(0.0, 0.02 - 0.001 * k, 0.0), 0.6)})
    assert play.thing(BATON).position == pytest.approx(START, abs=2e-3)
    for _ in range(60):
        play.step({"ann": reaching(at(0.0, 0.3, 0.3), 0.0)})
    take_baton(play)
    assert play.grasps() == ["ann"]
