"""The moves of a calibration: the instructions for the participant, and the samples of their receivers."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.posture.sensors import RECEIVERS
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rotvec_from_matrix, slerp

RATE_HZ = 20.0
"""At which the receivers, measured in turns, are brought to common times."""
TRIM_S = 0.4
"""Left out at both ends of a move: people begin late and stop early."""


class MoveError(ValueError):
    """Moves that cannot be used; one line: which, why, what to do again."""


GAP_S = 0.2
"""Between samples farther apart than this nothing is taken."""


@dataclass(frozen=True)
class Step:
    """One move. moves: receivers that must turn, and by how much at least [rad]; an empty table: hold still."""

    name: str
    seconds: float
    say: str
    moves: Mapping[str, float]


PAUSE_S = 4.0
"""For reading and getting ready before each move."""

STEPS: tuple[Step, ...] = (
    Step("t_pose", 3.0, "Stand straight, face the table, arms out to the sides, palms down. Hold still.", {}),
    Step("head", 9.0, "Keep the chest still. Nod, shake your head, tilt it to both shoulders; slowly, as far as it goes.",
         {"head": math.radians(50.0)}),
    Step("arms", 10.0, "Keep elbows and wrists straight. Draw large circles with both arms, ahead, to the sides and up.",
         {"left_hand": math.radians(60.0), "right_hand": math.radians(60.0)}),
    Step("elbows", 8.0, "Upper arms still at your sides, wrists straight. Bend and stretch both elbows, turning the palms.",
         {"left_hand": math.radians(50.0), "right_hand": math.radians(50.0)}),
    Step("wrists", 8.0, "Hold both forearms still. Circle with your hands in the wrists, and turn nothing else.",
         {"left_hand": math.radians(30.0), "right_hand": math.radians(30.0)}),
    Step("spine", 9.0, "Legs still. Bow, lean to both sides and turn to both sides with the chest.",
         {"chest": math.radians(30.0)}),
)  # fmt: skip


@dataclass(frozen=True)
class ReceiverTrack:
    """One receiver over common times: position (n, 3) [m], rotation (n, 3, 3)."""

    position: F64
    rotation: F64


Moves = Mapping[str, Mapping[str, ReceiverTrack]]
"""By step and receiver; all receivers of a step at the same times."""
Samples = Mapping[str, tuple[F64, F64, F64]]
"""By receiver: times (n,) [s], positions (n, 3), quaternions (n, 4) x y z w."""


FOREARM_STEPS: tuple[Step, ...] = tuple(
    Step(
        f"{side}_forearm",
        20.0,
        f"Wear the receiver of the head on the {side} forearm, close to the elbow. Move as in a meeting: point, take, drink.",
        {f"{side}_hand": math.radians(30.0), "head": math.radians(30.0)},
    )
    for side in ("left", "right")
)
"""Asked for only where the comfort of arms is learnt; there is more time before them."""
WEAR_S = 20.0

ALL_STEPS = STEPS + FOREARM_STEPS


def pause_of(step: Step) -> float:
    """For getting ready before a move [s]."""
    return WEAR_S if step in FOREARM_STEPS else PAUSE_S


def begin_of(step: Step) -> float:
    """When a move begins, counted from the beginning of the whole [s]."""
    before = ALL_STEPS[: ALL_STEPS.index(step)]
    return sum(s.seconds + pause_of(s) for s in before) + pause_of(step)


def whole_s(steps: Sequence[Step] = STEPS) -> float:
    """How long all of them take [s]."""
    return sum(s.seconds + pause_of(s) for s in steps)


def cut(samples: Samples, starts_s: float = 0.0, steps: Sequence[Step] = STEPS) -> Moves:
    """The moves in a stream of samples in which the whole began at `starts_s`. Raises MoveError."""
    return {s.name: step_tracks(s, samples, starts_s + begin_of(s)) for s in steps}


def find_beginning(samples: Samples) -> float:
    """When the whole began in a recording: the T-pose is the first time that both hands are held far out [s]. Raises MoveError."""
    left, right = samples.get("left_hand"), samples.get("right_hand")
    if left is None or right is None or len(left[0]) < 20 or len(right[0]) < 20:
        raise MoveError("the recording has no receivers on both hands")
    times = np.arange(max(left[0][0], right[0][0]), min(left[0][-1], right[0][-1]), 0.1)
    apart = np.linalg.norm(_at(times, *left)[0] - _at(times, *right)[0], axis=1)
    still = np.abs(np.gradient(apart, 0.1)) < 0.08
    held = still & (apart > 0.97 * np.percentile(apart, 99.5))
    step, run = STEPS[0], 0
    for k in range(len(times)):
        run = run + 1 if held[k] else 0
        if run * 0.1 >= step.seconds - 2.0 * TRIM_S:
            first = k - run + 1
            last = first
            while last + 1 < len(held) and held[last + 1]:
                last += 1
            return float(0.5 * (times[first] + times[last]) - 0.5 * step.seconds - PAUSE_S)
    raise MoveError("the recording shows no T-pose: arms out to both sides, held for three seconds; give its time with --from")


REST_S = 1.5
"""A receiver that is held still for this long was put there on purpose."""
_REST_M = 0.005
_APART_M = 0.02


def find_rests(t: F64, p: F64, q: F64) -> tuple[F64, F64]:
    """Where one receiver was held still, in order: mean positions (m, 3) and quaternions (m, 4) of its samples at rest, from
    times (n,) [s], positions (n, 3) [m] and quaternions (n, 4) x y z w. Two rests at the same place are one."""
    rests: list[tuple[F64, F64]] = []
    begin = 0
    for k in range(1, len(t) + 1):
        if k < len(t) and t[k] - t[k - 1] < 5.0 * GAP_S and np.linalg.norm(p[k] - np.median(p[begin:k][-64:], axis=0)) < _REST_M:
            continue
        if t[k - 1] - t[begin] >= REST_S:
            middle = slice(begin + (k - begin) // 8, k - (k - begin) // 8)
            turns = np.stack([matrix_from_quaternion(np.ascontiguousarray(v)) for v in q[middle]])
            at, turn = p[middle].mean(axis=0), quaternion_from_matrix(np.ascontiguousarray(mean_rotation(turns)))
            if not rests or np.linalg.norm(at - rests[-1][0]) > _APART_M:
                rests.append((at, turn))
        begin = k
    return np.array([r[0] for r in rests]).reshape(-1, 3), np.array([r[1] for r in rests]).reshape(-1, 4)


def step_tracks(step: Step, samples: Samples, begin_s: float) -> dict[str, ReceiverTrack]:
    """The receivers' samples during a move, checked. Raises MoveError."""
    times = np.arange(begin_s + TRIM_S, begin_s + step.seconds - TRIM_S, 1.0 / RATE_HZ)
    heard = np.ones(len(times), bool)
    for name in RECEIVERS:
        near = _heard(times, samples[name][0]) if name in samples else np.zeros(len(times), bool)
        if near.mean() < 0.5:
            raise MoveError(
                f"{step.name}: the receiver {name.replace('_', ' ')} was silent; check its plug and station, then repeat"
            )
        heard &= near
    if heard.mean() < 0.5:
        raise MoveError(f"{step.name}: the receivers were heard together for half of the time only; check their plugs, then repeat")
    out = {name: ReceiverTrack(*_at(times[heard], *samples[name])) for name in RECEIVERS}
    for name, least in step.moves.items():
        seen = turned(out[name])
        if seen < least:
            raise MoveError(
                f"{step.name}: {name.replace('_', ' ')} turned by {math.degrees(seen):.0f}° only, {math.degrees(least):.0f}° "
                f"or more are needed; repeat with larger moves: {step.say}"
            )
    if not step.moves:
        restless = max(turned(track) for track in out.values())
        if restless > math.radians(15.0):
            raise MoveError(f"{step.name}: you moved by {math.degrees(restless):.0f}°; hold still and repeat: {step.say}")
    return out


