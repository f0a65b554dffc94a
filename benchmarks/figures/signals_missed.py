"""How often simulated people who raise a hand or hold a thumb up are missed (`vistel.space.gestures`), and how late they are seen:
`python -m benchmarks.figures.signals_missed [--seed 1] [--count 100]`. `benchmarks.figures.gestures` counts false alarms.

People of several sizes, on seats that face anywhere, hold what counts as a signal for 1.5 to 3 s. They wear trackers and gloves
that sit a little wrong and tremble, or sit before a webcam whose landmarks do, and whose user's size is not known. A signal counts
as seen where it is made while it is held.
"""

import argparse
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.figures.gestures import signals_in
from benchmarks.grasping.errors import GLOVE, measured
from benchmarks.scores import wilson
from vistel.arrays import F64
from vistel.capture.body import BodyCapture, warm_up
from vistel.capture.config import Person
from vistel.capture.gestures import THUMB_UP
from vistel.capture.pointer import PointerCapture
from vistel.figure.posture.channel import minimum_jerk
from vistel.figure.posture.hands import RELAXED
from vistel.figure.posture.limits import FINGER_LIMITS, within_limits
from vistel.figure.posture.posture import ELBOW, SHOULDER, WRIST, JointPose, Posture, Stance, pose_joints
from vistel.figure.posture.sensors import RECEIVERS, Mount, receiver_mounts, receiver_poses
from vistel.figure.skeleton import JOINT_INDEX, Skeleton, standard_skeleton
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix
from vistel.protocol.pages.camera_body import CameraBodyDecoder, camera_record
from vistel.space.gestures import EVERY, STEPS, THUMB, UP, hands_above, thumbs_up
from vistel.space.people import build_of
from vistel.v1.device_pb2 import TrackerFrame, TrackerReceiver
from vistel_sim.pages.camera_body import SimulatedCamera

STEP_NS, RATE_HZ = 16_666_667, 60.0
SIZES_M, HELD_S = (1.45, 1.98), (1.5, 3.0)
RESTS_S, MOVES_S = 0.6, 0.7
"""Before the signal, and for the hand to come to it and to go."""
MOUNT_M, MOUNT_RAD = 0.006, math.radians(3.0)
"""By how much a receiver sits elsewhere than where it is believed to, along and about each axis, for good."""
TREMBLE_M, TREMBLE_RAD = 0.0008, math.radians(0.15)
KNOWN = 0.02
"""Error of a tracked person's size, as a share."""
PICTURE, DEPTH_M = 0.002, 0.04
"""Noise of a webcam's landmarks [picture heights] and of the body's depths."""
CALIBRATED_S = 8.0
GUEST_M = 1.71
"""Size of a guest's figure, whatever theirs is."""
STANDS_M = 0.12
"""How far below the eyes a webcam stands."""
_SIDES = ("left", "right")
_HERE = Stance(np.zeros(3), 0.0)
_SEATED = np.zeros(25)
_SEATED[:2] = 0.1, 1.6
for _side, _sign in (("left", 1.0), ("right", -1.0)):
    _SEATED[SHOULDER[_side]], _SEATED[ELBOW[_side]] = (0.2, -0.3 * _sign, -1.0 * _sign), 1.0

Seen = Sequence[tuple[Skeleton, Posture]]
Device = Callable[["Trial", np.random.Generator], Seen]


@dataclass(frozen=True)
class Trial:
    """skeleton: the person's own; postures: true ones at RATE_HZ; right: the hand that signals; begins, ends: steps between which
    what counts is truly held."""

    kind: str
    skeleton: Skeleton
    postures: tuple[Posture, ...]
    right: int
    begins: int
    ends: int


def trials(kind: str, count: int, seed: int) -> Iterator[Trial]:
    """People who signal, each for themselves; without those whose hand sways to where it does not count."""
    for n in range(count):
        rng, trial = np.random.default_rng((seed, n)), None
        while trial is None:
            trial = _trial(kind, rng)
        yield trial


