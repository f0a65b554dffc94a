"""A guest before a camera: what is found in its pictures, here of a known posture, becomes that posture again."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator
from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from vistel.capture.pointer import PointerCapture
from vistel.figure.posture.limits import within_limits
from vistel.figure.posture.posture import JointPose, Posture, Stance, pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.protocol.pages.camera_body import FACE, CameraBodyDecoder, Seen, camera_record
from vistel.protocol.pages.pointer import Pointed, PointerDecoder, posture_record
from vistel.space.people import build_of
from vistel.v1.device_pb2 import PointerFrame
from vistel_sim.pages.camera_body import SimulatedCamera, face_at_rest

STEP_NS = 16_666_667
CALIBRATION_S = 8.0
BUILD = build_of(1.75, 1.0)
RAISED = posture_record(0.0, 0.0, Pointed((0.32, 1.22, 0.25)), Pointed((-0.32, 1.22, 0.25)))
LED = posture_record(0.0, 0.0, Pointed((0.25, 1.15, 0.35)), Pointed((-0.25, 1.15, 0.35)))


def calibrates(t_s: float) -> bytes:
    """A person who sits, and then raises both hands."""
    return posture_record() if t_s < CALIBRATION_S / 2 else RAISED


class Before:
    """A person, led by a page of their own, before a camera; and the guest who is made of what it sees."""

    def __init__(self, noise: float = 0.0, depth_noise: float = 0.0, focal: float = 1.3, height: float = 1.22) -> None:
        """height: of the camera [m]."""
        here = Stance(np.zeros(3), 0.0)
        self.person, self.guest = PointerCapture("ann", BUILD, here), PointerCapture("bob", BUILD, here)
        self._page, self._camera = PointerDecoder("ann"), CameraBodyDecoder("bob-camera")
        self.camera = SimulatedCamera(np.array((0.0, height, 1.05)), focal, noise, depth_noise)
        self.t_ns, self.k = 10**18, 0

    def steps(
        self, seconds: float, does: Callable[[float], bytes] | bytes, sees: Callable[[Seen], Seen | None] = lambda seen: seen
    ) -> Iterator[tuple[Posture, Posture]]:
        """The true posture and the guest's, sixty times a second; a picture every other time. sees: what of it is found."""
        for n in range(round(60 * seconds)):
            self.t_ns += STEP_NS
            self.k += 1
            for said in self._page.feed(does if isinstance(does, bytes) else does(n / 60.0), self.t_ns):
                self.person.take(said)
            true = self.person.solve(self.t_ns)
            seen = sees(self.camera.see(BUILD.skeleton, self.joints(true))) if self.k % 2 else None
            record = b"" if seen is None else camera_record(self.t_ns, seen, calibrating=self.k < 60 * CALIBRATION_S)
            for frame in self._camera.feed(record, self.t_ns):
                self.guest.see(frame)
            yield true, self.guest.solve(self.t_ns)

    def calibrated(self) -> Before:
        """The same, after calibration."""
        for _ in self.steps(CALIBRATION_S, calibrates):
            pass
        return self

    @staticmethod
    def joints(posture: Posture) -> JointPose:
        return pose_joints(BUILD.skeleton, posture)


@cache
def _calibrated() -> Before:
    return Before().calibrated()


def calibrated() -> Before:
    """Somebody before a usual camera, after calibration, which is played once for all tests."""
    return deepcopy(_calibrated())


def apart(true: Posture, guest: Posture, *joints: str) -> float:
    """How far the farthest of these joints is from where it should be [m]."""
    a, b = Before.joints(true).position, Before.joints(guest).position
    return max(float(np.linalg.norm(a[JOINT_INDEX[j]] - b[JOINT_INDEX[j]])) for j in joints)


def turned(true: Posture, guest: Posture, joint: str) -> float:
    """By how much a joint is turned against what it should be [degrees]."""
    a, b = (Before.joints(p).rotation[JOINT_INDEX[joint]] for p in (true, guest))
    return math.degrees(math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(a.T @ b)) - 1.0)))))


def moving(t_s: float) -> bytes:
    """Hands that go about before the chest, a head that looks about."""
    left = Pointed((0.22 + 0.08 * math.sin(t_s), 1.15 + 0.08 * math.cos(1.3 * t_s), 0.33 + 0.08 * math.sin(1.7 * t_s)))
    right = Pointed((-0.25 + 0.06 * math.cos(t_s), 1.15 + 0.10 * math.sin(0.8 * t_s), 0.30))
    return posture_record(0.4 * math.sin(0.9 * t_s), 0.15 * math.sin(1.1 * t_s), left, right)


