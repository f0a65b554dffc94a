"""The script of the synthetic meeting: tracks of hands, baton and attention in one cycle.

Seat 0 takes the baton from its rest, hands it to seat 1, gets it back later and puts it down again; the last seat
lays a hand on seat 0's; seats 1 and the last press their palms together. Parts whose people are absent are left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vistel.arrays import F64
from vistel.figure.grip import closed_round
from vistel.figure.posture.hands import FLAT, OPEN, PRESSED, RELAXED, hand_rotation
from vistel.figure.posture.sensors import Placement
from vistel.figure.skeleton import REFERENCE_HEIGHT
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.space.room import BATON, BATON_RADIUS
from vistel.space.things.things import identity
from vistel_sim.motion.layout import Layout
from vistel_sim.motion.sitter import Sitter
from vistel_sim.motion.tracks import HandKey, HandState, HandTrack

CYCLE_S = 20.0
UP = np.array([0.0, 1.0, 0.0])
SIDES = {"left": 1.0, "right": -1.0}

GIVER_BELOW = 0.032
"""How far below the baton's middle the giver holds it [m]."""
TAKER_ABOVE = 0.046
"""How far above the baton's middle the taker holds it [m]."""


CLOSE_COMPANY = 4
"""With more seats than this, arms would be in each other's way."""


@dataclass(frozen=True)
class Script:
    """Hand tracks by (participant, side), carried things, points and times of attention."""

    tracks: dict[tuple[str, str], HandTrack]
    baton: tuple[tuple[float, str | None, str, float], ...]
    """Who holds the baton: (from time [s], participant or None, side, position of its middle along the hand's Z [m])."""
    baton_rest: Placement
    grip: dict[tuple[str, str], F64]
    """Where the axis of a held bar crosses the palm: (3,) in the hand's frame [m]."""
    points: dict[str, F64] = field(default_factory=dict)
    looks: dict[str, list[tuple[float, float, str]]] = field(default_factory=dict)

    def hand(self, participant: str, side: str, t: float) -> HandState:
        """The hand at time `t` of the cycle."""
        return self.tracks[participant, side].at(t)

    def things(self, t: float) -> dict[str, Placement]:
        """Poses of carried things at time `t` of the cycle (room frame)."""
        if not self.baton:
            return {}
        _, who, side, along = next(h for h in reversed(self.baton) if h[0] <= t)
        if who is None:
            return {BATON: self.baton_rest}
        hand = self.hand(who, side, t)
        rotation = matrix_from_quaternion(hand.rotation)
        middle = hand.position + rotation @ (self.grip[who, side] + np.array([0.0, 0.0, along]))
        # The baton's own axis is X; the hand's Z runs along it.
        axes = np.column_stack((rotation[:, 2], rotation[:, 1], -rotation[:, 0]))
        return {BATON: (middle, quaternion_from_matrix(axes))}