def _trial(kind: str, rng: np.random.Generator) -> Trial | None:
    skeleton = standard_skeleton(rng.uniform(*SIZES_M))
    right = int(rng.integers(2))
    stance = Stance(np.array((*rng.uniform(-2.0, 2.0, 2), 0.0))[[0, 2, 1]], rng.uniform(-math.pi, math.pi))
    rest = within_limits(Posture(_SEATED + rng.normal(0.0, 0.05, 25), np.stack([RELAXED, RELAXED]), stance))
    signal = next(p for p in iter(lambda: _signalling(kind, rest, right, rng), None) if _holds(kind, skeleton, p)[right])
    steps = [round(RATE_HZ * s) for s in (RESTS_S, MOVES_S, rng.uniform(*HELD_S), MOVES_S, RESTS_S)]
    shares = [*[0.0] * steps[0], *_eased(steps[1]), *[1.0] * steps[2], *_eased(steps[3])[::-1], *[0.0] * steps[4]]
    sways = 0.02 * np.sin(np.arange(len(shares))[:, None] / RATE_HZ * rng.uniform(2.0, 8.0, 25) + rng.uniform(0.0, 6.0, 25))
    sways[:, :6] = 0.0
    way, close = signal.dofs - rest.dofs, signal.hands - rest.hands
    postures = tuple(
        replace(rest, dofs=rest.dofs + share * way + sway, hands=rest.hands + share * close)
        for share, sway in zip(shares, sways, strict=True)
    )
    held = [n for n, p in enumerate(postures) if _holds(kind, skeleton, p)[right]]
    if len(held) < steps[2] or held[-1] - held[0] + 1 > len(held):
        return None
    return Trial(kind, skeleton, postures, right, held[0], held[-1] + 1)


def _eased(steps: int) -> list[float]:
    return [minimum_jerk(n / steps) for n in range(steps)]


def _signalling(kind: str, rest: Posture, right: int, rng: np.random.Generator) -> Posture:
    """Somebody with an arm anywhere, and for a thumb a fist as no two people make it."""
    side, sign = _SIDES[right], 1.0 - 2.0 * right
    dofs, hands = rest.dofs.copy(), rest.hands.copy()
    raised = rng.uniform(0.2, 1.5) if kind == UP else rng.uniform(-1.3, 0.2)
    dofs[SHOULDER[side]] = rng.uniform(-0.8, 0.8), sign * rng.uniform(-1.4, 0.2), sign * raised
    dofs[ELBOW[side]] = rng.uniform(0.0, 2.0)
    if kind == THUMB:
        dofs[WRIST[side]] = rng.uniform(-0.9, 0.9), *rng.normal(0.0, 0.2, 2)
        hands[right] = THUMB_UP + rng.normal(0.0, np.repeat((0.12, 0.16), (4, 16)))
        hands[right] = np.clip(hands[right], FINGER_LIMITS[:, 0], FINGER_LIMITS[:, 1])
    return within_limits(replace(rest, dofs=dofs, hands=hands))


def _holds(kind: str, skeleton: Skeleton, posture: Posture, going_on: bool = False) -> tuple[bool, bool]:
    """Whether each hand is held as the rule asks; going_on: whether it has been."""
    position = pose_joints(skeleton, posture).position
    return hands_above(skeleton, position) if kind == UP else thumbs_up(posture.hands, position, going_on)


def by_trackers(trial: Trial, rng: np.random.Generator) -> Seen:
    """Four receivers, and gloves."""
    skeleton = standard_skeleton(trial.skeleton.height * (1.0 + rng.normal(0.0, KNOWN)))
    stations = dict(enumerate(RECEIVERS, 1))
    origin = np.zeros(3), np.array((0.0, 0.0, 0.0, 1.0))
    person = Person("who", "", "", skeleton.height, trial.postures[0].stance, "t", stations, origin, {})
    capture = BodyCapture(person, skeleton)
    mounts = {
        name: Mount(
            mount.joint,
            mount.position + rng.normal(0.0, MOUNT_M, 3),
            np.ascontiguousarray(matrix_from_rotvec(rng.normal(0.0, MOUNT_RAD, 3)) @ mount.rotation),
        )
        for name, mount in receiver_mounts(trial.skeleton).items()
    }
    fingers = [
        measured(np.array([p.hands[n] for p in trial.postures]), np.zeros((len(trial.postures), 3)), GLOVE, rng)[0] for n in (0, 1)
    ]
    out: list[tuple[Skeleton, Posture]] = []
    for n, true in enumerate(trial.postures):
        placed = receiver_poses(trial.skeleton, pose_joints(trial.skeleton, true), mounts)
        t_ns = 10**9 + n * STEP_NS
        capture.tracker(TrackerFrame(device="t", receivers=[_record(k, t_ns, *placed[name], rng) for k, name in stations.items()]))
        hands = np.clip(np.stack([f[n] for f in fingers]), FINGER_LIMITS[:, 0], FINGER_LIMITS[:, 1])
        out.append((skeleton, replace(capture.solve(t_ns).posture, hands=hands)))
    return out


