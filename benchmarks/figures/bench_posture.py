"""Posture from four receivers, beside people who were recorded: errors of joints, and the time of a solve.

Receivers are put on recorded people (BVH and 6-DOF files), measured like a FASTRAK does: one station every 1/120 s in
turn, 0.8 mm and 0.15 degrees of noise per axis; then filtered and solved by the posture service's own code. Bones are
measured on the first third of each recording and how each arm is carried is learnt from it, as `vistel calibrate body`
does with a receiver on the forearm; all errors are those of the other two thirds. The filter's constants are the same
for all. The peer is the same solver with the elbow always at its lowest. Then comes what the filter of one receiver does.
"""

import errno
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.figures import receiver_filter
from benchmarks.row import Row, at_most
from vistel.arrays import F64
from vistel.capture.body import BodyCapture, warm_up
from vistel.capture.config import Person
from vistel.figure.calibration.arms import START, ArmSamples, fit_comfort
from vistel.figure.posture.arm import bones_of
from vistel.figure.posture.posture import Stance, pose_joints
from vistel.figure.posture.sensors import receiver_mounts
from vistel.figure.posture.swivel import Comfort
from vistel.figure.skeleton import JOINT_INDEX, Skeleton
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix
from vistel.v1.device_pb2 import TrackerFrame, TrackerReceiver
from vistel_sim.motion.bvh import load_bvh
from vistel_sim.motion.recording import INDEX, SIDES, Recording, beginning
from vistel_sim.motion.six_dof import load_hand_over

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "body"
RECORDS_HZ = 120.0
NOISE_M, NOISE_RAD = 0.0008, math.radians(0.15)
STATIONS = {1: "chest", 2: "head", 3: "left_hand", 4: "right_hand"}
LEARN, LEARN_S = 1.0 / 3.0, 0.1
"""Share of a recording from which the arms are learnt, and seconds between the samples of it."""
ELBOW_NOISE_M = 0.005
"""Of the receiver on the forearm: it sits on skin that moves."""
LOWEST = Comfort(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
PEER = "elbow at its lowest (energy of height only)"

JOINTS = {
    "elbow": ("left_lower_arm", "right_lower_arm"),
    "shoulder": ("left_upper_arm", "right_upper_arm"),
    "wrist": ("left_hand", "right_hand"),
    "spine": ("left_shoulder",),
    "hips": ("hips",),
    "head": ("head",),
}
TARGETS = {
    ("elbow", "median"): at_most(25),
    ("elbow", "p95"): at_most(60),
    ("wrist", "median"): at_most(5),
    ("head", "median"): at_most(5),
}
MOST_JUMP_DEG = 5.0


@dataclass(frozen=True)
class PostureErrors:
    """errors: joint name to (n,) metres; jumps: (n,) turns of upper arms from one motion to the next beyond those in the
    truth [rad]; solve: (n,) seconds."""

    errors: dict[str, F64]
    jumps: F64
    solve: F64


def run() -> Iterator[Row]:
    """Every recording that is on this machine."""
    if not DATA.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no recordings", str(DATA))
    warm_up()
    pooled: list[tuple[PostureErrors, PostureErrors]] = []
    strangers: list[PostureErrors] = []
    known: list[PostureErrors] = []
    for recording in recordings():
        learnt = {s: fit_comfort(arm_samples(recording, s, recording.duration_s * LEARN)) for s in SIDES}
        ours, peer = measure(recording, learnt), measure(recording, LOWEST)
        pooled.append((ours, peer))
        strangers.append(measure(recording, START))
        known.append(measure(recording, learnt, skeleton=recording.measured()))
        yield from _rows(recording.name, ours, peer)
    if pooled:
        peers = _pool([p for _, p in pooled])
        yield from _rows("all", _pool([o for o, _ in pooled]), peers)
        for row in _rows("all, arms not learnt", _pool(strangers), peers):
            if row.metric.startswith(("elbow", "largest")):
                yield replace(row, target=None)
        for row in _rows("all, bones of the whole recordings", _pool(known), peers):
            if not row.metric.startswith("filter"):
                yield replace(row, target=None)
    yield from receiver_filter.rows()


def arm_samples(recording: Recording, side: str, until_s: float) -> ArmSamples:
    """What a receiver worn on the forearm tells of an arm, beside those on chest and hand."""
    skeleton = _measured(recording)
    rng = np.random.default_rng(7)
    at = np.round(np.arange(0.0, until_s, LEARN_S) * recording.rate_hz).astype(int)
    collar, chest = recording.joint(f"{side}_shoulder")[0][at], recording.joint("chest")[1][at]

    def seen(p: F64) -> F64:
        return np.einsum("nji,nj->ni", chest, p[at] - collar) + ELBOW_NOISE_M * rng.standard_normal((len(at), 3))

    hand = np.einsum("nji,njk->nik", chest, recording.joint(f"{side}_hand")[1][at])
    arm = f"{side}_upper_arm", f"{side}_lower_arm", f"{side}_hand"
    return ArmSamples(
        seen(recording.joint(arm[2])[0]),
        seen(recording.joint(arm[1])[0]),
        np.ascontiguousarray(hand),
        np.ascontiguousarray(chest[:, 1]),
        bones_of(skeleton, side),
        LEARN_S,
    )


def _measured(recording: Recording) -> Skeleton:
    """The person's bones, from the part that is learnt from."""
    return beginning(recording, recording.duration_s * LEARN).measured()


def recordings() -> list[Recording]:
    """Those under ../shared/data/body."""
    found = [load_bvh(path) for path in sorted((DATA / "cmu").glob("*.bvh"))] if (DATA / "cmu").is_dir() else []
    folder = DATA / "kth_handover" / "take_new"
    return found + (list(load_hand_over(folder).people.values()) if folder.is_dir() else [])


def measure(
    recording: Recording, comfort: Comfort | Mapping[str, Comfort], seed: int = 1, skeleton: Skeleton | None = None
) -> PostureErrors:
    """Play a recording through receivers, noise, filters and solver; errors of what was not learnt from.

    skeleton: the person's bones, if not those that the part learnt from shows.
    """
    skeleton = skeleton or _measured(recording)
    person = Person(
        name="who",
        display_name="",
        avatar="",
        height_m=1.7,
        seat=Stance(),
        tracker="t",
        stations=STATIONS,
        transmitter=(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])),
        gloves={},
    )
    capture = BodyCapture(person, skeleton, comfort)
    rng = np.random.default_rng(seed)
    errors: dict[str, list[float]] = {name: [] for names in JOINTS.values() for name in names}
    solves: list[float] = []
    arms: list[tuple[F64, F64]] = []
    newest: dict[int, TrackerReceiver] = {}
    for k in range(int(recording.duration_s * RECORDS_HZ)):
        t = k / RECORDS_HZ
        station = 1 + k % len(STATIONS)
        joints = _at(recording, t)
        newest[station] = _record(recording, skeleton, joints, station, 1_000_000_000 + round(t * 1e9), rng)
        if not capture.tracker(TrackerFrame(device="t", receivers=newest.values())):
            continue
        started = time.perf_counter()
        solved = capture.solve(capture.newest_ns).posture
        solves.append(time.perf_counter() - started)
        pose = pose_joints(skeleton, solved)
        if t < recording.duration_s * LEARN:
            continue
        for name, found in errors.items():
            found.append(float(np.linalg.norm(pose.position[JOINT_INDEX[name]] - joints[0][INDEX[name]])))
        solved_arms = _arms(pose.position[[JOINT_INDEX[n] for n in _ARM]])
        arms.append((solved_arms, _arms(joints[0][[INDEX[n] for n in _ARM]])))
    turn = np.array([[_angle(a, b) for a, b in zip(x, y, strict=True)] for x, y in _steps(arms)])
    return PostureErrors({n: np.array(e) for n, e in errors.items()}, turn[:, 0] - turn[:, 1], np.array(solves))


