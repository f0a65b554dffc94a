"""The made-up meeting: people who could be people."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from vistel.conference.devices import TrackerConfig
from vistel.conference.files import DEMO_FILE, load
from vistel.conference.model import Conference, Participant, Site
from vistel.figure.body import pose_body, standard_body
from vistel.figure.posture.posture import ELBOW, Posture, Stance, pose_joints
from vistel.figure.posture.sensors import RECEIVERS, out_of_frame, receiver_poses
from vistel.figure.posture.solve import PostureSolver
from vistel.figure.skeleton import JOINT_INDEX
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.room import BATON, TABLE_HEIGHT, meeting_room, table_radius
from vistel.space.world import World
from vistel_sim.limbs import own_limbs
from vistel_sim.motion import MotionSource, open_motion
from vistel_sim.motion.script import CYCLE_S
from vistel_sim.motion.source import SimulatedPerson, simulated_people
from vistel_sim.motion.tracks import minimum_jerk

NAMES = ("ann", "ben", "cas")
HEIGHTS = (1.65, 1.80, 1.72)


STEP_NS = 16_666_667

JOINTS_COMPARED = ("hips", "left_hand", "right_hand", "head", "left_lower_arm", "right_lower_arm", "left_lower_leg")


def conference(seed: int = 1, names: tuple[str, ...] = NAMES) -> Conference:
    people = zip(names, HEIGHTS, strict=False)
    sites = [Site(name=f"s-{n}", participants=[Participant(name=n, height=h)]) for n, h in people]
    return Conference(sites=sites, seed=seed)


@functools.cache
def meeting(seed: int = 1) -> tuple[MotionSource, dict[str, SimulatedPerson]]:
    return open_motion(conference(seed)), simulated_people(conference(seed))


@pytest.mark.parametrize("seed", [1, 5])
def test_movement_is_smooth(seed: int) -> None:
    source, people = meeting(seed)
    for name in NAMES:
        at = np.array([pose_joints(people[name].skeleton, source.posture(name, k / 60)).position for k in range(21 * 60)])
        speed = np.linalg.norm(np.diff(at, axis=0), axis=2) * 60
        acceleration = np.linalg.norm(np.diff(at, n=2, axis=0), axis=2) * 3600
        # A brisk reach over a table stays under 2 m/s (fingertips 3) and 2 g.
        assert speed[:, JOINT_INDEX["left_hand"]].max() < 2.0
        assert speed[:, JOINT_INDEX["right_hand"]].max() < 2.0
        assert speed.max() < 3.0
        assert acceleration[:, [JOINT_INDEX["left_hand"], JOINT_INDEX["right_hand"]]].max() < 20.0
        assert acceleration[:, JOINT_INDEX["head"]].max() < 8.0


def test_the_same_seed_gives_the_same_meeting_and_another_seed_another() -> None:
    again = open_motion(conference(1))
    source, _ = meeting(1)
    other, _ = meeting(5)
    for t in (0.0, 3.3, 17.25, 44.4):
        for name in NAMES:
            assert (source.posture(name, t).dofs == again.posture(name, t).dofs).all()
    assert any((source.posture("ann", t).dofs != other.posture("ann", t).dofs).any() for t in (3.3, 17.25))


def test_time_may_be_asked_for_in_any_order() -> None:
    source, _ = meeting()
    first = source.receivers("ben", 12.345)["left_hand"][0].copy()
    source.receivers("ben", 99.0)
    assert (source.receivers("ben", 12.345)["left_hand"][0] == first).all()


def test_receivers_are_the_truth_seen_from_the_transmitter() -> None:
    source, people = meeting()
    for name in NAMES:
        person = people[name]
        for t in (0.0, 2.8, 5.5, 15.55):
            want = receiver_poses(person.skeleton, pose_joints(person.skeleton, source.posture(name, t)))
            got = source.receivers(name, t)
            assert set(got) == set(RECEIVERS)
            for receiver, placed in got.items():
                p, q = out_of_frame(person.transmitter, *placed)
                # Between two sixtieths of a second the receivers are interpolated.
                assert np.linalg.norm(p - want[receiver][0]) < 0.002
                assert abs(float(q @ want[receiver][1])) > 0.9999
            assert np.abs(source.hand_angles(name, t) - source.posture(name, t).hands).max() < 0.02


def test_receivers_stay_in_the_operating_hemisphere_and_in_range() -> None:
    source, _ = meeting()
    hemisphere = np.array(TrackerConfig().hemisphere)
    for name in NAMES:
        for k in range(0, 400):
            for p, _ in source.receivers(name, k / 20).values():
                assert p @ hemisphere > 0.1
                assert np.linalg.norm(p) < 1.5


def inside_table(points: np.ndarray, radii: np.ndarray) -> float:
    """Deepest point of spheres inside the table's top [m]."""
    out = np.hypot(points[:, 0], points[:, 2]) - table_radius(3)
    above = points[:, 1] - TABLE_HEIGHT
    below = TABLE_HEIGHT - 0.03 - points[:, 1]
    height = np.maximum(above, below)
    distance = np.where((out > 0) & (height > 0), np.hypot(np.maximum(out, 0), np.maximum(height, 0)), np.maximum(out, height))
    return float((radii - distance).max())


