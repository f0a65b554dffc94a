"""Bodies and trackers measured from moves: what was put in is found again, and bad moves are told."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from vistel.conference.model import Conference, Participant, Site
from vistel.figure.calibration.arms import START, elbow_errors, fit_comfort, samples_of
from vistel.figure.calibration.distortion import (
    DistortionError,
    fit_distortion,
    judge,
    load_distortion,
    pose_errors,
    save_distortion,
)
from vistel.figure.calibration.files import (
    CalibrationFileError,
    MeasuredPerson,
    TrackerSetup,
    load_body,
    load_tracker,
    save_body,
    save_tracker,
)
from vistel.figure.calibration.fit import Calibrated, calibrate
from vistel.figure.calibration.moves import (
    FOREARM_STEPS,
    STEPS,
    MoveError,
    Samples,
    begin_of,
    cut,
    find_beginning,
    step_tracks,
    whole_s,
)
from vistel.figure.posture.posture import pose_joints
from vistel.figure.posture.sensors import RECEIVERS, Mount, out_of_frame, receiver_mounts, transmitter_in_room
from vistel.figure.posture.solve import PostureSolver
from vistel.figure.posture.swivel import Comfort
from vistel.figure.skeleton import JOINT_INDEX, SPINE_SEGMENTS, Skeleton, measured_skeleton, standard_skeleton
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix, rotvec_from_matrix
from vistel_sim.motion import open_motion
from vistel_sim.motion.calibration import CalibrationMoves
from vistel_sim.motion.source import SimulatedPerson, receivers_of, simulated_people

HEIGHT = 1.68
CONFERENCE = Conference(sites=[Site(name="a", participants=[Participant(name="ada", height=HEIGHT)])])
NOISE_M, NOISE_RAD = 0.0008, math.radians(0.15)


def somebody(seed: int) -> Skeleton:
    """A person with proportions of their own."""
    rng = np.random.default_rng(seed)
    standard = standard_skeleton(HEIGHT)

    def of(joint: str) -> np.ndarray:
        return standard.offsets[JOINT_INDEX[joint]]

    longer = 0.03 * rng.standard_normal()
    bones = {f"spine_{k}": np.array([0.0, (standard.spine + longer) / SPINE_SEGMENTS, 0.0]) for k in range(2, SPINE_SEGMENTS + 1)}
    bones["hips"] = standard.rest[0] - (0.0, longer, 0.0)
    bones["neck"] = of("neck") + np.array([0.0, longer / SPINE_SEGMENTS, 0.01 * rng.standard_normal()])
    for s, sign in (("left", 1.0), ("right", -1.0)):
        bones[f"{s}_shoulder"] = of(f"{s}_shoulder") + np.array([0.0, longer / SPINE_SEGMENTS, 0.0])
        bones[f"{s}_upper_arm"] = of(f"{s}_upper_arm") + sign * np.array([0.015 * rng.standard_normal(), 0.0, 0.0])
        bones[f"{s}_lower_arm"] = of(f"{s}_lower_arm") * (1.0 + 0.06 * rng.standard_normal())
        bones[f"{s}_hand"] = of(f"{s}_hand") * (1.0 + 0.06 * rng.standard_normal())
    return measured_skeleton(standard, bones, 0.1)


@cache
def worn(seed: int) -> tuple[SimulatedPerson, np.ndarray, float]:
    """Somebody with their receivers a little off, and where the transmitter stands: person, position, heading."""
    rng = np.random.default_rng(seed + 50)
    person, body = simulated_people(CONFERENCE)["ada"], somebody(seed)
    mounts = {
        name: Mount(
            m.joint,
            m.position + 0.015 * rng.standard_normal(3),
            m.rotation @ matrix_from_rotvec(math.radians(8.0) * rng.standard_normal(3)),
        )
        for name, m in receiver_mounts(body).items()
    }
    position, heading = np.array([0.1, 0.3, 0.2]) + 0.2 * rng.standard_normal(3), 0.4 * rng.standard_normal()
    transmitter = transmitter_in_room(person.seat_position, person.seat_heading, position, heading)
    return replace(person, build=replace(person.build, skeleton=body), mounts=mounts, transmitter=transmitter), position, heading


@cache
def recorded(seed: int, begin_s: float = 0.0, end_s: float = whole_s()) -> Samples:
    """A FASTRAK's samples of them going through the moves."""
    rng = np.random.default_rng(seed)
    person, _, _ = worn(seed)
    motion = CalibrationMoves([person])
    rows: dict[str, list[tuple[float, ...]]] = {name: [] for name in RECEIVERS}
    for k in range(round(begin_s * 120.0), round(end_s * 120.0)):
        name, t = RECEIVERS[k % 4], k / 120.0
        p, q = motion.receivers("ada", t)[name]
        turn = matrix_from_rotvec(NOISE_RAD * rng.standard_normal(3)) @ matrix_from_quaternion(q)
        rows[name].append((t, *(p + NOISE_M * rng.standard_normal(3)), *quaternion_from_matrix(turn)))
    tables = {name: np.array(r) for name, r in rows.items()}
    return {name: (t[:, 0], t[:, 1:4], t[:, 4:]) for name, t in tables.items()}


