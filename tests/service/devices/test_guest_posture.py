"""A guest with mouse and keys is a whole person: they take things, touch people, make gestures, and rest when nothing comes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from vistel.capture.gestures import SECONDS
from vistel.capture.pointer import AWAY_S, PointerCapture
from vistel.conference.model import Conference, Participant, Site
from vistel.figure.posture.posture import Posture, Stance, pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import rotation_y
from vistel.protocol.pages.pointer import Pointed, PointerDecoder, posture_record
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.people import build_of
from vistel.space.room import BATON, meeting_room, seat_pose
from vistel.space.world import World
from vistel.v1.device_pb2 import PointerFrame
from vistel_sim.motion import open_motion

STEP_NS = 16_666_667
BUILD = build_of(1.75, 1.0)


class Guest:
    """On a seat of a meeting room."""

    def __init__(self, seats: int = 3, seat: int = 0) -> None:
        position, heading = seat_pose(seats, seat)
        self.capture = PointerCapture("ann", BUILD, Stance(position, heading))
        self._decoder, self._facing, self._seat = PointerDecoder("ann-pointer"), rotation_y(heading), position
        self.t_ns = 10**18

    def into_seat(self, p_room: np.ndarray) -> tuple[float, float, float]:
        x, y, z = self._facing.T @ (p_room - self._seat)
        return float(x), float(y), float(z)

    def into_room(self, p_seat: tuple[float, float, float]) -> np.ndarray:
        return self._facing @ np.array(p_seat) + self._seat

    def does(self, record: bytes | None = None) -> Posture:
        """One step on; record: what the page says, None for nothing."""
        self.t_ns += STEP_NS
        for frame in self._decoder.feed(record, self.t_ns) if record else ():
            self.capture.take(frame)
        return self.capture.solve(self.t_ns)

    def joints(self, posture: Posture) -> np.ndarray:
        """(J, 3) in the seat's frame."""
        return (pose_joints(BUILD.skeleton, posture).position - self._seat) @ self._facing


def stepped(world: World, guest: Guest, posture: Posture, step: int, **others: Posture) -> object:
    moved = [MotionInput(name, p, step, guest.t_ns) for name, p in {"ann": posture, **others}.items()]
    people = tuple(ParticipantBody(m.participant) for m in moved) if step == 1 else ()
    return world.step(StepInputs(step, guest.t_ns, people, tuple(moved)))


def test_a_guest_takes_the_baton_from_the_table_lifts_it_and_lets_go() -> None:
    guest, world = Guest(), World(meeting_room(3))

    def baton() -> np.ndarray:
        return next(t for t in world.things_now if t.id == BATON).position

    lies = baton()
    up: dict[int, float] = {}
    held: dict[int, bool] = {}
    for k in range(1, 300):
        height = 0.010 + 0.2 * min(1.0, max(0.0, (k - 120) / 60))
        place = guest.into_seat(lies + np.array([0.0, height, 0.0]))
        record = posture_record(0.1, -0.4, right=Pointed(place, 0.0, True)) if k < 240 else posture_record(0.1, -0.4)
        view = stepped(world, guest, guest.does(record), k)
        held[k], up[k] = bool(view.grasps), float(baton()[1] - lies[1])
    assert not held[20] and held[120] and held[239] and not held[299]
    assert up[235] > 0.12


@pytest.mark.parametrize(
    ("thing", "seat"),
    [("box", 0), ("box", 2), ("ball", 0), ("ball", 2), ("can", 2), ("ring", 0), ("ring", 1), ("cone", 1), ("tile", 1), ("tile", 2)],
)
def test_a_guest_takes_every_small_thing_within_reach(thing: str, seat: int) -> None:
    _takes(thing, Guest(seat=seat), World(meeting_room(3)))


@pytest.mark.parametrize("thing", ["ball", "box", "can", "cone", "ring", "tile"])
@pytest.mark.parametrize("aside", [-0.1, 0.1])
def test_a_guest_leans_far_over_the_table_to_take_a_small_thing(thing: str, aside: float) -> None:
    guest, room = Guest(seats=8), meeting_room(8)
    lies = guest.into_room((aside, 0.0, 0.8))
    moved = {t.id: replace(t, position=np.array((lies[0], t.position[1], lies[2]))) for t in room.things if t.id == thing}
    loose = {"ball", "box", "can", "cone", "ring", "tile", BATON} - {thing}
    things = tuple(moved.get(t.id, t) for t in room.things if t.id not in loose)
    _takes(thing, guest, World(replace(room, things=things)))


def _takes(thing: str, guest: Guest, world: World) -> None:
    """Led as the page leads a hand to what is pressed (clients/web/join/hand.ts)."""
    lies = next(t for t in world.things_now if t.id == thing).position
    away = (lies - guest.into_room((0.0, 1.2, 0.0))) * (1.0, 0.0, 1.0)
    place = guest.into_seat(lies + 0.03 * away / np.linalg.norm(away) + (0.0, 0.01, 0.0))
    hand = {"left" if place[0] > 0.05 else "right": Pointed(place, None, True)}
    for k in range(1, 120):
        if stepped(world, guest, guest.does(posture_record(0.1, -0.4, **hand)), k).grasps:
            return
    raise AssertionError(f"{thing} lies where it lay")


