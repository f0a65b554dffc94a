"""A guest with a headset: what it measures, here of a known posture, becomes that posture again; they take things, and rest when
nobody wears it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from vistel.capture.headset import BELIEVED, held_fingers
from vistel.capture.pointer import PointerCapture
from vistel.figure.posture.hands import OPEN
from vistel.figure.posture.posture import JointPose, Posture, Stance, pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import rotation_y
from vistel.protocol.pages.headset import HeadsetDecoder, headset_record
from vistel.protocol.pages.pointer import Pointed, PointerDecoder, posture_record
from vistel.protocol.pinch import angles
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.people import build_of
from vistel.space.room import BATON, meeting_room, seat_pose
from vistel.space.world import World
from vistel_sim.pages.headset import SimulatedHeadset

STEP_NS = 16_666_667
BUILD = build_of(1.75, 1.0)
WRISTS = ("left_hand", "right_hand")


class Worn:
    """A person, led by a page of their own, who wears a headset; and the guest who is made of what it measures."""

    def __init__(self, headset: SimulatedHeadset | None = None) -> None:
        position, heading = seat_pose(3, 0)
        self.seat = Stance(position, heading)
        self.person, self.guest = PointerCapture("ann", BUILD, self.seat), PointerCapture("bob", BUILD, self.seat)
        self._page, self._decoder = PointerDecoder("ann"), HeadsetDecoder("bob-headset")
        self.headset = headset or SimulatedHeadset()
        self.t_ns, self.k = 10**18, 0
        self.fingers: dict[int, np.ndarray] = {}
        """Angles (20,) that the person has instead, by hand."""

    def in_seat(self, joints: JointPose) -> JointPose:
        facing = rotation_y(self.seat.heading)
        return JointPose(facing.T @ joints.rotation, (joints.position - self.seat.position) @ facing)

    def into_seat(self, p_room: np.ndarray) -> tuple[float, float, float]:
        x, y, z = rotation_y(self.seat.heading).T @ (p_room - self.seat.position)
        return float(x), float(y), float(z)

    def step(self, does: bytes, *, worn: bool = True, says: bool = True) -> tuple[Posture, Posture]:
        """The true posture and the guest's a sixtieth of a second later; records come every other time. says: whether they come."""
        self.t_ns += STEP_NS
        self.k += 1
        for said in self._page.feed(does, self.t_ns):
            self.person.take(said)
        true = self.person.solve(self.t_ns)
        if self.fingers:
            true = replace(true, hands=np.array([self.fingers.get(n, row) for n, row in enumerate(true.hands)]))
        if says and self.k % 2:
            here = self.in_seat(pose_joints(BUILD.skeleton, true))
            record = self.headset.record(self.t_ns, BUILD.skeleton, here) if worn else headset_record(self.t_ns, None)
            frames = self._decoder.feed(record, self.t_ns)
            assert frames, "what a headset on a seated person measures is believed"
            self.guest.see(frames[0])
        return true, self.guest.solve(self.t_ns)

    def steps(self, seconds: float, does: bytes, *, worn: bool = True, says: bool = True) -> Iterator[tuple[Posture, Posture]]:
        """So many of them."""
        for _ in range(round(60 * seconds)):
            yield self.step(does, worn=worn, says=says)


def apart(true: Posture, guest: Posture, *joints: str) -> float:
    """How far the farthest of these joints is from where it should be [m]."""
    a, b = (pose_joints(BUILD.skeleton, p).position for p in (true, guest))
    return max(float(np.linalg.norm(a[JOINT_INDEX[j]] - b[JOINT_INDEX[j]])) for j in joints)


