"""Calibrations at work: a measured person among people who see other limbs, metal taken back, and the filter before it all."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from vistel.capture.body import BodyCapture
from vistel.capture.config import Person
from vistel.capture.one_euro import PoseFilter
from vistel.conference.model import Conference, Participant, Site
from vistel.figure.calibration.distortion import Distortion
from vistel.figure.calibration.files import MeasuredPerson
from vistel.figure.posture.posture import Stance, pose_joints
from vistel.figure.posture.sensors import receiver_mounts
from vistel.figure.skeleton import JOINT_INDEX, Skeleton, measured_skeleton, standard_skeleton
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.v1.device_pb2 import TrackerFrame, TrackerReceiver
from vistel_sim.motion import open_motion
from vistel_sim.motion.source import receivers_of, simulated_people

CONFERENCE = Conference(sites=[Site(name="a", participants=[Participant(name="ann", height=1.7)])])
STATIONS = {1: "chest", 2: "head", 3: "left_hand", 4: "right_hand"}
WRONG = np.array([0.03, -0.02, 0.01, 0.0, 0.0, 0.05])


def long_armed() -> Skeleton:
    standard = standard_skeleton(1.7)
    names = [f"{s}_{p}" for s in ("left", "right") for p in ("lower_arm", "hand")]
    return measured_skeleton(standard, {n: 1.12 * standard.offsets[JOINT_INDEX[n]] for n in names}, 0.0)


def solved(body: MeasuredPerson | None, distortion: Distortion | None, error: np.ndarray) -> dict[str, float]:
    """Largest error [m] of the hands that others see, of a long-armed person whose receivers read `error` too much."""
    place = simulated_people(CONFERENCE)["ann"]
    own, shown = long_armed(), standard_skeleton(1.7)
    mounts = receiver_mounts(own)
    motion = open_motion(CONFERENCE)
    person = Person(
        name="ann",
        display_name="",
        avatar="",
        height_m=1.7,
        seat=Stance(place.seat_position, place.seat_heading),
        tracker="t",
        stations=STATIONS,
        transmitter=place.transmitter,
        gloves={},
        body=body,
        mounts=mounts,
        distortion=distortion,
    )
    capture = BodyCapture(person)
    worst = {"left_hand": 0.0, "right_hand": 0.0}
    wearing = replace(place, build=replace(place.build, skeleton=own), mounts=mounts)
    for k in range(60):
        posture = motion.posture("ann", 0.1)
        t_ns = 1_000_000_000 + k * 16_666_667
        frame = TrackerFrame(device="t")
        for station, name in STATIONS.items():
            p, q = receivers_of(wearing, posture)[name]
            r = frame.receivers.add(station=station, t_ns=t_ns, health=TrackerReceiver.HEALTH_GOOD)
            r.position.x, r.position.y, r.position.z = p + error[:3]
            turn = np.array([0.0, 0.0, math.sin(0.5 * error[5]), math.cos(0.5 * error[5])])
            r.rotation.x, r.rotation.y, r.rotation.z, r.rotation.w = multiplied(turn, q)
        capture.tracker(frame)
        got = pose_joints(shown, capture.solve(t_ns).posture)
        truth = pose_joints(own, posture)
        for name in worst:
            j = JOINT_INDEX[name]
            worst[name] = float(np.linalg.norm(got.position[j] - truth.position[j]))
    return worst


def multiplied(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    x, y, z, w = a
    turn = np.array([[w, -z, y, x], [z, w, -x, y], [-y, x, w, z], [-x, -y, -z, w]])
    return turn @ b


def test_what_a_measured_person_does_is_where_others_see_it() -> None:
    body = MeasuredPerson(1.7, long_armed(), {})
    for e in solved(body, None, np.zeros(6)).values():
        assert e < 0.01


def test_metal_is_taken_back_before_anything_else() -> None:
    body = MeasuredPerson(1.7, long_armed(), {})
    grid = Distortion(np.array([-3.0, -3.0, -3.0]), 6.0, np.broadcast_to(WRONG, (2, 2, 2, 6)).copy())
    assert max(solved(body, None, WRONG).values()) > 0.02
    assert max(solved(body, grid, WRONG).values()) < 0.01


NO_TURN = np.array([0.0, 0.0, 0.0, 1.0])


def test_a_still_receiver_does_not_tremble() -> None:
    rng = np.random.default_rng(0)
    f = PoseFilter()
    seen = []
    for k in range(300):
        f.update(k / 30.0, 0.0008 * rng.standard_normal(3), NO_TURN)
        seen.append(f.at(k / 30.0)[0])
    assert np.std(seen[60:], axis=0).max() < 0.0008


def test_steady_motion_does_not_lag_and_is_carried_on() -> None:
    f = PoseFilter()
    for k in range(90):
        t = k / 30.0
        half = 0.5 * 1.2 * t
        f.update(t, np.array([0.8 * t, 0.0, 0.0]), np.array([0.0, math.sin(half), 0.0, math.cos(half)]))
    ahead = 0.02
    p, q = f.at(89 / 30.0 + ahead)
    assert p[0] == pytest.approx(0.8 * (89 / 30.0 + ahead), abs=0.002)
    yaw = math.atan2(matrix_from_quaternion(q)[0, 2], matrix_from_quaternion(q)[2, 2])
    assert math.remainder(yaw - 1.2 * (89 / 30.0 + ahead), 2.0 * math.pi) == pytest.approx(0.0, abs=0.01)


def test_a_glitch_faster_than_people_turn_is_not_followed_at_once() -> None:
    f = PoseFilter()
    for k in range(30):
        f.update(k / 30.0, np.zeros(3), NO_TURN)
    f.update(1.0, np.zeros(3), np.array([0.0, 1.0, 0.0, 0.0]))
    turned = 2.0 * math.acos(min(1.0, abs(float(f.at(1.0)[1][3]))))
    assert turned <= 25.0 / 30.0 + 1e-6
