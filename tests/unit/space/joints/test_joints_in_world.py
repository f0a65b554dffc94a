"""Things on joints in a room with people: hands, mice, commands and buttons lead them, and none takes them off their joints."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from test_world_steps import STEP_NS, Play, reaching

from vistel.conference.files import load
from vistel.conference.rooms import interior_of
from vistel.figure.posture.posture import Posture, Stance, standing
from vistel.geometry.rotation import quaternion_from_matrix, rotation_y
from vistel.space.actions import Copy, Delete, Move, Open, Paint, Reset, Turn, Undo
from vistel.space.arguments import Which
from vistel.space.commands.phrase import read
from vistel.space.inputs import CommandInput, MotionInput, ParticipantBody, PropInput, StepInputs
from vistel.space.joints.joined import MOST_WAY, joined
from vistel.space.joints.joint import Joint, JointFrame, JointKind
from vistel.space.room import Room
from vistel.space.snapshot import decode
from vistel.space.things.things import GraspAxis, Thing, ThingPrimitive
from vistel.space.world import World

FILE = Path(__file__).parents[4] / "examples/conferences/workshop.toml"
WORKSHOP = interior_of(load(FILE).room).room
START = np.array([0.0, 0.9, 0.0])
AHEAD = quaternion_from_matrix(rotation_y(-0.5 * math.pi))
"""Turns X to Z."""
LIMIT = 0.2


def rail() -> Room:
    """A bar that slides along Z, 0.2 m both ways."""
    bar = ThingPrimitive("cone_sphere", (-0.2, 0.0, 0.0, 0.2, 0.0, 0.0, 0.012, 0.012))
    axis = GraspAxis(np.zeros(3), np.array([1.0, 0.0, 0.0]), 0.012)
    handle = Thing("handle", "handle", "bar", (bar,), 0.5, 0.0, 0xFF0000FF, START, axes=(axis,))
    frames = JointFrame(START, AHEAD), JointFrame(np.zeros(3), AHEAD)
    return Room((), (handle,), joints=(Joint("rail", JointKind.SLIDER, "handle", "", *frames, -LIMIT, LIMIT),), source="test")


class Rail(Play):
    def __init__(self, *people: str) -> None:
        super().__init__(*people)
        self.world = World(rail())

    def place(self) -> np.ndarray:
        return self.thing("handle").position

    def holders(self) -> list[str]:
        return [g.participant for g in self.views[-1].grasps]


def takes(play: Rail, who: str, at: np.ndarray, heading: float = 0.0, **others: Posture) -> None:
    """Somebody comes to the bar with an open hand and closes it round it."""
    for k in range(30):
        play.step({who: reaching(at, max(0.0, (k - 5) / 20), heading), **others})
    assert who in play.holders()


def test_a_hand_leads_it_along_its_joint_and_nowhere_else() -> None:
    play = Rail("ann")
    takes(play, "ann", START)
    for k in range(60):
        aside = np.array([0.015 * math.sin(0.2 * k), 0.015 * math.cos(0.2 * k), 0.0])
        play.step({"ann": reaching(START + aside - np.array([0.0, 0.0, 0.002 * k]), 1.0)})
        np.testing.assert_allclose(play.place()[:2], START[:2], atol=1e-12)
    assert play.holders() == ["ann"]
    assert play.place()[2] == pytest.approx(-0.12, abs=0.02)


def test_a_hand_that_goes_on_beyond_the_limit_slips_off_and_the_thing_stays_at_it() -> None:
    play = Rail("ann")
    takes(play, "ann", START)
    for k in range(120):
        play.step({"ann": reaching(START - np.array([0.0, 0.0, 0.005 * k]), 1.0)})
        assert abs(play.place()[2]) <= LIMIT + 1e-9
    assert play.holders() == []
    assert play.place()[2] == pytest.approx(-LIMIT, abs=1e-6)


def test_a_hand_that_is_torn_away_in_one_step_takes_nothing_far() -> None:
    play = Rail("ann")
    takes(play, "ann", START)
    before = play.place()[2]
    play.step({"ann": reaching(START + np.array([5.0, 0.0, -8.0]), 1.0)})
    assert abs(play.place()[2] - before) <= MOST_WAY + 1e-9
    assert np.isfinite(play.place()).all()


def test_two_who_pull_against_each_other_keep_it_between_them_until_one_loses_it() -> None:
    play = Rail("ann", "bob")
    left, right = START + np.array([0.1, 0.0, 0.0]), START - np.array([0.1, 0.0, 0.0])
    open_hand = reaching(right + np.array([0.0, 0.0, 0.5]), 0.0, math.pi)
    takes(play, "ann", left, bob=open_hand)
    takes(play, "bob", right, math.pi, ann=reaching(left, 1.0))
    assert set(play.holders()) == {"ann", "bob"}
    both = 0
    for k in range(150):
        pull = np.array([0.0, 0.0, 0.001 * k])
        play.step({"ann": reaching(left - pull, 1.0), "bob": reaching(right + pull, 1.0, math.pi)})
        both += len(play.holders()) == 2
        assert abs(play.place()[2]) <= LIMIT + 1e-9
        np.testing.assert_allclose(play.place()[:2], START[:2], atol=1e-12)
        if len(play.holders()) == 2:
            assert abs(play.place()[2]) < 0.03
    assert both > 10
    assert len(play.holders()) < 2


def test_the_hand_feels_what_holds_it_back() -> None:
    play = Rail("ann")
    takes(play, "ann", START)
    for k in range(12):
        play.step({"ann": reaching(START + np.array([0.0, 0.0005 * k, 0.0]), 1.0)})
    pull = next(h.pull for h in play.views[-1].hands if h.right)
    assert pull[1] < -1.0
    assert abs(pull[2]) < 1.0


def test_a_mouse_drags_it_along_its_joint_and_lets_it_go_on_it() -> None:
    play = Rail("ann")
    play.step({"ann": standing()})
    for k in range(40):
        at = START + np.array([0.3, 0.2, 0.01 * k])
        play.k += 1
        prop = PropInput("handle", at, np.array([0.0, 0.0, 0.0, 1.0]), play.k * STEP_NS, led_by="ann", let_go=k == 39)
        play.views.append(play.world.step(StepInputs(play.k, play.k * STEP_NS, props=(prop,))))
        np.testing.assert_allclose(play.place()[:2], START[:2], atol=1e-12)
        assert play.place()[2] <= LIMIT + 1e-9
    assert play.place()[2] == pytest.approx(LIMIT, abs=0.01)


class Workshop:
    """Ann in the workshop."""

    def __init__(self) -> None:
        self.world = World(WORKSHOP)
        self.k = 0
        self.events: list[str] = []
        self.step(people=(ParticipantBody("ann"),))

    def step(self, **inputs: object) -> None:
        self.k += 1
        self.view = self.world.step(StepInputs(self.k, self.k * STEP_NS, **inputs))  # pyright: ignore[reportArgumentType]
        self.events += [f"{e.thing} {'pressed' if e.pressed else 'released'} {e.participant}".strip() for e in self.view.buttons]

    def ask(self, action: object, wait: int = 130) -> str:
        """The reason of a refusal, or nothing; then the world goes on for some steps."""
        if isinstance(action, str):
            action = read(action)
        self.step(commands=(CommandInput(f"c{self.k}", "ann", action),))  # pyright: ignore[reportArgumentType]
        outcome = self.view.outcomes[0]
        for _ in range(wait):
            self.step()
        return outcome.reason

    def along(self, joint: str) -> float:
        j = joined(self.world.room.joints, self.view.things)
        k = next(k for k, each in enumerate(j.joints) if each.id == joint)
        return j.coordinate(k, np.array([s.position for s in self.view.states]), np.array([s.rotation for s in self.view.states]))


def test_lid_drawer_and_door_open_and_close_when_asked_within_their_limits() -> None:
    shop = Workshop()
    for line, joint, wanted in (
        ("open the box", "chest-hinge", math.radians(105.0)),
        ("open the drawer 0.5", "drawer-slide", 0.085),
        ("open door", "door-hinge", math.radians(110.0)),
        ("close the lid", "chest-hinge", 0.0),
        ("close the drawer", "drawer-slide", 0.0),
        ("open lid 0.3", "chest-hinge", math.radians(31.5)),
    ):
        assert shop.ask(line) == ""
        assert shop.along(joint) == pytest.approx(wanted, abs=0.01), line
    assert shop.ask(Undo()) == ""
    assert shop.along("chest-hinge") == pytest.approx(0.0, abs=0.01)


def test_a_spring_closes_the_lid_of_the_tin_again() -> None:
    shop = Workshop()
    assert shop.ask("open tin", wait=40) == ""
    assert shop.along("tin-hinge") > 1.0
    for _ in range(180):
        shop.step()
    assert shop.along("tin-hinge") == pytest.approx(0.0, abs=1e-6)


def test_what_is_pushed_goes_as_far_as_its_joint_does_and_that_way_only() -> None:
    shop = Workshop()
    standing_at = Posture(standing().dofs, stance=Stance(np.array([0.0, 0.0, -1.2]), 0.0))
    shop.step(motions=(MotionInput("ann", standing_at, 1, 1),))
    assert shop.ask("move drawer back 10 cm") == ""
    assert shop.along("drawer-slide") == pytest.approx(0.10, abs=0.003)
    assert shop.ask("move drawer back 50 cm") == ""
    assert shop.along("drawer-slide") == pytest.approx(0.17, abs=1e-6)
    assert shop.ask("move drawer back 5 cm") == "the drawer does not go that way"
    assert shop.ask("move drawer left 5 cm") == "the drawer does not go that way"


def test_a_button_is_pressed_by_a_word_and_by_a_mouse_and_comes_back() -> None:
    shop = Workshop()
    assert shop.ask("press the button") == "nobody knows yet where ann is"
    place = shop.view.states[[s.id for s in shop.view.states].index("button")].position
    for k in range(20):
        prop = PropInput("button", place, np.array([0.0, 0.0, 0.0, 1.0]), shop.k * STEP_NS, led_by="ann", let_go=k == 19)
        shop.step(props=(prop,))
    for _ in range(30):
        shop.step()
    assert shop.events == ["button pressed ann", "button released"]
    assert next(t.colour for t in shop.view.things if t.id == "lamp") == 0xFFD75EFF
    assert shop.along("switch") == pytest.approx(0.0, abs=1e-4)
    kept = decode(shop.world.snapshot())[1]
    assert next(t.colour for t in kept.things if t.id == "lamp") == 0xFFD75EFF


def test_what_hangs_on_a_joint_is_not_carried_off_by_a_command() -> None:
    shop = Workshop()
    for action in (Move(Which("door"), np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])), Turn(Which("door"), 0.3)):
        assert "hangs on a joint" in shop.ask(action, wait=1)
    assert "several things" in shop.ask("open cabinet", wait=1)
    assert shop.ask("open lamp", wait=1) == "the lamp does not open"
    assert "share of 0 to 1" in shop.ask(Open(Which("door"), 1.5), wait=1)
    assert shop.ask(Paint(Which("door"), 0xFF0000FF), wait=1) == ""
    assert shop.ask("open door") == ""
    assert shop.along("door-hinge") > 1.8


def test_a_thing_without_its_base_is_free_and_comes_back_to_its_joint_when_all_is_put_back() -> None:
    shop = Workshop()
    assert shop.ask(Delete(Which("tin"))) == ""
    assert shop.ask(Copy(Which("door")), wait=1) == "nobody knows yet where ann is"
    lid = next(s for s in shop.view.states if s.id == "tin-lid")
    assert lid.position[1] < 0.74
    assert shop.ask(Reset()) == ""
    assert shop.along("tin-hinge") == pytest.approx(0.0, abs=1e-9)


def test_a_kept_room_is_resumed_with_its_drawer_open() -> None:
    shop = Workshop()
    shop.ask("open the drawer")
    later = World.restore(shop.world.snapshot()).resumed(WORKSHOP, 10**12)
    view = later.step(StepInputs(shop.k + 1, 10**12 + STEP_NS))
    drawer = next(s for s in view.states if s.id == "drawer")
    assert WORKSHOP.thing("drawer").position[2] - drawer.position[2] == pytest.approx(0.17, abs=1e-6)