@cache
def found(seed: int) -> Calibrated:
    return calibrate(cut(recorded(seed)), HEIGHT)


def angle(a: np.ndarray, b: np.ndarray) -> float:
    return math.degrees(float(np.linalg.norm(rotvec_from_matrix(np.ascontiguousarray(a.T @ b)))))


@pytest.mark.parametrize("seed", [0, 1])
def test_bones_mounts_and_transmitter_are_found_again(seed: int) -> None:
    person, position, heading = worn(seed)
    c = found(seed)
    for side in ("left", "right"):
        for a, b in (("upper_arm", "lower_arm"), ("lower_arm", "hand")):
            joints = f"{side}_{a}", f"{side}_{b}"
            assert c.skeleton.length(*joints) == pytest.approx(person.skeleton.length(*joints), abs=0.008), joints
        hand = f"{side}_hand"
        assert np.linalg.norm(c.mounts[hand].position - person.mounts[hand].position) < 0.004
    assert c.skeleton.spine == pytest.approx(person.skeleton.spine, abs=0.025)
    assert c.skeleton.collar_shortening == pytest.approx(0.1, abs=0.06)
    for name in RECEIVERS:
        assert angle(c.mounts[name].rotation, person.mounts[name].rotation) < 1.5
    assert np.linalg.norm(c.position - position) < 0.02 and abs(c.heading - heading) < math.radians(1.5)
    assert "poor" not in c.verdicts().values()


def errors(person: SimulatedPerson, solver: PostureSolver, transmitter: tuple[np.ndarray, np.ndarray]) -> dict[str, float]:
    """Medians of joints' errors while the person sits in a meeting [m]."""
    meeting = open_motion(CONFERENCE)
    out: dict[str, list[float]] = {"left_hand": [], "right_hand": [], "head": [], "left_lower_arm": []}
    for k in range(90):
        posture = meeting.posture("ada", k / 10.0)
        truth = pose_joints(person.skeleton, posture)
        heard = {n: out_of_frame(transmitter, *pose) for n, pose in receivers_of(person, posture).items()}
        got = pose_joints(solver._skeleton, solver.solve(k / 10.0, heard).posture)
        for joint, e in out.items():
            e.append(float(np.linalg.norm(got.position[JOINT_INDEX[joint]] - truth.position[JOINT_INDEX[joint]])))
    return {joint: float(np.median(e)) for joint, e in out.items()}


def test_a_measured_person_is_where_they_are_and_an_average_one_is_not() -> None:
    person, position, heading = worn(0)
    c = found(0)
    seat = person.seat_position, person.seat_heading
    measured = errors(person, PostureSolver(c.skeleton, mounts=c.mounts), transmitter_in_room(*seat, c.position, c.heading))
    average = errors(person, PostureSolver(standard_skeleton(HEIGHT)), transmitter_in_room(*seat, position, heading))
    for joint in ("left_hand", "right_hand", "head"):
        assert measured[joint] < 0.025, joint
        assert measured[joint] < average[joint], joint


def test_how_arms_are_carried_is_learnt_from_a_receiver_on_the_forearm() -> None:
    step = FOREARM_STEPS[0]
    begin = begin_of(step)
    moves = step_tracks(step, recorded(0, begin, begin + step.seconds), begin)
    arm = samples_of(moves, "left", found(0))
    learnt = fit_comfort(arm, rounds=60)
    assert np.median(elbow_errors(arm, learnt)) < 0.5 * np.median(elbow_errors(arm, START))


def test_the_beginning_is_found_in_a_recording() -> None:
    late = {name: (t + 12.0, p, q) for name, (t, p, q) in recorded(0).items()}
    assert find_beginning(late) == pytest.approx(12.0, abs=0.6)


def spoiled(change: str) -> Samples:
    samples = dict(recorded(0))
    t, p, q = samples["left_hand"]
    during = lambda name: (t > begin_of(step_of(name))) & (t < begin_of(step_of(name)) + step_of(name).seconds)  # noqa: E731
    if change == "silent":
        gone = during("arms")
        samples["left_hand"] = (t[~gone], p[~gone], q[~gone])
    elif change == "still":
        held, k = during("arms"), int(np.flatnonzero(during("arms"))[0])
        p, q = p.copy(), q.copy()
        p[held], q[held] = p[k], q[k]
        samples["left_hand"] = (t, p, q)
    elif change == "exchanged":
        samples["left_hand"], samples["right_hand"] = samples["right_hand"], samples["left_hand"]
    elif change == "askew":
        turn = matrix_from_rotvec(np.array([0.0, 0.0, math.radians(120.0)]))
        samples["left_hand"] = (t, p, np.array([quaternion_from_matrix(matrix_from_quaternion(x) @ turn) for x in q]))
    return samples