_ARM = ("left_upper_arm", "left_lower_arm", "right_upper_arm", "right_lower_arm")


def _arms(p: F64) -> F64:
    """(2, 3) unit directions of both upper arms."""
    d = np.stack((p[1] - p[0], p[3] - p[2]))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def _steps(arms: Sequence[tuple[F64, F64]]) -> Iterator[tuple[tuple[F64, F64], tuple[F64, F64]]]:
    for before, after in pairwise(arms):
        for side in range(2):
            yield (before[0][side], before[1][side]), (after[0][side], after[1][side])


def _angle(a: F64, b: F64) -> float:
    return math.acos(min(1.0, max(-1.0, float(a @ b))))


def _at(recording: Recording, t: float) -> tuple[F64, F64]:
    """Positions (12, 3) and rotations (12, 3, 3) at time `t`, between frames."""
    f = min(len(recording.position) - 1.0, t * recording.rate_hz)
    i = min(len(recording.position) - 2, int(f))
    share = f - i
    position = (1.0 - share) * recording.position[i] + share * recording.position[i + 1]
    mixed = (1.0 - share) * recording.rotation[i] + share * recording.rotation[i + 1]
    u, _, v = np.linalg.svd(mixed)
    return position, u @ v


def _record(
    recording: Recording, skeleton: Skeleton, joints: tuple[F64, F64], station: int, t_ns: int, rng: np.random.Generator
) -> TrackerReceiver:
    name = STATIONS[station]
    mount = receiver_mounts(skeleton)[name]
    p, r = joints[0][INDEX[name]], joints[1][INDEX[name]]
    if name == "chest":
        # The mount is on the left collar joint; the recording's chest is midway between both.
        p = p + r @ recording.offset("chest", "left_shoulder")
    p = p + r @ mount.position + NOISE_M * rng.standard_normal(3)
    q = quaternion_from_matrix(matrix_from_rotvec(NOISE_RAD * rng.standard_normal(3)) @ (r @ mount.rotation))
    out = TrackerReceiver(station=station, t_ns=t_ns, health=TrackerReceiver.HEALTH_GOOD)
    out.position.x, out.position.y, out.position.z = p
    out.rotation.x, out.rotation.y, out.rotation.z, out.rotation.w = q
    return out