def moving(t_s: float) -> bytes:
    """Hands that go about before the chest, a head that looks about."""
    left = Pointed((0.22 + 0.08 * math.sin(t_s), 1.15 + 0.08 * math.cos(1.3 * t_s), 0.33 + 0.08 * math.sin(1.7 * t_s)))
    right = Pointed((-0.25 + 0.06 * math.cos(t_s), 1.15 + 0.10 * math.sin(0.8 * t_s), 0.30))
    return posture_record(0.6 * math.sin(0.9 * t_s), 0.15 * math.sin(1.1 * t_s), left, right)


LED = posture_record(0.0, 0.0, Pointed((0.25, 1.15, 0.35)), Pointed((-0.25, 1.15, 0.35)))


@pytest.mark.parametrize("noise", [0.0, 0.001])
def test_a_guest_does_what_the_person_with_the_headset_does(noise: float) -> None:
    worn = Worn(SimulatedHeadset(noise))
    both = [worn.step(moving(n / 60.0)) for n in range(900)][180:]
    heads, wrists = [apart(*p, "head") for p in both], [apart(*p, *WRISTS) for p in both]
    assert np.quantile(heads, 0.95) < 0.005, np.quantile(heads, (0.5, 0.95))
    assert np.quantile(wrists, 0.95) < 0.02, np.quantile(wrists, (0.5, 0.95))  # hands that move are shown some hundredths later
    elbows = [apart(*p, "left_lower_arm", "right_lower_arm") for p in both]
    assert np.quantile(elbows, 0.95) < 0.04, np.quantile(elbows, (0.5, 0.95))
    fingers = np.degrees(np.abs([true.hands - guest.hands for true, guest in both]))
    assert np.median(fingers) < 3.0 and np.quantile(fingers, 0.95) < 12.0, np.quantile(fingers, (0.5, 0.95))


def test_controllers_lead_the_hands_that_hold_them() -> None:
    worn = Worn(SimulatedHeadset(pressed={"left": (0.0, 0.0), "right": (1.0, 1.0)}))
    *_, (true, guest) = worn.steps(4.0, LED)
    assert apart(true, guest, *WRISTS) < 0.04
    a, b = (pose_joints(BUILD.skeleton, p).rotation for p in (true, guest))
    for hand in WRISTS:
        turned = float(np.trace(a[JOINT_INDEX[hand]].T @ b[JOINT_INDEX[hand]]))
        assert math.degrees(math.acos(min(1.0, 0.5 * (turned - 1.0)))) < 2.0
    assert np.degrees(guest.hands[1, 4::4]).min() > 70.0 and np.degrees(guest.hands[0, 4::4]).max() < 30.0


def test_a_trigger_bends_the_index_finger_and_a_squeeze_the_other_three_with_the_thumb_beside_either() -> None:
    pulled, squeezed, none = held_fingers(1.0, 0.0), held_fingers(0.0, 1.0), held_fingers(0.0, 0.0)
    assert pulled[4] > 1.2 and np.allclose(pulled[8:], none[8:])
    assert np.allclose(squeezed[4:8], none[4:8]) and squeezed[[8, 12, 16]].min() > 1.2
    assert np.allclose(pulled[:4], squeezed[:4]) and not np.allclose(pulled[:4], none[:4])


@pytest.mark.parametrize("silent", [False, True])
def test_a_headset_that_is_taken_off_lets_the_figure_rest_and_comes_back_without_a_jump(silent: bool) -> None:
    """Whether the page says so, or nothing at all comes any more."""
    worn = Worn()
    before = [*worn.steps(3.0, LED)][-1][1]
    away = [guest for _, guest in worn.steps(5.0, LED, worn=False, says=not silent)]
    places = [worn.in_seat(pose_joints(BUILD.skeleton, p)).position for p in (before, away[-1])]
    for hand in WRISTS:
        assert places[0][JOINT_INDEX[hand], 1] > 1.0 and places[1][JOINT_INDEX[hand], 1] < 0.75, "in the lap"
    aside = posture_record(0.5, -0.2, Pointed((0.30, 1.30, 0.30)), Pointed((-0.10, 1.00, 0.45)))
    back = [*worn.steps(4.0, aside)]
    assert apart(*back[-1], "head", *WRISTS) < 0.01
    way = np.array([pose_joints(BUILD.skeleton, p).position for p in [away[-1], *(guest for _, guest in back)]])
    fastest = np.linalg.norm(np.diff(way, axis=0), axis=2).max() * 60.0
    assert fastest < 3.0, f"{fastest:.1f} m/s"