def write_script(sitters: Mapping[str, Sitter], layout: Layout) -> Script:
    """The script for the people present; parts without a baton, or for people out of each other's reach, are left out."""
    seats = layout.seats
    by_seat = {s.person.seat: s for s in sitters.values()}
    desk = {(name, side): Hand(s, side, layout) for name, s in sitters.items() for side in SIDES}
    first, second, last = by_seat.get(0), by_seat.get(1), by_seat.get(seats - 1) if seats > 2 else None
    looks: dict[str, list[tuple[float, float, str]]] = {name: [] for name in sitters}
    points: dict[str, F64] = {}
    holds: list[tuple[float, str | None, str, float]] = []
    baton = layout.baton_for(first.person.seat_position) if first is not None else None
    if first is not None and second is not None and baton is not None and _reach(layout, first, second):
        holds = _hand_over(desk, first, second, baton.position)
        looks[first.person.name] += [(1.2, 7.0, f"thing:{BATON}"), (9.8, 14.6, f"thing:{BATON}")]
        looks[second.person.name] += [(a, b, f"thing:{BATON}") for a, b in ((2.6, 4.2), (4.8, 8.6), (9.6, 12.2))]
        if last is not None:
            looks[last.person.name] += [(2.4, 4.0, f"thing:{BATON}"), (5.0, 6.6, f"thing:{BATON}")]
    if first is not None and last is not None and _reach(layout, first, last):
        points["comfort"] = _hand_on_hand(desk, first, last)
        looks[last.person.name] += [(8.6, 10.2, "point:comfort"), (10.2, 11.6, "head:" + first.person.name)]
    if second is not None and last is not None and second is not last and seats == 3 and _reach(layout, second, last):
        points["palms"] = _palm_to_palm(desk, second, last)
        looks[second.person.name] += [(14.4, 16.4, "point:palms")]
        looks[last.person.name] += [(14.3, 16.4, "point:palms")]
    grip = {key: hand.grip for key, hand in desk.items()}
    tracks = {key: HandTrack(hand.keys) for key, hand in desk.items()}
    rest = (baton.position, baton.rotation) if baton is not None else (np.zeros(3), identity())
    return Script(tracks, tuple(holds), rest, grip, points, looks)


def _reach(layout: Layout, a: Sitter, b: Sitter) -> bool:
    return layout.seats <= CLOSE_COMPANY and layout.meet(a.person.seat_position, b.person.seat_position)


class Hand:
    """A hand while its track is being written."""

    def __init__(self, sitter: Sitter, side: str, layout: Layout) -> None:
        self.sitter, self.side, self.sign, self.layout = sitter, side, SIDES[side], layout
        person = sitter.person
        self.scale = person.skeleton.height / REFERENCE_HEIGHT
        self.grip = person.build.palm[list(SIDES).index(side)] - np.array([0.0, BATON_RADIUS, 0.0])
        position = sitter.out_of_seat(np.array([self.sign * 0.175, 0.0, 0.385]))
        position[1] += layout.table(position) + 0.062
        fingers = sitter.direction_in_room(np.array([-self.sign * 0.42, 0.05, 0.9]))
        palm = sitter.direction_in_room(np.array([-self.sign * 0.2, -1.0, 0.0]))
        self.home = (position, quaternion_from_matrix(hand_rotation(self.sign, fingers, palm)))
        self.keys: list[HandKey] = [HandKey(0.0, *self.home, RELAXED, free=1.0)]

    def shoulder(self) -> F64:
        """(3,) approximate position of the shoulder, upright, room frame."""
        height = self.sitter.person.skeleton.height
        return self.sitter.out_of_seat(np.array([self.sign * 0.18 * self.scale, 0.57 * height, 0.0]))

    def rest_at(self, wrist: F64) -> None:
        """Set the rest position, from the beginning on."""
        self.home = (wrist, self.home[1])
        self.keys[0] = HandKey(0.0, *self.home, RELAXED, free=1.0)

    def rest(self, t: float, lift: float = 0.02) -> None:
        self.keys.append(HandKey(t, *self.home, RELAXED, lift, 1.0))

    def leave(self, t: float) -> None:
        """Stop gesturing at `t` and begin to work 0.3 s later, from the rest position."""
        self.keys.append(HandKey(t, *self.home, RELAXED, 0.0, 1.0))
        self.keys.append(HandKey(t + 0.3, *self.home, RELAXED, 0.0, 0.0))

    def hold(self, t: float, wrist: F64, rotation: F64, fingers: F64, lift: float = 0.0) -> None:
        self.keys.append(HandKey(t, wrist, quaternion_from_matrix(rotation), fingers, lift, 0.0))

    def wrist_for(self, grip_point: F64, rotation: F64) -> F64:
        """(3,) position of the wrist for a grip at `grip_point`."""
        return grip_point - rotation @ self.grip

    def closed(self, radius: float) -> F64:
        """(20,) fingers closed round a bar of `radius`."""
        build = self.sitter.person.build
        return closed_round(build.skeleton, build.body, self.side, self.grip, radius)


