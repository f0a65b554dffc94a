"""The session in the workshop: what its file says happens to lid, drawer and button in the world."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from vistel.conference.files import load
from vistel.conference.model import Conference
from vistel.conference.rooms import interior_of
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.joints.joined import Joined, joined
from vistel.space.view import WorldView
from vistel.space.world import World
from vistel_sim.motion import open_motion
from vistel_sim.motion.source import MotionError

FILE = Path(__file__).parents[3] / "examples/conferences/workshop.toml"
STEP_NS = 16_666_667


@dataclass(frozen=True)
class Session:
    """inputs: of every step; views: what came of them; middle: the world's state in the midst of them, after `half` steps."""

    inputs: list[StepInputs]
    views: list[WorldView]
    half: int
    middle: bytes
    joints: Joined

    def along(self, joint: str) -> np.ndarray:
        """A joint's coordinate in every step."""
        k = next(k for k, j in enumerate(self.joints.joints) if j.id == joint)
        poses = ((np.array([s.position for s in v.states]), np.array([s.rotation for s in v.states])) for v in self.views)
        return np.array([self.joints.coordinate(k, *pose) for pose in poses])

    def held(self, thing: str) -> np.ndarray:
        """Whether somebody holds a thing, in every step."""
        return np.array([any(g.thing == thing for g in v.grasps) for v in self.views])


@pytest.fixture(scope="module")
def session() -> Session:
    """Eighteen seconds of the file."""
    conference = load(FILE)
    room = interior_of(conference.room).room
    source, world = open_motion(conference), World(room)
    people = [p for s in conference.sites for p in s.participants]
    inputs: list[StepInputs] = []
    views: list[WorldView] = []
    middle, half = b"", 4 * 60  # the lid is on its way, in the hand
    for k in range(1, 18 * 60):
        motions = tuple(MotionInput(p.name, source.posture(p.name, k / 60), k, k * STEP_NS) for p in people)
        new = tuple(ParticipantBody(p.name, p.height) for p in people) if k == 1 else ()
        inputs.append(StepInputs(k, k * STEP_NS, new, motions))
        views.append(world.step(inputs[-1]))
        if k == half:
            middle = world.snapshot()
    return Session(inputs, views, half, middle, joined(room.joints, room.things))


def test_the_lid_is_opened_by_hand_and_closed_again(session: Session) -> None:
    lid, held = session.along("chest-hinge"), session.held("chest-lid")
    assert held[: 2 * 60].sum() == 0
    assert lid[held].max() > np.radians(30.0)
    ends = int(np.flatnonzero(held)[-1])
    assert lid[ends] < np.radians(5.0)


def test_the_drawer_is_pulled_out_and_pushed_in_with_the_other_hand(session: Session) -> None:
    drawer, held = session.along("drawer-slide"), session.held("drawer")
    assert drawer[held].max() > 0.10
    assert drawer[-1] < 0.005
    assert {g.right for v in session.views for g in v.grasps if g.thing == "drawer"} == {False}
    assert {g.right for v in session.views for g in v.grasps if g.thing == "chest-lid"} == {True}


def test_the_button_is_pressed_twice_each_press_told_once_and_the_lamp_goes_on_and_off(session: Session) -> None:
    told = [(e.pressed, e.participant) for v in session.views for e in v.buttons]
    assert told == [(True, "aiko"), (False, "aiko")] * 2
    colours = [next(t.colour for t in v.things if t.id == "lamp") for v in session.views]
    changes = [b for a, b in itertools.pairwise(colours) if a != b]
    assert changes == [0xFFD75EFF, colours[0]]


def test_nothing_on_a_joint_jumps(session: Session) -> None:
    for joint, most in (("chest-hinge", 0.1), ("drawer-slide", 0.02), ("door-hinge", 0.1)):
        assert np.abs(np.diff(session.along(joint))).max() < most


def test_everything_on_joints_stays_on_them_and_within_their_limits(session: Session) -> None:
    for k, j in enumerate(session.joints.joints):
        along = session.along(j.id)
        assert along.min() >= j.lower - 1e-9
        assert along.max() <= j.upper + 1e-9
        for v in session.views[::20]:
            position, rotation = np.array([s.position for s in v.states]), np.array([s.rotation for s in v.states])
            n = int(session.joints.ends[k, 1])
            there, _ = session.joints.posed(k, session.joints.coordinate(k, position, rotation), position, rotation)
            assert np.linalg.norm(there - position[n]) < 1e-4


def test_the_same_inputs_give_the_same_bytes_also_from_the_midst_of_a_motion(session: Session) -> None:
    again = World.restore(session.middle)
    assert again.snapshot() == session.middle
    for inputs, view in zip(session.inputs[session.half :], session.views[session.half :], strict=True):
        now = again.step(inputs)
        assert now.hash == view.hash
        assert [e.pressed for e in now.buttons] == [e.pressed for e in view.buttons]
    for a, b in zip(now.states, session.views[-1].states, strict=True):
        assert a.position.tobytes() == b.position.tobytes()
        assert a.rotation.tobytes() == b.rotation.tobytes()


def test_without_anything_on_joints_the_choreography_is_refused() -> None:
    data = {"sites": [{"name": "a", "participants": [{"name": "ann", "motion": "workshop"}]}]}
    with pytest.raises(MotionError, match="workshop: needs a room with things on joints"):
        open_motion(Conference.model_validate(data))
