"""A recorded hand-over in the room: two people beside the table, and the baton.

The recorded thing is longer and thicker than the room's, and its frame is on top of it. So the room's baton lies on the line
between the two grips, and each hand is moved, while it holds, to its grip on the shorter baton.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.grip import closed_on
from vistel.figure.posture.hands import OPEN, RELAXED
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rotation_y, slerp
from vistel.space.people import PALM_CENTRE
from vistel.space.room import BATON_RADIUS, table_radius
from vistel_sim.motion.played import RATE_HZ, Joints, Played, PlayedFile, joints_at
from vistel_sim.motion.recording import SIDES, Recording, resampled
from vistel_sim.motion.six_dof import ROLES, HandOver
from vistel_sim.motion.source import SimulatedPerson
from vistel_sim.motion.tracks import minimum_jerk

CLEAR_OF_TABLE = 0.35
"""How far outside the table's edge the line between the two people runs, so that the others see them from the side
and they stand in nothing [m]."""
NEAR_GRIP = 0.07
"""A hand this near to its usual grip holds the thing [m]."""
LET_GO_S = 1.2
"""A hand that leaves the thing for less than this only shifts its grip."""
GRIP = 0.060
"""From the room's baton's middle to where each hand holds it: two fists side by side [m]."""
SLANT = math.radians(45.0)
"""Of the baton in the hand, from straight across the palm towards the fingers' tips."""
LEAD_S = 0.6
"""How long a hand is guided to the thing before it takes it [s]."""
CLOSE_S = 0.25
"""How long the fingers take to close [s]."""
READY_S = 0.5
"""How long before that the fingers open [s]."""


@dataclass(frozen=True)
class Line:
    """The thing of a recording as a line: middle (n, 3) and rotation (n, 3, 3), +X from the giver's grip to the taker's,
    in the recording's frame at RATE_HZ; reach: from the middle to each grip [m]; side of each role's hand, and the
    frames (first, last) in which it holds."""

    middle: F64
    rotation: F64
    reach: float
    side: Mapping[str, str]
    held: Mapping[str, tuple[int, int]]


def play_hand_over(people: dict[str, SimulatedPerson], take: HandOver, seats: int) -> PlayedFile:
    """The take's giver and taker beside the table; played back and forth, so the baton goes back."""
    recorded = {role: resampled(take.people[role], RATE_HZ) for role in ROLES}
    line = follow_thing(take, recorded)
    middle, ahead, turn = _beside_the_table(people, recorded, seats)
    start = np.mean([r.joint("hips")[0][0] for r in recorded.values()], axis=0) * (1.0, 0.0, 1.0)
    # One scale for both keeps their hands together.
    scale = float(
        np.mean(
            [
                person.skeleton.height / take.people[role].measured().height
                for role, person in zip(ROLES, people.values(), strict=True)
            ]
        )
    )

    def moved(p: F64) -> F64:
        return middle + scale * ((p - start) @ turn.T)

    line = replace(line, middle=moved(line.middle), rotation=turn @ line.rotation)
    played: dict[str, Played] = {}
    for role, person in zip(ROLES, people.values(), strict=True):
        r = recorded[role]
        hand = _Hand(person, role, line)
        # The shorter thing brings them nearer to each other.
        nearer = hand.toward * (scale * line.reach - GRIP) * ahead
        at = Recording(r.name, RATE_HZ, moved(r.position) + nearer, turn @ r.rotation)
        frames = [hand.led(joints_at(at, k), k) for k in range(len(line.middle))]
        played[person.name] = Played(person, frames, hand.fingers(), back_and_forth=True)
    return PlayedFile(played, (line.middle, line.rotation))


def follow_thing(take: HandOver, recorded: Mapping[str, Recording]) -> Line:
    """Where the thing's line is, and who holds it when. recorded: both people at RATE_HZ."""
    rows = np.round(np.arange(min(len(r.position) for r in recorded.values())) * take.people["giver"].rate_hz / RATE_HZ)
    position, rotation = (x[rows.astype(int)] for x in (take.baton_position, take.baton_rotation))
    side: dict[str, str] = {}
    grip: dict[str, F64] = {}
    held: dict[str, tuple[int, int]] = {}
    for role, r in recorded.items():
        palms = {s: _palm(r, s)[: len(position)] for s in SIDES}
        off = {s: np.einsum("nji,nj->ni", rotation, p - position) for s, p in palms.items()}
        side[role] = min(SIDES, key=lambda s, off=off: float(np.linalg.norm(off[s], axis=1).min()))
        mine = off[side[role]]
        away = np.linalg.norm(mine, axis=1)
        grip[role] = np.median(mine[away < away.min() + NEAR_GRIP], axis=0)
        held[role] = _longest(np.linalg.norm(mine - grip[role], axis=1) < NEAR_GRIP)
    x = grip["taker"] - grip["giver"]
    x = x / np.linalg.norm(x)
    z = np.cross(x, (0.0, 1.0, 0.0))
    z = z / np.linalg.norm(z)
    half = 0.5 * float(np.linalg.norm(grip["taker"] - grip["giver"]))
    frame = np.column_stack((x, np.cross(z, x), z))
    return Line(position + rotation @ (0.5 * (grip["giver"] + grip["taker"])), rotation @ frame, half, side, held)