def _pool(outcomes: Sequence[PostureErrors]) -> PostureErrors:
    errors = {n: np.concatenate([o.errors[n] for o in outcomes]) for n in outcomes[0].errors}
    jumps, solve = (np.concatenate(x) for x in zip(*((o.jumps, o.solve) for o in outcomes), strict=True))
    return PostureErrors(errors, jumps, solve)


def _rows(case: str, ours: PostureErrors, peer: PostureErrors) -> Iterator[Row]:
    for part, names in JOINTS.items():
        for metric, share in (("median", 50), ("p95", 95)):
            value, other = (float(np.percentile(np.concatenate([o.errors[n] for n in names]), share)) * 1e3 for o in (ours, peer))
            yield Row("posture", case, f"{part} error, {metric}", "mm", value, PEER, other, target=TARGETS.get((part, metric)))
    share, other = (100.0 * float((o.jumps > math.radians(MOST_JUMP_DEG)).mean()) for o in (ours, peer))
    yield Row("posture", case, f"frames with an arm jump over {MOST_JUMP_DEG:g} deg", "%", share, PEER, other)
    jump, other = (math.degrees(float(o.jumps.max())) for o in (ours, peer))
    yield Row("posture", case, "largest arm jump not in the truth", "deg", jump, PEER, other, target=at_most(MOST_JUMP_DEG))
    value, other = (float(np.median(o.solve)) * 1e3 for o in (ours, peer))
    yield Row("posture", case, "filter and solve, median", "ms", value, PEER, other, target=at_most(0.5))
