"""What differs between two logs of the same conference: postures joint by joint, contacts, who held what, answers to commands.

Both logs count conference time: what one captured at a time is compared with what the other has for the same time, between two of
its postures where it has none of just then.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import Posture, interpolate, pose_joints
from vistel.figure.skeleton import JOINTS, PARENTS, Skeleton
from vistel.log.intervals import Intervals, seconds
from vistel.log.numbers import skeleton_of
from vistel.v1.command_pb2 import CommandResult

if TYPE_CHECKING:
    from vistel.log import Log

Timed = Sequence[tuple[float, Posture]]
"""Times [s], ascending, and postures."""
LONGEST_S = 2.5 / 60.0
"""Postures farther apart are not interpolated: motion has 60 frames a second, and one may be lost [s]."""
SAME_S = 1e-6
"""Times so close are one [s]."""
COMMON = 95.0
"""Differences are judged by what all but a twentieth of the postures keep to [percentile]: a late sample is no change."""
AT_ONCE = 512
"""Postures that are compared in one go: their joints take 8 MB."""
SHORTEST_S = 0.5 / 60.0
"""Less than half a step of the world apart is not apart [s]."""


@dataclass(frozen=True)
class Limits:
    """What two logs may differ by. degrees, mm: of a joint, as `COMMON` of the postures; apart_s: of each contact and grasp."""

    degrees: float = 0.5
    mm: float = 5.0
    apart_s: float = 0.25


@dataclass(frozen=True)
class JointDifference:
    """How far one joint of one participant differs: its own rotation relative to its parent [degrees], and where it is [mm];
    for all but a twentieth of the postures, and at most."""

    participant: str
    joint: str
    degrees: float
    most_degrees: float
    mm: float
    most_mm: float


@dataclass(frozen=True)
class PosturesCompared:
    """Of one participant: how many postures were compared, and how many only the first or only the second log has."""

    participant: str
    compared: int
    only_first: int
    only_second: int


@dataclass(frozen=True)
class SpanDifference:
    """A contact of two bodies, or a thing and who held it: how long in each log, and how long in only one of them [s]."""

    what: str
    first_s: float
    second_s: float
    apart_s: float


@dataclass(frozen=True)
class AnswerDifference:
    """A command that was answered differently; an empty text: not at all."""

    participant: str
    command: str
    first: str
    second: str


@dataclass(frozen=True)
class Comparison:
    """Everything that was compared, and `seconds` that both logs have [s]. joints: those of every participant."""

    seconds: float
    postures: list[PosturesCompared] = field(default_factory=list[PosturesCompared])
    joints: list[JointDifference] = field(default_factory=list[JointDifference])
    contacts: list[SpanDifference] = field(default_factory=list[SpanDifference])
    grasps: list[SpanDifference] = field(default_factory=list[SpanDifference])
    commands: int = 0
    answers: list[AnswerDifference] = field(default_factory=list[AnswerDifference])

    def over(self, limits: Limits) -> list[str]:
        """A line for everything that is beyond the limits."""
        out: list[str] = []
        for p in self.postures:
            if p.compared == 0:
                out.append(f"{p.participant}: no posture of both logs is of the same moment")
            elif p.only_first + p.only_second > 0.05 * p.compared:
                out.append(f"{p.participant}: {p.only_first} postures only in the first log, {p.only_second} only in the second")
        for j in self.joints:
            if j.degrees > limits.degrees or j.mm > limits.mm:
                out.append(f"{j.participant} {j.joint}: {j.degrees:.2f} degrees, {j.mm:.1f} mm")
        for kind, spans in (("contact", self.contacts), ("grasp", self.grasps)):
            out += [f"{kind} {s.what}: {s.apart_s:.2f} s apart" for s in spans if s.apart_s > limits.apart_s]
        out += [f"command {a.command} of {a.participant}: {a.first or 'none'}, {a.second or 'none'}" for a in self.answers]
        return out


def compare(first: Log, second: Log, begin: float = 0.0, end: float | None = None) -> Comparison:
    """Compare two logs from `begin` to `end` [s of the first log]. Raises ValueError when they have no time in common."""
    ahead = (second.begin_ns - first.begin_ns) * 1e-9
    begin, end = max(begin, ahead), min(first.duration if end is None else end, second.duration + ahead)
    if end <= begin:
        raise ValueError(f"{first.path} and {second.path} have no time in common")
    joints: list[JointDifference] = []
    counts: list[PosturesCompared] = []
    for name in dict.fromkeys([*first.participants, *second.participants]):
        count, found = _postures(first, second, name, begin, end, ahead)
        if count.compared + count.only_first + count.only_second:
            counts.append(count)
            joints += found
    contacts, grasps = _spans(first, second, begin, end, ahead)
    one, other = _answers(first, begin, end), _answers(second, begin - ahead, end - ahead)
    answers = [
        AnswerDifference(*key, one.get(key, ""), other.get(key, ""))
        for key in sorted(one.keys() | other.keys())
        if one.get(key) != other.get(key)
    ]
    return Comparison(end - begin, counts, joints, contacts, grasps, len(one.keys() | other.keys()), answers)


def _postures(
    first: Log, second: Log, name: str, begin: float, end: float, ahead: float
) -> tuple[PosturesCompared, list[JointDifference]]:
    skeleton = skeleton_of(first if name in first.participants else second, name)
    one, other = _of(first, name, begin, end), _of(second, name, begin - ahead, end - ahead)
    pairs = list(_same_moments(one, [(t + ahead, posture) for t, posture in other]))
    count = PosturesCompared(name, len(pairs), len(one) - len(pairs), max(0, len(other) - len(pairs)))
    if not pairs:
        return count, []
    degrees: list[F64] = []
    mm: list[F64] = []
    for at in range(0, len(pairs), AT_ONCE):
        piece = pairs[at : at + AT_ONCE]
        a, a_at = _posed(skeleton, [p for p, _ in piece])
        b, b_at = _posed(skeleton, [p for _, p in piece])
        # Between two rotations by an angle: |A - B| = 2 sqrt(2) sin(angle / 2), exact also where the angle is small.
        degrees.append(np.degrees(2.0 * np.arcsin(np.minimum(1.0, np.linalg.norm(a - b, axis=(2, 3)) / np.sqrt(8.0)))))
        mm.append(1e3 * np.linalg.norm(a_at - b_at, axis=2))
    turned, moved = np.concatenate(degrees), np.concatenate(mm)
    figures = (np.percentile(turned, COMMON, axis=0), turned.max(0), np.percentile(moved, COMMON, axis=0), moved.max(0))
    return count, [JointDifference(name, joint, *(float(f[j]) for f in figures)) for j, joint in enumerate(JOINTS)]


def _of(log: Log, name: str, begin: float, end: float) -> list[tuple[float, Posture]]:
    """The postures of a participant; none where the log does not know them."""
    known = not log.participants or name in log.participants
    return sorted(log.postures(name, begin, end), key=lambda timed: timed[0]) if known else []


def _same_moments(one: Timed, other: Timed) -> Iterator[tuple[Posture, Posture]]:
    """Each posture of `one`, and that of `other` at the same time, where it has one or two neighbours between which it is."""
    times = [t for t, _ in other]
    for t, posture in one:
        after = bisect_left(times, t - SAME_S)
        if after < len(times) and times[after] <= t + SAME_S:
            yield posture, other[after][1]
        elif 0 < after < len(times) and times[after] - times[after - 1] <= LONGEST_S:
            share = (t - times[after - 1]) / (times[after] - times[after - 1])
            yield posture, interpolate(other[after - 1][1], other[after][1], share)


def _posed(skeleton: Skeleton, postures: Sequence[Posture]) -> tuple[F64, F64]:
    """(N, J, 3, 3) rotations relative to the parents, the hips' in the room; (N, J, 3) positions in the room [m]."""
    posed = [pose_joints(skeleton, posture) for posture in postures]
    rotation, position = np.array([p.rotation for p in posed]), np.array([p.position for p in posed])
    local = rotation.copy()
    local[:, 1:] = np.swapaxes(rotation[:, PARENTS[1:]], 2, 3) @ rotation[:, 1:]
    return local, position