def test_a_guests_hand_on_the_shoulder_of_somebody_tracked_deforms_both() -> None:
    seats = 8
    people = [Participant(name=name, seat=n) for n, name in enumerate(("ann", "bob"))]
    conference = Conference.model_validate({"room": {"seats": seats}, "sites": [Site(name="a", participants=people)]})
    bob = open_motion(conference).posture("bob", 1.0)
    guest, world = Guest(seats), World(meeting_room(seats))
    shoulder = pose_joints(BUILD.skeleton, bob).position[JOINT_INDEX["right_upper_arm"]]
    deformed: set[tuple[str, str]] = set()
    side = "left" if guest.into_seat(shoulder)[0] > 0 else "right"
    for k in range(1, 180):
        hand = {side: Pointed(guest.into_seat(shoulder + np.array([0.0, 0.04, 0.0])))}
        view = stepped(world, guest, guest.does(posture_record(0.6, 0.0, **hand)), k, bob=bob)
        deformed |= {(g.target, g.source) for g in view.ghosts}
    assert {("ann", "bob"), ("bob", "ann")} <= deformed


@pytest.mark.parametrize("gesture", SECONDS)
def test_gestures_come_and_go_smoothly_and_end_where_they_began(gesture: int) -> None:
    guest = Guest()
    before = [guest.joints(guest.does(posture_record())) for _ in range(60)][-1]
    moved = [guest.joints(guest.does(posture_record(gesture=gesture, number=1))) for _ in range(round(60 * SECONDS[gesture]) + 90)]
    farthest = max(float(np.abs(m - before).max()) for m in moved)
    assert 0.02 < farthest < 0.9
    assert np.abs(moved[-1] - before).max() < 0.02
    assert np.abs(np.diff([before, *moved], axis=0)).max() * 60 < 3.5  # [m/s], of a fingertip that waves


def test_hands_that_clap_meet_and_part() -> None:
    guest = Guest()
    knuckles = [JOINT_INDEX[f"{side}_middle_proximal"] for side in ("left", "right")]
    clapping = [guest.joints(guest.does(posture_record(gesture=PointerFrame.GESTURE_CLAP, number=1))) for _ in range(110)][50:]
    apart = [float(np.linalg.norm(np.subtract(*j[knuckles]))) for j in clapping]
    assert min(apart) < 0.05 and max(apart) > 0.13
    assert sum(a >= b < c for a, b, c in zip(apart, apart[1:], apart[2:], strict=False)) >= 3  # claps in a second


def test_what_a_page_says_in_leaps_is_done_by_a_body() -> None:
    guest, rng = Guest(), np.random.default_rng(3)
    postures: list[Posture] = []
    for _ in range(200):
        left, right = (Pointed(tuple(rng.uniform((-1.5, 0.0, -1.5), (1.5, 2.1, 1.5)).tolist())) for _ in range(2))
        yaw, pitch = rng.uniform((-2.0, -1.3), (2.0, 1.3))
        postures.append(guest.does(posture_record(yaw, pitch, left, right, gesture=int(rng.integers(7)))))
    joints = np.array([guest.joints(p) for p in postures])
    assert np.isfinite(joints).all() and all(np.isfinite(p.dofs).all() and np.abs(p.gaze).max() < 0.6 for p in postures)
    head = joints[:, JOINT_INDEX["head"]]
    assert np.abs(np.diff(head, axis=0)).max() * 60 < 2.0
    assert head[:, 1].min() > 0.7 and np.linalg.norm(head[:, [0, 2]], axis=1).max() < 0.75  # on the chair


def test_a_page_in_the_background_lets_the_figure_rest_and_live() -> None:
    guest = Guest()
    for _ in range(90):
        guest.does(posture_record(1.0, 0.3, right=Pointed((-0.2, 0.9, 0.5), None, True)))
    reached = guest.joints(guest.does())[JOINT_INDEX["right_hand"]]
    resting = [guest.does() for _ in range(round(60 * (AWAY_S + 6.0)))]
    hand = guest.joints(resting[-1])[JOINT_INDEX["right_hand"]]
    assert reached[1] > 0.8 and hand[1] < 0.7  # in the lap
    assert min(float(p.lids[0]) for p in resting if p.lids is not None) < 0.3  # it blinks
    chests = np.array([guest.joints(p)[JOINT_INDEX["left_shoulder"]] for p in resting[-240:]])
    assert 0.001 < np.ptp(chests, axis=0).max() < 0.03  # it breathes
    assert math.isclose(float(np.median([p.gaze[0] for p in resting[-60:]])), 0.0, abs_tol=0.1)