def step_of(name: str):
    return next(s for s in STEPS if s.name == name)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("silent", "arms: the receiver left hand was silent"),
        ("still", "arms: left hand turned by"),
        ("exchanged", "left and right hand are exchanged"),
        ("askew", "receiver left hand is turned by"),
    ],
)
def test_moves_that_cannot_be_used_are_reported_in_one_line(change: str, told: str) -> None:
    with pytest.raises(MoveError, match=told) as e:
        calibrate(cut(spoiled(change)), HEIGHT)
    assert "\n" not in str(e.value)


def test_moves_in_the_wrong_order_are_reported() -> None:
    with pytest.raises(MoveError):
        calibrate(cut(recorded(0), 13.0), HEIGHT)


def test_files_hold_what_was_found(tmp_path: Path) -> None:
    c = found(0)
    save_body(MeasuredPerson(HEIGHT, c.skeleton, {"left": Comfort(0.4)}), tmp_path / "body.json")
    save_tracker(TrackerSetup(c.position, c.heading, c.mounts), tmp_path / "tracker.json")
    body, setup = load_body(tmp_path / "body.json"), load_tracker(tmp_path / "tracker.json")
    assert np.abs(body.skeleton.rest - c.skeleton.rest).max() < 1e-4
    assert body.comfort["left"].height == 0.4 and body.skeleton.collar_shortening == c.skeleton.collar_shortening
    assert np.abs(setup.position - c.position).max() < 1e-5
    assert all(np.abs(setup.mounts[n].rotation - m.rotation).max() < 1e-5 for n, m in c.mounts.items())


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[]",
        '{"format": "vistel body 1"}',
        '{"format": "vistel body 1", "height_m": 9, "bones": {}, "collar_shortening": 0}',
        '{"format": "vistel body 1", "height_m": 1.7, "bones": {"tail": [0,0,0]}, "collar_shortening": 0}',
        '{"format": "vistel body 1", "height_m": 1.7, "bones": {"head": [0,null,0]}, "collar_shortening": 0}',
    ],
)
def test_broken_files_are_reported_in_one_line(text: str, tmp_path: Path) -> None:
    path = tmp_path / "body.json"
    path.write_text(text)
    with pytest.raises(CalibrationFileError, match="vistel calibrate body") as e:
        load_body(path)
    assert "\n" not in str(e.value) and str(path) in str(e.value)


def metal(p: np.ndarray) -> np.ndarray:
    d = p - np.array([0.5, 0.3, 0.2])
    away = np.linalg.norm(d, axis=1, keepdims=True)
    return 0.02 * d / (away * (1.0 + (away / 0.4) ** 2))


def test_a_grid_takes_back_what_metal_did_at_points_it_was_not_fitted_on(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    true = rng.uniform([0.2, -0.5, -0.8], [1.0, 0.5, -0.1], (150, 3))
    turns = 2.0 * metal(true)
    read = true + metal(true)
    still = np.tile([0.0, 0.0, 0.0, 1.0], (len(true), 1))
    turned = np.array([quaternion_from_matrix(matrix_from_rotvec(v)) for v in turns])
    both = pose_errors((true, still), (read, turned))
    report = judge(read, both)
    assert report.after_m < 0.35 * report.before_m and report.after_rad < 0.35 * report.before_rad
    save_distortion(fit_distortion(read, both), tmp_path / "grid.json")
    grid = load_distortion(tmp_path / "grid.json")
    p, q = grid.correct(read[0], turned[0])
    assert np.linalg.norm(p - true[0]) < 0.3 * np.linalg.norm(read[0] - true[0])
    assert 2.0 * math.acos(min(1.0, abs(float(q[3])))) < 0.4 * float(np.linalg.norm(turns[0]))
    # Outside, the edge's errors hold: nothing runs away.
    assert np.linalg.norm(grid.error_at(np.array([9.0, 9.0, 9.0]))[:3]) < 0.03


def test_points_that_make_no_grid_are_reported() -> None:
    with pytest.raises(DistortionError, match="too few"):
        fit_distortion(np.zeros((3, 3)), np.zeros((3, 6)))
    with pytest.raises(DistortionError, match="metres"):
        fit_distortion(np.random.default_rng(0).uniform(-500, 500, (20, 3)), np.zeros((20, 6)))