def turned(track: ReceiverTrack) -> float:
    """Largest turn away from the middle attitude, both ways together [rad]."""
    middle = track.rotation[len(track.rotation) // 2]
    away = np.empty((len(track.rotation), 3))
    for k, r in enumerate(track.rotation):
        away[k] = rotvec_from_matrix(np.ascontiguousarray(middle.T @ r))
    low, high = away.min(axis=0), away.max(axis=0)
    return math.dist(low, high)


def _heard(times: F64, t: F64) -> NDArray[np.bool_]:
    """(n,) whether samples lie close before and after each time."""
    if len(t) < 2:
        return np.zeros(len(times), bool)
    i = np.clip(np.searchsorted(t, times), 1, len(t) - 1)
    return (t[i] - t[i - 1] < GAP_S) & (t[i - 1] <= times) & (times <= t[i])


def _at(times: F64, t: F64, p: F64, q: F64) -> tuple[F64, F64]:
    position, rotation = np.empty((len(times), 3)), np.empty((len(times), 3, 3))
    for k, now in enumerate(times):
        i = min(max(int(np.searchsorted(t, float(now))) - 1, 0), len(t) - 2)
        share = min(1.0, max(0.0, float((now - t[i]) / max(t[i + 1] - t[i], 1e-9))))
        position[k] = p[i] + share * (p[i + 1] - p[i])
        rotation[k] = matrix_from_quaternion(slerp(q[i], q[i + 1], share))
    return position, rotation


def mean_rotation(rotation: F64) -> F64:
    """(3, 3) the middle of (n, 3, 3) rotations near one another."""
    u, _, v = np.linalg.svd(rotation.mean(axis=0))
    turn = u @ np.diag([1.0, 1.0, float(np.linalg.det(u @ v))]) @ v
    q = quaternion_from_matrix(np.ascontiguousarray(turn))
    return matrix_from_quaternion(q)