def level(d: F64) -> F64:
    """(3,) unit, the part of a direction (3,) that is level."""
    flat = np.array([d[0], 0.0, d[2]])
    return flat / np.linalg.norm(flat)


def _between(a: Sitter, b: Sitter, towards_centre: float) -> F64:
    """(3,) on the floor, half-way between two seats, moved towards the table's centre by a share."""
    return 0.5 * (a.person.seat_position + b.person.seat_position) * (1.0 - towards_centre)


def _hand_over(desk: dict[tuple[str, str], Hand], a: Sitter, b: Sitter, baton: F64) -> list[tuple[float, str | None, str, float]]:
    """`a` takes the baton with the right hand and gives it to `b`'s left; `b` gives it back; `a` puts it down."""
    giver, taker = desk[a.person.name, "right"], desk[b.person.name, "left"]
    fist_a, fist_b = giver.closed(BATON_RADIUS), taker.closed(BATON_RADIUS)

    # Palm down over the baton, fingers ahead, the thumb's side towards the free end.
    down = hand_rotation(-1.0, a.direction_in_room(np.array([0.0, 0.0, 1.0])), -UP)
    pick = giver.wrist_for(baton - GIVER_BELOW * down[:, 2], down)
    above = pick + 0.085 * UP + a.direction_in_room(np.array([0.0, 0.0, -0.03]))

    # Thumb up, the baton upright between the two.
    middle = _between(a, b, 0.02)
    table = giver.layout.table(middle)
    meet = middle + (table + 0.24) * UP
    fa, fb = level(meet - giver.shoulder()), level(meet - taker.shoulder())
    give = hand_rotation(-1.0, fa, np.cross(UP, fa))
    take = hand_rotation(1.0, fb, -np.cross(UP, fb))
    give_wrist = giver.wrist_for(meet - GIVER_BELOW * UP, give)
    take_wrist = taker.wrist_for(meet + TAKER_ABOVE * UP, take)
    give_back = 0.07 * np.cross(UP, fa) * -1.0 - 0.03 * fa
    take_back = 0.07 * np.cross(UP, fb) - 0.03 * fb

    # `b` looks at it upright, close by.
    see = b.out_of_seat(np.array([0.10, table + 0.26, 0.40]))
    seen_along, seen_palm = (b.direction_in_room(np.array(d)) for d in ((-0.25, 0.1, 0.95), (-1.0, 0.15, 0.0)))
    seen = hand_rotation(1.0, seen_along, seen_palm)

    giver.leave(0.9)
    giver.hold(2.3, above, down, OPEN, 0.08)
    giver.hold(2.8, pick, down, OPEN)
    giver.hold(3.2, pick, down, fist_a)
    giver.hold(3.3, pick, down, fist_a)
    giver.hold(3.8, pick + 0.07 * UP, down, fist_a)
    giver.hold(5.0, give_wrist, give, fist_a, 0.03)
    giver.hold(5.9, give_wrist, give, fist_a)
    giver.hold(6.25, give_wrist, give, OPEN)
    giver.hold(6.75, give_wrist + give_back, give, OPEN)
    giver.rest(7.9)

    taker.leave(3.4)
    taker.hold(5.0, take_wrist + take_back, take, OPEN, 0.03)
    taker.hold(5.4, take_wrist, take, OPEN)
    taker.hold(5.8, take_wrist, take, fist_b)
    taker.hold(6.3, take_wrist, take, fist_b)
    taker.hold(7.5, taker.wrist_for(see, seen), seen, fist_b)
    taker.hold(9.3, taker.wrist_for(see + 0.01 * UP, seen), seen, fist_b)
    taker.hold(10.5, take_wrist, take, fist_b)
    taker.hold(11.5, take_wrist, take, fist_b)
    taker.hold(11.85, take_wrist, take, OPEN)
    taker.hold(12.3, take_wrist + take_back, take, OPEN)
    taker.rest(13.4)

    giver.leave(9.0)
    giver.hold(10.6, give_wrist + give_back, give, OPEN, 0.03)
    giver.hold(11.0, give_wrist, give, OPEN)
    giver.hold(11.4, give_wrist, give, fist_a)
    giver.hold(11.9, give_wrist, give, fist_a)
    giver.hold(13.2, pick + 0.06 * UP, down, fist_a, 0.03)
    giver.hold(13.7, pick, down, fist_a)
    giver.hold(13.8, pick, down, fist_a)
    giver.hold(14.2, pick, down, OPEN)
    giver.hold(14.7, above, down, OPEN)
    giver.rest(15.9)
    return [
        (0.0, None, "", 0.0),
        (3.25, a.person.name, "right", GIVER_BELOW),
        (5.85, b.person.name, "left", -TAKER_ABOVE),
        (11.45, a.person.name, "right", GIVER_BELOW),
        (13.75, None, "", 0.0),
    ]