@pytest.mark.parametrize(("noise", "depth_noise", "focal"), [(0.0, 0.0, 1.22), (0.002, 0.04, 1.3), (0.002, 0.04, 1.1)])
def test_a_guest_does_what_the_person_before_the_camera_does(noise: float, depth_noise: float, focal: float) -> None:
    before = Before(noise, depth_noise, focal).calibrated()
    both = [*before.steps(14.0, moving)][120:]
    wrists = [apart(*p, f"{s}_hand") for p in both for s in ("left", "right")]
    elbows = [apart(*p, f"{s}_lower_arm") for p in both for s in ("left", "right")]
    heads = [apart(*p, "head") for p in both]
    assert np.median(wrists) < 0.035 and np.quantile(wrists, 0.95) < 0.09, np.quantile(wrists, (0.5, 0.95))
    assert np.median(elbows) < 0.045 and np.quantile(elbows, 0.95) < 0.09, np.quantile(elbows, (0.5, 0.95))
    assert np.median(heads) < 0.02 and np.median([turned(*p, "head") for p in both]) < 4.0, np.median(heads)
    fingers = np.degrees(np.abs([true.hands - guest.hands for true, guest in both]))
    assert np.median(fingers) < 12.0


@pytest.mark.parametrize("gesture", [PointerFrame.GESTURE_THUMBS_UP, PointerFrame.GESTURE_POINT])
def test_fingers_are_those_that_are_seen(gesture: int) -> None:
    before = Before(0.001, 0.04, height=0.98).calibrated()  # gestures are made before the chest
    *_, (true, guest) = before.steps(1.95, posture_record(gesture=gesture, number=2))
    wanted = within_limits(true).hands[1]
    assert np.median(np.degrees(np.abs(wanted - guest.hands[1]))) < 12.0
    assert np.degrees(guest.hands[1][8]) > 50.0  # the middle finger is closed


def test_a_person_who_sits_still_makes_a_figure_that_does_not_tremble() -> None:
    before = Before(0.001, 0.03).calibrated()
    both = [*before.steps(6.0, LED)][240:]
    off = [
        Before.joints(g).position[JOINT_INDEX["left_hand"]] - Before.joints(t).position[JOINT_INDEX["left_hand"]] for t, g in both
    ]
    beside = np.array(off) - np.median(off, axis=0)
    assert np.sqrt((beside**2).sum(axis=1).mean()) < 0.012  # of which most is depth


def test_a_hand_that_moves_quickly_is_followed_within_50_ms_and_one_that_rests_moves_no_more_for_it() -> None:
    before = Before(0.001, 0.0).calibrated()

    def up_and_down(t_s: float) -> bytes:
        return posture_record(0.0, 0.0, Pointed((0.3, 1.15 + 0.3 * math.sin(math.pi * t_s), 0.3)))

    hand = JOINT_INDEX["left_hand"]
    heights = np.array([[Before.joints(p).position[hand, 1] for p in both] for both in before.steps(10.0, up_and_down)])[120:]
    late = [float(np.corrcoef(heights[: len(heights) - n, 0], heights[n:, 1])[0, 1]) for n in range(12)]
    assert np.argmax(late) <= 3, "steps of 17 ms"
    before = Before(0.002, 0.04).calibrated()
    rests = np.array([Before.joints(guest).position[hand] for _, guest in before.steps(8.0, LED)])[240:]
    assert np.percentile(np.linalg.norm(np.diff(rests, axis=0), axis=1), 95) < 0.0075


@pytest.mark.parametrize("away_s", [0.3, 1.0, 2.0, 6.0])
def test_a_hand_that_leaves_the_picture_goes_on_plausibly_and_comes_back_without_a_jump(away_s: float) -> None:
    before = calibrated()

    def without_left(seen: Seen) -> Seen:
        visible = [0.0 if "left" in name and "shoulder" not in name else 1.0 for name in _BODY]
        return Seen(seen.body, visible, (), seen.right_hand, seen.face)

    for _ in before.steps(2.0, LED):
        pass
    gone = [guest for _, guest in before.steps(away_s, RAISED, without_left)]
    back = [guest for _, guest in before.steps(2.0, RAISED)]
    turns = np.array([[Before.joints(p).rotation[JOINT_INDEX[f"left_{j}"]] for j in _ARM] for p in [*gone, *back]])
    cosines = 0.5 * (np.einsum("njab,njab->nj", turns[1:], turns[:-1]) - 1.0)
    angles = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    assert angles.max() < 5.0, (angles.max(), np.unravel_index(angles.argmax(), angles.shape))
    if away_s > 3.0:
        assert Before.joints(gone[-1]).position[JOINT_INDEX["left_hand"], 1] < 0.75  # in the lap
    assert all(np.array_equal(within_limits(p).dofs, p.dofs) for p in gone)


