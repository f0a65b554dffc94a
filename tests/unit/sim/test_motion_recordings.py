"""Recordings as motion sources: read right, fitted to their players, refused with one clear line when broken."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from vistel.conference.model import Conference, Participant, Site
from vistel.figure.posture.limits import within_limits
from vistel.figure.posture.posture import Stance, pose_joints
from vistel.figure.posture.sensors import RECEIVERS, out_of_frame, receiver_poses
from vistel.figure.posture.solve import PostureSolver
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.people import PALM_CENTRE
from vistel.space.room import BATON, table_radius
from vistel_sim.motion import MotionError, open_motion
from vistel_sim.motion.bvh import load_bvh, parse_bvh
from vistel_sim.motion.hand_over import GRIP, SLANT
from vistel_sim.motion.open import things_of
from vistel_sim.motion.played import play_alone
from vistel_sim.motion.recording import INDEX, resampled
from vistel_sim.motion.six_dof import ROLES, load_hand_over
from vistel_sim.motion.source import simulated_people

BODIES = [p + s for p in ("L", "R") for s in ("Shoulder", "UArm", "FArm", "Hand")]

# A person in a T-pose, centimetres; the left forearm bends about Y by the only channel that moves.
PARTS = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT Spine1
  {
    OFFSET 0 45 0
    CHANNELS 3 Zrotation Yrotation Xrotation
    JOINT Neck
    {
      OFFSET 0 5 0
      CHANNELS 3 Zrotation Yrotation Xrotation
      JOINT Head
      {
        OFFSET 0 10 0
        CHANNELS 3 Zrotation Yrotation Xrotation
        End Site
        {
          OFFSET 0 18 0
        }
      }
    }
%s%s  }
  JOINT LeftUpLeg
  {
    OFFSET 9 -2 0
    CHANNELS 3 Zrotation Yrotation Xrotation
    JOINT LeftFoot
    {
      OFFSET 0 -86 0
      CHANNELS 3 Zrotation Yrotation Xrotation
      End Site
      {
        OFFSET 0 0 13
      }
    }
  }
}
MOTION
Frames: %d
Frame Time: 0.033333
%s
"""
ARM = """    JOINT {s}Shoulder
    {{
      OFFSET {x}2 2 0
      CHANNELS 3 Zrotation Yrotation Xrotation
      JOINT {s}Arm
      {{
        OFFSET {x}16 0 0
        CHANNELS 3 Zrotation Yrotation Xrotation
        JOINT {s}ForeArm
        {{
          OFFSET {x}29 0 0
          CHANNELS 3 Zrotation Yrotation Xrotation
          JOINT {s}Hand
          {{
            OFFSET {x}26 0 0
            CHANNELS 3 Zrotation Yrotation Xrotation
            End Site
            {{
              OFFSET {x}10 0 0
            }}
          }}
        }}
      }}
    }}
"""


def bvh_text(frames: int = 60) -> str:
    joints = 1 + 1 + 1 + 1 + 8 + 2
    rows = []
    for k in range(frames):
        row = [0.0, 94.0, 0.0] + [0.0] * (3 * joints)
        # Hips, Spine1, Neck, Head, LeftShoulder, LeftArm, LeftForeArm: its Y rotation.
        row[3 + 6 * 3 + 1] = -45.0 * (1.0 - math.cos(2.0 * math.pi * k / frames))
        rows.append(" ".join(f"{v:.6f}" for v in row))
    return PARTS % (ARM.format(s="Left", x=""), ARM.format(s="Right", x="-"), frames, "\n".join(rows))


def take_rows(angle: float = 0.0) -> str:
    rows = ["x,y,z,q0,q1,q2,q3"]
    rows += [f"0.1,{0.2 + 0.001 * k},1.0,0,0,{math.sin(angle / 2)},{math.cos(angle / 2)}" for k in range(40)]
    return "\n".join(rows) + "\n"


def write_take(folder: Path) -> Path:
    folder.mkdir()
    for role in ROLES:
        for body in ["hip", "chest", "neck", "head", *BODIES]:
            (folder / f"{role}_{body}_pose_saved.csv").write_text(take_rows())
    (folder / "baton_pose_saved.csv").write_text(take_rows())
    return folder