def test_nobody_is_inside_the_table() -> None:
    source, people = meeting()
    share = np.linspace(0.0, 1.0, 7)[:, None, None]
    for name in NAMES:
        skeleton = people[name].skeleton
        body = standard_body(skeleton)
        for k in range(0, int(CYCLE_S * 12)):
            posed = pose_body(body, pose_joints(skeleton, source.posture(name, k / 12)))
            points = (posed.a[None] * (1 - share) + posed.b[None] * share).reshape(-1, 3)
            s = share[..., 0]
            radii = (posed.radius_a[None] * (1 - s) + posed.radius_b[None] * s).reshape(-1)
            assert inside_table(points, radii) < 0.012, (name, k / 12)


def test_joints_stay_within_human_limits() -> None:
    source, people = meeting()
    for name in NAMES:
        skeleton = people[name].skeleton
        for k in range(0, int(CYCLE_S * 10)):
            posture = source.posture(name, k / 10)
            pose = pose_joints(skeleton, posture)
            for side, _sign in (("left", 1.0), ("right", -1.0)):
                assert 0.0 < posture.dofs[ELBOW[side]] < np.radians(150)
                forearm = pose.rotation[JOINT_INDEX[f"{side}_lower_arm"]]
                hand = pose.rotation[JOINT_INDEX[f"{side}_hand"]]
                # Between the forearm's and the hand's long axes.
                assert (forearm[:, 0] @ hand[:, 0]) > np.cos(np.radians(80)), (name, side, k / 10)
            assert np.abs(posture.gaze).max() < np.radians(45)


def palm(source: MotionSource, people: dict[str, SimulatedPerson], name: str, side: str, t: float) -> np.ndarray:
    """Where a bar held in the hand would be, (3,)."""
    person = people[name]
    pose = pose_joints(person.skeleton, source.posture(name, t))
    j = JOINT_INDEX[f"{side}_hand"]
    sign = 1.0 if side == "left" else -1.0
    return pose.position[j] + pose.rotation[j] @ np.array([sign * 0.088, -0.0255, 0.0]) * person.skeleton.height / 1.75


def test_the_baton_is_taken_from_its_rest_handed_over_and_put_back() -> None:
    source, people = meeting()
    start = meeting_room(3).thing(BATON).position
    assert source.things(0.0)[BATON][0] == pytest.approx(start)
    assert source.things(19.9)[BATON][0] == pytest.approx(start)
    # Where it lies, the giver's palm is round it, an end to one side.
    assert np.linalg.norm(palm(source, people, "ann", "right", 3.2) - start) < 0.045
    # In the air both hold it for a moment.
    both = source.things(5.83)[BATON][0]
    assert np.linalg.norm(palm(source, people, "ann", "right", 5.83) - both) < 0.045
    assert np.linalg.norm(palm(source, people, "ben", "left", 5.83) - both) < 0.06
    assert both[1] > TABLE_HEIGHT + 0.15
    # Then only the taker.
    assert np.linalg.norm(palm(source, people, "ben", "left", 8.0) - source.things(8.0)[BATON][0]) < 0.06
    assert np.linalg.norm(palm(source, people, "ann", "right", 8.0) - source.things(8.0)[BATON][0]) > 0.2


def test_the_baton_moves_without_jumps() -> None:
    source, _ = meeting()
    at = np.array([source.things(k / 60)[BATON][0] for k in range(int(CYCLE_S * 60) + 30)])
    assert np.linalg.norm(np.diff(at, axis=0), axis=1).max() < 0.04


def test_hands_of_neighbours_touch() -> None:
    source, people = meeting()

    def hand(name: str, side: str, t: float) -> np.ndarray:
        pose = pose_joints(people[name].skeleton, source.posture(name, t))
        j = JOINT_INDEX[f"{side}_hand"]
        sign = 1.0 if side == "left" else -1.0
        return pose.position[j] + pose.rotation[j] @ np.array([sign * 0.06, 0.0, 0.0])

    # Palms are 2.4 cm thick to either side: closer than 5 cm is a touch, closer than 3 would go through.
    assert 0.03 < np.linalg.norm(hand("ann", "left", 10.5) - hand("cas", "right", 10.5)) < 0.052
    assert 0.03 < np.linalg.norm(hand("ben", "right", 15.8) - hand("cas", "left", 15.8)) < 0.052