def _hand_on_hand(desk: dict[tuple[str, str], Hand], a: Sitter, c: Sitter) -> F64:
    """`a` rests the left hand on the table, `c` lays the right hand on it. Returns where (3,)."""
    under, over = desk[a.person.name, "left"], desk[c.person.name, "right"]
    spot = _between(a, c, 0.05)
    spot = spot + under.layout.table(spot) * UP
    fa, fc = level(spot - under.shoulder()), level(spot - over.shoulder())
    flat, laid = hand_rotation(1.0, fa, -UP), hand_rotation(-1.0, fc, -UP)
    low = spot - 0.06 * under.scale * fa + 0.027 * UP
    # Over the knuckles, clear of the wrist.
    high = spot + 0.03 * fa - 0.062 * over.scale * fc + (0.027 + 0.035) * UP
    under.leave(6.8)
    under.hold(8.0, low, flat, FLAT, 0.03)
    under.hold(12.4, low, flat, FLAT)
    under.rest(13.5, 0.03)
    over.leave(7.4)
    over.hold(8.9, high + 0.09 * UP, laid, OPEN, 0.03)
    over.hold(9.5, high, laid, FLAT)
    over.hold(10.1, high + 0.004 * UP, laid, FLAT)
    over.hold(10.6, high - 0.002 * UP, laid, FLAT)
    over.hold(11.5, high, laid, FLAT)
    over.hold(12.0, high + 0.08 * UP, laid, OPEN)
    over.rest(13.1)
    return spot


def _palm_to_palm(desk: dict[tuple[str, str], Hand], b: Sitter, c: Sitter) -> F64:
    """`b`'s right and `c`'s left palm meet over the table. Returns where (3,)."""
    one, two = desk[b.person.name, "right"], desk[c.person.name, "left"]
    spot = _between(b, c, 0.0)
    spot = spot + (one.layout.table(spot) + 0.30) * UP
    across = level(c.person.seat_position - b.person.seat_position)
    for hand, palm in ((one, across), (two, -across)):
        # The fingers lean towards each other, so that the wrists stay apart.
        fingers = 0.8 * UP - 0.6 * level(spot) + 0.17 * palm
        rotation = hand_rotation(hand.sign, fingers, palm)
        centre = rotation @ (np.array([hand.sign * 0.062, 0.0, 0.0]) * hand.scale)
        wrist = spot - centre - 0.025 * palm
        hand.leave(13.6)
        hand.hold(14.9, wrist - 0.09 * palm, rotation, PRESSED, 0.02)
        hand.hold(15.3, wrist, rotation, PRESSED)
        hand.hold(16.1, wrist + 0.002 * palm, rotation, PRESSED)
        hand.hold(16.6, wrist - 0.10 * palm, rotation, OPEN)
        hand.rest(17.8)
    return spot