def conference(*motions: str | None) -> Conference:
    return Conference(sites=[Site(name=f"s{i}", participants=[Participant(name=f"p{i}", motion=m)]) for i, m in enumerate(motions)])


def test_bvh_joints_are_where_the_file_puts_them(tmp_path: Path) -> None:
    path = tmp_path / "arm.bvh"
    path.write_text(bvh_text())
    take = load_bvh(path)
    assert take.rate_hz == pytest.approx(30.0, abs=0.01)
    lengths = [
        np.linalg.norm(take.position[:, INDEX[a]] - take.position[:, INDEX[b]], axis=1)
        for a, b in (("left_upper_arm", "left_lower_arm"), ("left_lower_arm", "left_hand"))
    ]
    assert lengths[0] == pytest.approx(0.29) and lengths[1] == pytest.approx(0.26)
    # Bent to a right angle half-way, the hand is in front of the elbow.
    half = take.position[30]
    assert half[INDEX["left_hand"]] - half[INDEX["left_lower_arm"]] == pytest.approx((0.0, 0.0, 0.26), abs=1e-3)
    own = take.measured()
    assert (own.upper_arm, own.lower_arm) == pytest.approx((0.29, 0.26), abs=1e-6)


def test_a_bvh_moves_a_participant_of_another_size(tmp_path: Path) -> None:
    path = tmp_path / "arm.bvh"
    path.write_text(bvh_text())
    source = open_motion(conference(str(path), None))
    assert set(source.participants) == {"p0", "p1"}
    person = simulated_people(conference(str(path), None))["p0"]
    bends = [float(source.posture("p0", t).dofs[14]) for t in np.arange(0.0, 4.0, 1 / 30)]
    assert min(bends) < math.radians(10) and max(bends) == pytest.approx(math.radians(90), abs=0.03)
    assert np.abs(np.diff(bends)).max() < math.radians(12)
    # Stands behind the seat and faces the table.
    chest, _ = out_of_frame(person.transmitter, *source.receivers("p0", 0.5)["chest"])
    assert np.hypot(chest[0], chest[2]) > 0.9
    facing = pose_joints(person.skeleton, source.posture("p0", 0.5)).rotation[JOINT_INDEX["left_shoulder"]][:, 2]
    assert facing @ -chest / np.linalg.norm(chest * (1, 0, 1)) > 0.9


def test_receivers_of_a_recording_are_the_truth(tmp_path: Path) -> None:
    path = tmp_path / "arm.bvh"
    path.write_text(bvh_text())
    source, person = open_motion(conference(str(path))), simulated_people(conference(str(path)))["p0"]
    for t in (0.0, 0.61, 1.9, 2.2, 7.77):
        want = receiver_poses(person.skeleton, pose_joints(person.skeleton, source.posture("p0", t)))
        got = source.receivers("p0", t)
        assert set(got) == set(RECEIVERS)
        for name in RECEIVERS:
            assert np.linalg.norm(out_of_frame(person.transmitter, *got[name])[0] - want[name][0]) < 0.003


def test_a_real_walk_and_handshake_play_without_jumps(shared_data: Path) -> None:
    files = [str(p) for p in sorted((shared_data / "body" / "cmu").glob("*.bvh"))]
    source = open_motion(conference(*files))
    for name in source.participants:
        person = simulated_people(conference(*files))[name]
        chest = [source.receivers(name, k / 60)["chest"] for k in range(1300)]
        at = np.array([out_of_frame(person.transmitter, *c)[0] for c in chest])
        assert np.linalg.norm(np.diff(at, axis=0), axis=1).max() < 0.08
        assert np.abs(at[:, [0, 2]]).max() < 3.0