def test_speech_is_between_silence_and_full_and_somebody_talks_most_of_the_time() -> None:
    source, _ = meeting()
    loud = np.array([[source.speaking(n, k / 20) for n in NAMES] for k in range(1200)])
    assert loud.min() == 0.0 and loud.max() <= 1.0
    assert (loud.max(axis=1) > 0.02).mean() > 0.6
    assert (loud > 0.3).sum(axis=1).max() <= 2


def test_heads_turn_to_who_speaks() -> None:
    source, people = meeting()
    turned = []
    for k in range(0, 1200):
        t = k / 20
        loud = [source.speaking(n, t) for n in NAMES]
        speaker = NAMES[int(np.argmax(loud))]
        if max(loud) < 0.5:
            continue
        for name in NAMES:
            if name == speaker:
                continue
            pose = pose_joints(people[name].skeleton, source.posture(name, t))
            head = JOINT_INDEX["head"]
            aim = people[speaker].seat_position - pose.position[head]
            aim[1] = 0.0
            ahead = pose.rotation[head][:, 2] * (1, 0, 1)
            turned.append(float(aim @ ahead) / np.linalg.norm(aim) / np.linalg.norm(ahead))
    assert np.median(turned) > np.cos(np.radians(25))


def test_the_solver_finds_the_choreography_again_from_its_receivers() -> None:
    source, people = meeting()
    for name in NAMES:
        person = people[name]
        solver = PostureSolver(person.skeleton, Stance(person.seat_position, person.seat_heading))
        worst: dict[str, float] = {}
        for k in range(600):
            truth = source.posture(name, k / 60)
            want = pose_joints(person.skeleton, truth)
            got = pose_joints(person.skeleton, solver.solve(k / 60, receiver_poses(person.skeleton, want)).posture)
            for joint in JOINTS_COMPARED:
                j = JOINT_INDEX[joint]
                e = float(np.linalg.norm(got.position[j] - want.position[j]))
                worst[joint] = max(worst.get(joint, 0.0), e)
        assert worst["left_hand"] < 1e-3 and worst["right_hand"] < 1e-3
        assert worst["head"] < 1e-6 and worst["hips"] < 0.01 and worst["left_lower_leg"] < 0.01
        assert max(worst["left_lower_arm"], worst["right_lower_arm"]) < 0.15


def test_a_person_alone_and_a_pair_are_moved_too() -> None:
    for names in (("ann",), ("ann", "ben")):
        source = open_motion(conference(names=names))
        for name in names:
            assert np.isfinite(source.posture(name, 5.0).dofs).all()
    assert open_motion(conference(names=("ann",))).speaking("ann", 3.0) == 0.0


def test_minimum_jerk_is_still_at_both_ends() -> None:
    h = 1e-4
    for u in (0.0, 1.0):
        assert abs(minimum_jerk(u + h) - minimum_jerk(u - h)) / h < 1e-4
    assert minimum_jerk(-1.0) == 0.0 and minimum_jerk(2.0) == 1.0 and minimum_jerk(0.5) == pytest.approx(0.5)


@pytest.mark.parametrize("seed", [0, 1])
def test_people_with_limbs_of_their_own_hand_the_baton_over_and_do_not_knock_it_off_its_rest(seed: int) -> None:
    """From what their trackers measure, a millimetre wrong, to who holds it in the world."""
    demo = load(DEMO_FILE)
    limbs, rng = own_limbs(demo), np.random.default_rng(seed)
    source, people = open_motion(demo, limbs), simulated_people(demo, limbs)
    solvers = {n: PostureSolver(limbs[n].skeleton, Stance(p.seat_position, p.seat_heading)) for n, p in people.items()}
    world, holders, lowest = World(meeting_room(3)), [], np.inf

    def measured(name: str, t: float) -> Posture:
        poses = {role: (p + rng.normal(0.0, 0.001, 3), q) for role, (p, q) in source.receivers(name, t).items()}
        heard = {role: out_of_frame(people[name].transmitter, *pose) for role, pose in poses.items()}
        left, right = source.hand_angles(name, t)
        return solvers[name].solve(t, heard, (left, right)).posture

    for step, t in enumerate(np.arange(1.0, 14.5, 1 / 60), 1):
        bodies = tuple(ParticipantBody(n, proportions=limbs[n]) for n in people) if step == 1 else ()
        motions = tuple(MotionInput(n, measured(n, t), step, step * STEP_NS) for n in people)
        view = world.step(StepInputs(step, step * STEP_NS, bodies, motions))
        for baton in (s for s in view.states if s.id == BATON):
            lowest = min(lowest, baton.position[1])
            if [baton.holders] != holders[-1:]:
                holders.append(baton.holders)
    assert [h for h in holders if len(h) == 1][:3] == [("aiko",), ("ben",), ("aiko",)]
    assert lowest > meeting_room(3).thing(BATON).position[1] - 0.004