def _spans(first: Log, second: Log, begin: float, end: float, ahead: float) -> tuple[list[SpanDifference], list[SpanDifference]]:
    """Contacts and grasps that either log has."""
    out: list[list[SpanDifference]] = []
    for one, other in zip(_noted(first, end, 0.0), _noted(second, end - ahead, ahead), strict=True):
        found: list[SpanDifference] = []
        for what in sorted(one.edges.keys() | other.edges.keys()):
            a, b = one.within(what, begin, end), other.within(what, begin, end)
            if a or b:
                apart = seconds([*a, *b])
                found.append(SpanDifference(what, seconds(a), seconds(b), apart if apart > SHORTEST_S else 0.0))
        out.append(found)
    return out[0], out[1]


def _noted(log: Log, end: float, ahead: float) -> tuple[Intervals[str], Intervals[str]]:
    """Who touched what or whom, and who held what, at times `ahead` [s] later than the log's."""
    touching, holding = Intervals[str](), Intervals[str]()
    for t, room in log.rooms(end=end):
        touching.note(t + ahead, frozenset(" and ".join(sorted(pair)) for pair in room.touching))
        held = ((thing.id, who) for thing in room.things.values() for who in thing.holders)
        holding.note(t + ahead, frozenset(f"{thing} by {who}" for thing, who in held))
    return touching, holding


def _answers(log: Log, begin: float, end: float) -> dict[tuple[str, str], str]:
    """By participant and command: what the world answered."""
    return dict(_each_answer(log, begin, end))


def _each_answer(log: Log, begin: float, end: float) -> Iterator[tuple[tuple[str, str], str]]:
    for found in log.messages("command_result", begin=max(0.0, begin), end=end):
        message: CommandResult = found.message
        outcome = CommandResult.Outcome.Name(message.outcome).removeprefix("OUTCOME_").lower()
        yield (found.names["participant"], message.id), f"{outcome} {message.reason}".strip()