def test_real_takes_are_solved_within_the_limits_with_the_hands_where_they_were(shared_data: Path) -> None:
    takes = [load_bvh(p) for p in sorted((shared_data / "body" / "cmu").glob("*.bvh"))]
    takes += load_hand_over(shared_data / "body" / "kth_handover" / "take_new").people.values()
    person = next(
        iter(simulated_people(Conference(name="c", sites=[Site(name="s", participants=[Participant(name="ben")])])).values())
    )
    hands = [JOINT_INDEX["left_hand"], JOINT_INDEX["right_hand"]]
    for take in takes:
        played = play_alone(person, take)
        solver = PostureSolver(person.skeleton, Stance(person.seat_position, person.seat_heading), person.mounts)
        for k in range(int(take.duration_s * 60)):
            heard = {name: out_of_frame(person.transmitter, *r) for name, r in played.receivers(k / 60).items()}
            solved = solver.solve(k / 60, heard).posture
            np.testing.assert_allclose(within_limits(solved).dofs, solved.dofs, atol=1e-6)
            off = pose_joints(person.skeleton, solved).position - pose_joints(person.skeleton, played.posture(k / 60)).position
            assert np.linalg.norm(off[hands], axis=1).max() < 1e-3, (take.name, k)


def test_a_real_hand_over_keeps_both_hands_at_the_baton(shared_data: Path) -> None:
    folder = str(shared_data / "body" / "kth_handover" / "take_new")
    source, people = open_motion(conference(folder, folder, None)), simulated_people(conference(folder, folder, None))
    nearest = {"p0": 9.0, "p1": 9.0}
    between = 9.0
    for k in range(380):
        t = k / 60
        baton = source.things(t)[BATON][0]
        hands = {}
        for name, before in nearest.items():
            pose = pose_joints(people[name].skeleton, source.posture(name, t))
            j = JOINT_INDEX["right_hand"]
            hands[name] = pose.position[j] + pose.rotation[j] @ np.array([-0.08, -0.02, 0.0])
            nearest[name] = min(before, float(np.linalg.norm(hands[name] - baton)))
        between = min(between, float(np.linalg.norm(hands["p0"] - hands["p1"])))
    # They hold it by its ends.
    assert nearest["p0"] < 0.2 and nearest["p1"] < 0.2
    assert between < 0.35
    # The hand closes and opens again on the way.
    grip = [float(source.hand_angles("p1", k / 60)[1, 8:].mean()) for k in range(0, 400, 4)]
    assert max(grip) > math.radians(35) and min(grip) < math.radians(22)
    # Played back and forth: the second half is the first, backwards.
    length = 2.0 * (len(resampled(load_hand_over(Path(folder)).people["giver"], 60).position) - 1) / 60
    a, b = source.posture("p0", 1.0), source.posture("p0", length - 1.0)
    assert a.dofs == pytest.approx(b.dofs, abs=1e-6)


def test_a_hand_that_holds_the_recorded_baton_has_it_across_its_palm(shared_data: Path) -> None:
    folder = str(shared_data / "body" / "kth_handover" / "take_new")
    source, people = open_motion(conference(folder, folder, None)), simulated_people(conference(folder, folder, None))
    for name, times, along in (("p0", (0.3, 2.4, 3.3), -GRIP), ("p1", (3.3, 4.0, 5.5), GRIP)):
        person = people[name]
        for t in times:
            position, rotation = source.things(t)[BATON]
            axis = matrix_from_quaternion(rotation)[:, 0]
            posture = source.posture(name, t)
            pose = pose_joints(person.skeleton, posture)
            j = JOINT_INDEX["right_hand"]
            held = pose.rotation[j].T @ (position + along * axis - pose.position[j])
            palm = np.array([-PALM_CENTRE[0], PALM_CENTRE[1], PALM_CENTRE[2]]) * person.skeleton.height / 1.75
            assert np.linalg.norm(held - palm) < 0.02
            assert abs(pose.rotation[j][:, 2] @ axis) == pytest.approx(math.cos(SLANT), abs=0.05)
            # The fingers are closed on it.
            assert posture.hands[1, 6::4].min() > math.radians(40)