@pytest.mark.parametrize("at_once", [1, 4])
def test_records_that_a_link_held_up_and_that_come_all_at_once_throw_no_hand_up(at_once: int) -> None:
    """The hand's speed is that between measurements, however soon after each other they arrive."""
    worn, held = Worn(), list[bytes]()
    decoder = HeadsetDecoder("bob-headset")
    places = list[np.ndarray]()
    for n in range(600):
        true, guest = worn.step(moving(n / 60.0), says=False)
        if n % 2:
            held.append(worn.headset.record(worn.t_ns, BUILD.skeleton, worn.in_seat(pose_joints(BUILD.skeleton, true))))
        if len(held) == at_once:
            for k, record in enumerate(held):
                for frame in decoder.feed(record, worn.t_ns + 300_000 * k):
                    worn.guest.see(frame)
            held.clear()
        places.append(worn.in_seat(pose_joints(BUILD.skeleton, guest)).position[[JOINT_INDEX[w] for w in WRISTS]])
    fastest = np.linalg.norm(np.diff(places[180:], axis=0), axis=2).max() * 60.0
    assert fastest < 1.0, f"{fastest:.1f} m/s"


def test_what_the_headset_itself_is_not_sure_of_is_not_believed() -> None:
    worn = Worn()
    before = [*worn.steps(3.0, LED)][-1][1]
    for n in range(20):
        t_ns = worn.t_ns + (n + 1) * STEP_NS
        (frame,) = HeadsetDecoder("d").feed(headset_record(t_ns, (0.9, 1.9, 0.9), confidence=(BELIEVED - 1) / 255), t_ns)
        worn.guest.see(frame)
        guest = worn.guest.solve(t_ns)
    assert apart(before, guest, "head") < 0.01


@pytest.mark.parametrize("how", ["fingers", "pinch", "squeeze"])
def test_a_guest_takes_the_baton_with_fingers_a_pinch_or_a_squeeze_lifts_it_and_lets_go(how: str) -> None:
    worn, world = Worn(), World(meeting_room(3))

    def baton() -> np.ndarray:
        return next(t for t in world.things_now if t.id == BATON).position

    for _ in worn.steps(2.5, posture_record(0.1, -0.4)):  # until the figure does what they do
        pass
    lies, closed = baton().copy(), 0.0
    held, up = list[int](), list[float]()
    for k in range(1, 331):
        closed = min(1.0, max(0.0, closed + (0.05 if 120 < k < 270 else -0.05)))
        if how == "squeeze":
            worn.headset.pressed = {"right": (closed, closed)}
        elif how == "pinch":  # thumb and index finger alone
            worn.fingers = {1: OPEN + closed * (np.array(angles({0, 1})) - OPEN)}
        height = 0.010 + 0.2 * min(1.0, max(0.0, (k - 170) / 60))
        led = Pointed(worn.into_seat(lies + np.array((0.0, height, 0.0))), 0.0, how == "fingers" and k < 270)
        _, guest = worn.step(posture_record(0.1, -0.4, right=led))
        people = (ParticipantBody("bob"),) if k == 1 else ()
        view = world.step(StepInputs(k, worn.t_ns, people, (MotionInput("bob", guest, k, worn.t_ns),)))
        held.append(len(view.grasps))
        up.append(float(baton()[1] - lies[1]))
    assert not held[20] and held[265] and not held[-1], [n for n in range(1, 330) if held[n] != held[n - 1]]
    assert max(up[:265]) > 0.12