def test_who_is_not_in_the_picture_idles_and_mouse_and_keys_go_on() -> None:
    before = calibrated()
    idle = [guest for _, guest in before.steps(5.0, LED, lambda _: Seen())]
    assert apart(idle[-1], at_rest(), "left_hand", "right_hand") < 0.03
    for said in PointerDecoder("bob").feed(LED, before.t_ns):
        before.guest.take(said)
    led = [guest for _, guest in before.steps(1.5, posture_record(), lambda _: Seen())]
    assert Before.joints(led[-1]).position[JOINT_INDEX["left_hand"], 1] > 1.0


def at_rest() -> Posture:
    """Of a guest of whom nothing is known."""
    rests = PointerCapture("bob", BUILD, Stance(np.zeros(3), 0.0))
    return [rests.solve(10**18 + k * STEP_NS) for k in range(240)][-1]


def test_a_hand_that_the_mouse_leads_is_the_mouses_and_the_other_the_cameras() -> None:
    before = calibrated()
    for _ in before.steps(1.0, LED):
        pass
    led = posture_record(left=Pointed((0.3, 0.9, 0.4)))
    joints = np.zeros((0, 3))
    for _ in range(3):
        for said in PointerDecoder("bob").feed(led, before.t_ns):
            before.guest.take(said)
        joints = Before.joints([guest for _, guest in before.steps(1.0, LED)][-1]).position
    assert joints[JOINT_INDEX["left_hand"], 1] < 1.0 < joints[JOINT_INDEX["right_hand"], 1]


def test_a_face_opens_its_mouth_smiles_shuts_its_eyes_and_looks_aside() -> None:
    before = calibrated()

    def seen_with(**moved_mm: tuple[float, float]) -> Posture:
        face = face_at_rest()
        for name, (x, y) in moved_mm.items():
            face[FACE.index(name), :2] += np.array((x, y)) * 1e-3

        def sees(_: Seen) -> Seen:
            return before.camera.see(BUILD.skeleton, before.joints(before.person.solve(before.t_ns + 1)), face)

        return [guest for _, guest in before.steps(1.2, posture_record(), sees)][-1]

    rest = seen_with()
    assert rest.face is not None and rest.lids is not None and rest.lids.min() > 0.9
    open_ = seen_with(lower_lip=(0, -26), chin=(0, -26))
    assert open_.face is not None and open_.face[11, 1] < rest.face[11, 1] - 0.012  # the lower lip
    smile = seen_with(left_mouth_corner=(8, 7), right_mouth_corner=(-8, 7))
    assert smile.face is not None and smile.face[8, 1] > rest.face[8, 1] + 0.004  # its left corner
    shut = seen_with(left_upper_lid=(0, -9), right_upper_lid=(0, -9))
    assert shut.lids is not None and shut.lids.max() < 0.3
    aside = seen_with(left_iris=(5, 0), right_iris=(5, 0))
    assert aside.gaze[0] > 0.2


def test_a_record_that_is_late_or_out_of_order_changes_nothing() -> None:
    before = calibrated()
    old = camera_record(before.t_ns - 10**9, before.camera.see(BUILD.skeleton, Before.joints(Posture())))
    *_, (_, was) = before.steps(1.0, RAISED)
    for frame in CameraBodyDecoder("bob-camera").feed(old, before.t_ns):
        before.guest.see(frame)
    before.t_ns += STEP_NS
    assert apart(was, before.guest.solve(before.t_ns), "left_hand") < 0.01


@pytest.mark.parametrize("seed", range(4))
def test_whatever_a_page_says_of_its_camera_the_posture_is_one_that_people_can_have_at_their_seat(seed: int) -> None:
    before, random = Before(), np.random.default_rng(seed)
    decoder = CameraBodyDecoder("bob-camera")
    taken = 0
    for n in range(150):
        before.t_ns += STEP_NS
        head = b"VP\x05" + bytes((31 if n % 3 else 15,)) + struct.pack("<d", before.t_ns * 1e-6)
        body = np.array(random.normal(0.0, 4000.0, (9, 2)), np.int16)
        body[1:3] = ((2500, 0), (-2500, 0)) if n % 2 else body[1:3]  # else it would hardly ever be believed
        rows = b"".join(struct.pack("<hhbB", *xy, *random.integers((-128, 0), (128, 256)).tolist()) for xy in body.tolist())
        meshes = b"".join(struct.pack("<hhH", 0, 0, int(random.choice((1, 900, 8000)))) + random.bytes(3 * k) for k in (21, 21, 22))
        for frame in decoder.feed(head + rows + meshes, before.t_ns):
            taken += 1
            before.guest.see(frame)
        posture = before.guest.solve(before.t_ns)
        for values in (posture.dofs, posture.hands, posture.gaze, posture.lids, posture.face):
            assert values is None or np.isfinite(values).all()
        assert np.array_equal(within_limits(posture).hands, posture.hands)
        assert np.abs(before.joints(posture).position).max() < 3.0
    assert taken > 100


_BODY = (
    "nose", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip",
)  # fmt: skip
_ARM = ("upper_arm", "lower_arm", "hand")