def test_the_two_of_a_hand_over_stand_clear_of_the_table_and_are_watched(shared_data: Path) -> None:
    folder = str(shared_data / "body" / "kth_handover" / "take_new")
    source, people = open_motion(conference(folder, folder, None)), simulated_people(conference(folder, folder, None))
    head = JOINT_INDEX["head"]
    for t in (0.0, 3.3, 6.0):
        third = pose_joints(people["p2"].skeleton, source.posture("p2", t))
        to_baton = source.things(t)[BATON][0] - third.position[head]
        assert third.rotation[head][:, 2] @ to_baton > 0.9 * np.linalg.norm(to_baton)
        for name in ("p0", "p1"):
            pose = pose_joints(people[name].skeleton, source.posture(name, t))
            assert np.hypot(*pose.position[0, [0, 2]]) > table_radius(3) + 0.15
            assert np.linalg.norm(pose.position[head] - third.position[head]) > 1.4
    assert things_of(Path(folder)) == (BATON,)
    assert things_of(shared_data / "body" / "cmu") == ()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("HIERARCHY", "HIERACHY", "expected HIERARCHY"),
        ("OFFSET 0 45 0", "OFFSET 0 45", "expected OFFSET and 3 numbers"),
        ("OFFSET 0 45 0", "OFFSET 0 45 x", "expected a number"),
        ("CHANNELS 3 Zrotation Yrotation Xrotation", "CHANNELS 2 Zrotation Yrotation Xrotation", "CHANNELS"),
        ("Frames: 60", "Frames: 61", "ends after frame 60 of 61"),
        ("Frames: 60", "Frames: many", "Frames: N"),
        ("Frame Time: 0.033333", "Frame Time: 0", "Frame Time"),
        ("JOINT LeftHand", "JOINT LeftPaw", "no joint for left hand"),
        ("OFFSET 0 -86 0", "OFFSET 0 -9999 0", "units tall"),
        ("JOINT Neck", "LIMB Neck", "expected ROOT, JOINT"),
    ],
)
def test_a_broken_bvh_is_refused_in_one_line(tmp_path: Path, old: str, new: str, says: str) -> None:
    path = tmp_path / "broken.bvh"
    path.write_text(bvh_text().replace(old, new, 1))
    with pytest.raises(MotionError) as e:
        load_bvh(path)
    assert says in str(e.value) and str(path) in str(e.value) and "\n" not in str(e.value)


def test_a_bvh_cut_off_anywhere_is_refused_in_one_line(tmp_path: Path) -> None:
    text = bvh_text(3)
    path = tmp_path / "cut.bvh"
    for end in range(0, len(text) - 160, 211):
        path.write_text(text[:end])
        with pytest.raises(MotionError) as e:
            parse_bvh(path)
        assert "\n" not in str(e.value)


def test_a_binary_file_is_no_bvh(tmp_path: Path) -> None:
    path = tmp_path / "x.bvh"
    path.write_bytes(bytes(range(256)) * 8)
    with pytest.raises(MotionError, match="cannot be read as text"):
        load_bvh(path)


def test_a_whole_take_is_read(tmp_path: Path) -> None:
    take = load_hand_over(write_take(tmp_path / "take"))
    assert set(take.people) == set(ROLES)
    # Z up becomes Y up, -Y becomes the way one faces.
    assert take.baton_position[0] == pytest.approx((0.1, 1.0, -0.2))
    assert take.baton_rotation[0] == pytest.approx(np.eye(3))


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda p: p.unlink(), "missing"),
        (lambda p: p.write_text(p.read_text().replace("0.205", "nan", 1)), "line 7"),
        (lambda p: p.write_text(p.read_text().replace(",1.0,", ",", 1)), "line 2"),
        (lambda p: p.write_text("\n".join(p.read_text().splitlines()[:30]) + "\n"), "different numbers of rows"),
        (lambda p: p.write_text("x,y,z\n"), "at least two rows"),
        (lambda p: p.write_bytes(b"\xff\xfe\x00"), "cannot be read as text"),
    ],
)
def test_a_broken_take_is_refused_in_one_line(tmp_path: Path, spoil, says: str) -> None:
    folder = write_take(tmp_path / "take")
    spoil(folder / "taker_LHand_pose_saved.csv")
    with pytest.raises(MotionError) as e:
        load_hand_over(folder)
    assert says in str(e.value) and "\n" not in str(e.value)


def test_what_is_no_motion_is_named(tmp_path: Path) -> None:
    for motion in ("dancing", str(tmp_path), str(tmp_path / "none.bvh")):
        with pytest.raises(MotionError) as e:
            open_motion(conference(motion))
        assert motion in str(e.value) and "\n" not in str(e.value)


def test_a_hand_over_needs_two(tmp_path: Path) -> None:
    with pytest.raises(MotionError, match="two participants"):
        open_motion(conference(str(write_take(tmp_path / "take")), None))