def _record(station: int, t_ns: int, p: F64, q: F64, rng: np.random.Generator) -> TrackerReceiver:
    p = p + rng.normal(0.0, TREMBLE_M, 3)
    q = quaternion_from_matrix(matrix_from_rotvec(rng.normal(0.0, TREMBLE_RAD, 3)) @ matrix_from_quaternion(q))
    out = TrackerReceiver(station=station, t_ns=t_ns, health=TrackerReceiver.HEALTH_GOOD)
    out.position.x, out.position.y, out.position.z = p
    out.rotation.x, out.rotation.y, out.rotation.z, out.rotation.w = q
    return out


def by_webcam(trial: Trial, rng: np.random.Generator) -> Seen:
    """Landmarks of a camera on a screen before them, thirty a second; the figure is a guest's."""
    build = build_of(GUEST_M, 1.0)
    guest, decoder = PointerCapture("who", build, _HERE), CameraBodyDecoder("camera")
    own, camera = _before_camera(trial, rng)
    calibrating = round(CALIBRATED_S * RATE_HZ)
    out: list[tuple[Skeleton, Posture]] = []
    for n in range(-calibrating, len(own)):
        t_ns = 10**18 + n * STEP_NS
        if n % 2 == 0:
            seen = camera.see(trial.skeleton, own[max(0, n)])
            for frame in decoder.feed(camera_record(t_ns, seen, calibrating=n < 0), t_ns):
                guest.see(frame)
        posture = guest.solve(t_ns)
        if n >= 0:
            out.append((build.skeleton, posture))
    return out


def _before_camera(trial: Trial, rng: np.random.Generator) -> tuple[list[JointPose], SimulatedCamera]:
    """The person's joints at each step in the seat's frame, and the camera."""
    own = [pose_joints(trial.skeleton, replace(p, stance=_HERE)) for p in trial.postures]
    eyes = own[0].position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0)
    place = eyes + np.array((0.0, -STANDS_M, rng.uniform(0.7, 1.2)))
    return own, SimulatedCamera(place, noise=PICTURE, depth_noise=DEPTH_M, seed=int(rng.integers(2**31)))


def in_picture(trial: Trial, rng: np.random.Generator) -> bool:
    """Whether the camera of `by_webcam` ever sees the hand while it signals. No rule finds a signal that is beside the picture."""
    own, camera = _before_camera(trial, rng)
    return any(camera.sees_hand(joints, _SIDES[trial.right]) for joints in own[trial.begins : trial.ends : EVERY])


def delay_s(trial: Trial, seen: Seen) -> float | None:
    """From when a signal is truly held to when it counts; None where it does not while it is held."""
    held: list[bool] = []
    for skeleton, posture in seen[::EVERY]:
        left, right = _holds(trial.kind, skeleton, posture, bool(held and held[-1]))
        held.append(left != right if trial.kind == UP else left or right)
    counts = [n * EVERY for n in signals_in(held, trial.kind)]
    return next(((n - trial.begins) / RATE_HZ for n in counts if trial.begins <= n < trial.ends), None)


def lines(kind: str, name: str, device: Device, count: int, seed: int) -> Iterator[str]:
    """What came of so many signals; of a webcam, and of those that are in its picture."""
    delays, there = list[float | None](), list[bool]()
    for n, trial in enumerate(trials(kind, count, seed)):
        delays.append(delay_s(trial, device(trial, np.random.default_rng((seed, n, 1)))))
        if device is by_webcam:
            there.append(in_picture(trial, np.random.default_rng((seed, n, 1))))
    yield _line(kind, name, delays)
    if there:
        yield _line(kind, f"{name}, in its picture", [d for d, seen in zip(delays, there, strict=True) if seen])


def _line(kind: str, name: str, delays: Sequence[float | None]) -> str:
    found, count = [d for d in delays if d is not None], len(delays)
    missed = count - len(found)
    low, high = wilson(missed, count)
    late = f"seen after {np.median(found):.2f} s, nine in ten by {np.percentile(found, 90):.2f} s" if found else "none seen"
    return f"{kind:6} {name:26} missed {missed} of {count} ({100 * missed / count:.1f} %, {low:.1f} to {high:.1f}), {late}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=100, help="signals of each kind by each device")
    asked = parser.parse_args()
    warm_up()
    for kind in (UP, THUMB):
        print(f"{kind}: asked for {STEPS[kind] / RATE_HZ:g} s")
        for name, device in (("trackers and gloves", by_trackers), ("webcam", by_webcam)):
            for line in lines(kind, name, device, asked.count, asked.seed):
                print(line, flush=True)


if __name__ == "__main__":
    main()