def _palm(r: Recording, side: str) -> F64:
    """(n, 3) of the palm's middle."""
    p, q = r.joint(f"{side}_hand")
    return p + q @ (PALM_CENTRE * (1.0 if side == "left" else -1.0, 1.0, 1.0))


def _longest(holds: NDArray[np.bool_]) -> tuple[int, int]:
    """First and last frame of the longest time of holding; shifts of the grip do not end it."""
    runs: list[tuple[int, int]] = []
    for k in np.flatnonzero(holds):
        if runs and k - runs[-1][1] <= LET_GO_S * RATE_HZ:
            runs[-1] = runs[-1][0], int(k)
        else:
            runs.append((int(k), int(k)))
    return max(runs, key=lambda run: run[1] - run[0])


def _beside_the_table(people: dict[str, SimulatedPerson], recorded: Mapping[str, Recording], seats: int) -> tuple[F64, F64, F64]:
    """Where the middle between the two comes to stand (3,), the way from giver to taker (3,), and how the take is turned
    (3, 3): each on their own
    seat's side, on a line clear of the table."""
    giver, taker = (p.seat_position for p in people.values())
    ahead = taker - giver
    ahead = ahead / np.linalg.norm(ahead)
    between = 0.5 * (giver + taker) * (1.0, 0.0, 1.0)
    out = between - (between @ ahead) * ahead
    far = float(np.linalg.norm(out))
    # Opposite each other: to the giver's right.
    out = out / far if far > 0.05 else np.cross(ahead, (0.0, 1.0, 0.0))
    hips = {role: r.joint("hips")[0][0] for role, r in recorded.items()}
    was = hips["taker"] - hips["giver"]
    turn = rotation_y(math.atan2(ahead[0], ahead[2]) - math.atan2(was[0], was[2]))
    return out * (table_radius(seats) + CLEAR_OF_TABLE), ahead, turn


class _Hand:
    """The hand with which one of the two holds the baton."""

    def __init__(self, person: SimulatedPerson, role: str, line: Line) -> None:
        self._line = line
        self._name = line.side[role]
        sign = 1.0 if self._name == "left" else -1.0
        self.toward = 1.0 if role == "giver" else -1.0
        self._first, self._last = line.held[role]
        build = person.build
        self._point = build.palm[SIDES.index(self._name)] - (0.0, BATON_RADIUS, 0.0)
        self._slant = np.array([sign * math.sin(SLANT), 0.0, math.cos(SLANT)])
        self._closed = closed_on(build.skeleton, build.body, self._name, self._point, self._slant, BATON_RADIUS)

    def led(self, joints: Joints, k: int) -> Joints:
        """Frame `k` with this hand moved to its grip on the baton, while it holds."""
        share = self._held(k, LEAD_S, CLOSE_S)
        if share == 0.0:
            return joints
        p, r = joints.hands[self._name]
        x = self.toward * self._line.rotation[k][:, 0]
        turned = _turned_to(r @ self._slant, x) @ r
        there = self._line.middle[k] - GRIP * self.toward * self._line.rotation[k][:, 0] - turned @ self._point
        q = slerp(quaternion_from_matrix(np.ascontiguousarray(r)), quaternion_from_matrix(turned), share)
        return replace(joints, hands=joints.hands | {self._name: (p + share * (there - p), matrix_from_quaternion(q))})

    def fingers(self) -> F64:
        """(n, 2, 20) finger angles: closed while the hand holds, open on the way there and back, relaxed elsewhere."""
        row = SIDES.index(self._name)
        out = np.tile(RELAXED, (len(self._line.middle), 2, 1))
        for k in range(len(out)):
            ready = self._held(k, READY_S, CLOSE_S)
            out[k, row] = RELAXED + ready * (OPEN - RELAXED)
            out[k, row] += self._held(k, CLOSE_S) * (self._closed - out[k, row])
        return out

    def _held(self, k: int, rise_s: float, early_s: float = 0.0) -> float:
        """1 while the hand holds, and `early_s` before and after; rising and falling within `rise_s`, 0 elsewhere."""
        outside = max(self._first - k, k - self._last, 0) / RATE_HZ - early_s
        return 1.0 - minimum_jerk(outside / rise_s)


def _turned_to(a: F64, b: F64) -> F64:
    """(3, 3) least rotation that takes unit vector `a` to `b`."""
    v, c = np.cross(a, b), float(a @ b)
    k = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + k + k @ k / (1.0 + c)
