"""Hand forces: the contacts of every hand, by finger and body, sixty times a second.

A hand feels furniture, things and other people; not its own body, which the real hand touches as well. Between two people
every contact is integrated once and acts on the other the other way round. Pressures are those of the ghosts that deform
the skin, so a picture of the contact and the force of it agree.
"""

import itertools
import math
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.implicit.contacts.contact import ContactArray
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.contact.forces import STIFFEST, ContactParameters
from vistel.space.contact.near import NONE, Bodies, placed
from vistel.space.contact.touch_kernels import (
    FELT,
    feel,  # pyright: ignore[reportUnknownVariableType]
    gather,  # pyright: ignore[reportUnknownVariableType]
)
from vistel.space.dynamics.dynamics import FIXED, Motions
from vistel.space.dynamics.solids import Solids
from vistel.space.people import DIGITS, HAND_JOINT, Posed
from vistel.space.touch import FLESH, FLESH_COMPLIANCE
from vistel.space.view import DigitTouch, HandForce

Hand = tuple[str, bool]
"""Participant; whether it is the right hand."""
Holding = tuple[str, bool, str]
"""A hand and a thing."""

SKIN = ContactParameters(pressure=FLESH, friction=0.5, damping=0.0, creep=0.05)
"""How hands push and rub. No damping, and friction that sets in over 5 cm/s: speeds are differences of two postures and
tremble, which an actuator must not."""


FELT_EACH_STEP = 8
"""People whose hands are felt in one step."""


@dataclass(frozen=True)
class Reached:
    """A figure's contacts. rest: with fixed things, by their primitive among those; near: with loose
    things within reach, before they moved."""

    rest: ContactArray
    near: ContactArray


@dataclass(frozen=True)
class _Side:
    """Some contacts, by number, as one hand feels them, which is a of them or b: digit of each."""

    hand: Hand
    body: str
    contacts: Sequence[int]
    digit: list[int]
    is_a: bool = True


@dataclass(frozen=True)
class _Part:
    """Some of a person's contacts. first_a, first_b: where the primitives of the two begin among those of all."""

    contacts: ContactArray
    rows: list[int]
    first_a: int
    first_b: int


@dataclass(frozen=True)
class _Felt:
    """Contacts that were felt: rows (N, FELT), depth (N,) [m], and whose they are, in the order in which they add up."""

    rows: F64
    depth: F64
    sides: list[_Side]


def hand_forces(
    posed: Mapping[str, Posed],
    skin: Mapping[tuple[str, str], ContactArray],
    reached: Mapping[str, Reached],
    s: Solids,
    m: Motions,
    held: Iterable[Holding],
    let_go: Iterable[Holding] = (),
    due: Container[str] | None = None,
) -> tuple[HandForce, ...]:
    """The force on every hand in contact, by participant, the left hand first.

    skin: contacts of every two people who touch, by their names in order; reached: each figure's other contacts; held: participant,
    right, thing of each grasp: a held thing does not slide in the hand; let_go: the same for hands that have let go of a thing and
    are still at it, which do not push it either; due: the participants whose hands are computed, None: all.
    """
    asked = [posed[name] for name in sorted(posed) if due is None or name in due]
    felt = [_of_things(asked, reached, s, m, frozenset(held), frozenset(let_go))]
    felt.append(_of_people(posed, skin, frozenset(p.name for p in asked)))
    forces = _whole([f for f in felt if f is not None], posed)
    return tuple(h for h in forces if h.touches)


def due_at(step: int, people: Sequence[str]) -> frozenset[str]:
    """Participants whose hands are computed at a step: all of a few people, or many people in turns, to bound a step's cost."""
    turns = max(1, math.ceil(len(people) / FELT_EACH_STEP))
    return frozenset(people[step % turns :: turns])


def nothing(hand: Hand) -> HandForce:
    """The hand force without any contact."""
    return HandForce(hand[0], hand[1], np.zeros(3), np.zeros(3), ())


def _hand_near(p: Posed, near: ContactArray) -> bool:
    """Whether a hand is within reach of something."""
    return any(digit >= 0 for digit in p.build.digits_of(near.a))


def _hands_on_things(people: list[Posed], loose: PrimitiveSet) -> list[ContactArray]:
    """Contacts of each one's hands with loose things as they lie now, by primitive of the body."""
    found = Bodies([p.cones[p.build.hands] for p in people]).with_things(placed(loose))
    rows = [p.build.hands[c.a].astype(np.int32) for p, c in zip(people, found, strict=True)]
    return [ContactArray(a, c.b, c.point, c.normal, c.depth, c.field_depth) for a, c in zip(rows, found, strict=True)]


def _of_things(
    people: list[Posed], reached: Mapping[str, Reached], s: Solids, m: Motions, sticks: frozenset[Holding], free: frozenset[Holding]
) -> _Felt | None:
    """The forces of things on some people's hands: of fixed things, then of loose ones at their present poses."""
    near = [p for p in people if _hand_near(p, reached[p.name].near)]
    loose = s.loose(m.matrices(), m.position) if near else None
    on_loose = dict(zip((p.name for p in near), _hands_on_things(near, loose), strict=True)) if loose else {}
    fixed_owner, loose_owner = s.owners
    sides: list[_Side] = []
    things: list[int] = []
    still: list[_Side] = []
    parts: list[_Part] = []
    first = count = 0
    for p in people:
        for c, owner, begin in (
            (reached[p.name].rest, fixed_owner, 0),
            (on_loose.get(p.name, NONE), loose_owner, len(fixed_owner)),
        ):
            rows: list[int] = []
            # In groups of one hand with one thing: only those share points.
            for (right, n), of_two in sorted(_by_hand_and_thing(p, c, owner).items()):
                hold = p.name, bool(right), s.things[n].id
                if hold in free:
                    continue
                digits = [d % DIGITS for d in p.build.digits_of(c.a[of_two])]
                sides.append(_Side(hold[:2], hold[2], range(count, count + len(of_two)), digits))
                if hold in sticks:
                    still.append(sides[-1])
                things += [n] * len(of_two)
                rows += of_two
                count += len(of_two)
            if rows:
                parts.append(_Part(c, rows, first, begin))
        first += len(p.primitives)
    if not sides:
        return None
    found, thing = _joined(parts), np.array(things)
    velocity = np.concatenate([p.velocity for p in people])[found.a]
    motion = np.concatenate([m.velocity[thing], m.spin[thing], m.position[thing]], axis=1)
    motion[m.mode[thing] == FIXED] = 0.0
    for side in still:
        velocity[side.contacts], motion[side.contacts] = 0.0, 0.0
    soft = [s.things[things[side.contacts[0]]].compliance for side in sides]
    bodies = _everybody(people), s.with_loose(loose) if loose else s.fixed
    return _Felt(_feel(found, [len(side.contacts) for side in sides], soft, bodies, velocity, motion), found.depth, sides)


def _by_hand_and_thing(p: Posed, c: ContactArray, owner: list[int]) -> dict[tuple[int, int], list[int]]:
    """Contacts of a hand that press, by whether it is the right one, and the thing. owner: thing of each primitive of b."""
    out: dict[tuple[int, int], list[int]] = {}
    things: list[int] = c.b.tolist()
    for k, (digit, b, pressed) in enumerate(zip(p.build.digits_of(c.a), things, c.field_depth.tolist(), strict=True)):
        if pressed > 0.0 and digit >= 0:
            out.setdefault((digit // DIGITS, owner[b]), []).append(k)
    return out


def _of_people(posed: Mapping[str, Posed], skin: Mapping[tuple[str, str], ContactArray], asked: frozenset[str]) -> _Felt | None:
    """The forces of other people on hands, for every two people in contact: both sides of one contact."""
    met: list[tuple[Posed, Posed, ContactArray, list[int]]] = []
    for two, c in sorted(skin.items(), key=lambda item: item[0]):
        if two[0] in asked or two[1] in asked:
            p, q = posed[two[0]], posed[two[1]]
            digits = zip(p.build.digits_of(c.a), q.build.digits_of(c.b), c.field_depth.tolist(), strict=True)
            rows = [k for k, (of_a, of_b, pressed) in enumerate(digits) if pressed > 0.0 and max(of_a, of_b) >= 0]
            if rows:
                met.append((p, q, c, rows))
    if not met:
        return None
    sides: list[_Side] = []
    count = 0
    for p, q, c, rows in met:
        for who, other, a in ((p, q, c.a), (q, p, c.b)):
            digit = who.build.digits_of(a[rows])
            for right in (False, True):
                mine = [k for k, d in enumerate(digit) if d >= 0 and d // DIGITS == int(right)]
                if who.name in asked and mine:
                    sides.append(
                        _Side((who.name, right), other.name, [count + k for k in mine], [digit[k] % DIGITS for k in mine], who is p)
                    )
        count += len(rows)
    people = list({p.name: p for pair in met for p in pair[:2]}.values())
    first = dict(zip((p.name for p in people), itertools.accumulate((len(p.primitives) for p in people), initial=0), strict=False))
    found = _joined([_Part(c, rows, first[p.name], first[q.name]) for p, q, c, rows in met])
    everybody, speeds = _everybody(people), np.concatenate([p.velocity for p in people])
    motion = np.zeros((len(found), 9))
    motion[:, 0:3] = speeds[found.b]
    sizes, soft = [len(rows) for *_, rows in met], [FLESH_COMPLIANCE] * len(met)
    return _Felt(_feel(found, sizes, soft, (everybody, everybody), speeds[found.a], motion), found.depth, sides)


def _everybody(people: list[Posed]) -> PrimitiveSet:
    return PrimitiveSet.of_cones(np.concatenate([p.cones for p in people]))


def _feel(
    found: ContactArray, sizes: list[int], soft: list[float], bodies: tuple[PrimitiveSet, PrimitiveSet], velocity: F64, motion: F64
) -> F64:
    """(N, FELT) rows of the contacts. sizes: of the groups one after the other, soft: of the b of each."""
    compliance = np.array([[max(FLESH_COMPLIANCE, STIFFEST), max(c, STIFFEST)] for c in soft])
    pairs = np.stack([found.a, found.b], axis=1).astype(np.int64)
    out = np.zeros((len(found), FELT))
    feel(
        np.cumsum([0, *sizes]),
        pairs,
        found.point,
        found.normal,
        found.field_depth,
        compliance,
        _arrays(bodies[0]),
        _arrays(bodies[1]),
        SKIN.pressure,
        SKIN.friction,
        SKIN.creep,
        velocity,
        motion,
        out,
    )
    return out


def _whole(felt: list[_Felt], posed: Mapping[str, Posed]) -> list[HandForce]:
    """All hand forces, summed by digit and body."""
    slots: dict[tuple[Hand, int, str], int] = {}
    hands: dict[Hand, int] = {}
    row: list[int] = []
    slot: list[int] = []
    hand_of: list[int] = []
    sign: list[float] = []
    begin = 0
    for f in felt:
        for side in f.sides:
            row += [begin + k for k in side.contacts]
            slot += [slots.setdefault((side.hand, d, side.body), len(slots)) for d in side.digit]
            hand_of += [hands.setdefault(side.hand, len(hands))] * len(side.digit)
            sign += [1.0 if side.is_a else -1.0] * len(side.digit)
        begin += len(f.rows)
    if not row:
        return []
    sums, moment = np.zeros((len(slots), 13)), np.zeros((len(hands), 3))
    gather(
        np.array(row),
        np.array(slot),
        np.array(hand_of),
        np.array(sign),
        np.concatenate([f.rows for f in felt]),
        np.concatenate([f.depth for f in felt]),
        sums,
        moment,
    )
    touches: dict[Hand, list[DigitTouch]] = {hand: [] for hand in hands}
    force = np.zeros((len(hands), 3))
    for (hand, digit, body), k in sorted(slots.items()):
        s = sums[k]
        area, load, peak, depth = s[9:13].tolist()
        if not area > 0.0:
            continue
        thrust = math.sqrt(float(s[6] * s[6] + s[7] * s[7] + s[8] * s[8]))
        force[hands[hand]] += s[0:3]
        touches[hand].append(
            DigitTouch(digit, body, s[3:6] / load, s[6:9] / max(thrust, 1e-12), s[0:3], thrust, area, load / area, peak, depth)
        )
    out: list[HandForce] = []
    for hand in sorted(hands):
        total, wrist = force[hands[hand]], posed[hand[0]].joints.position[HAND_JOINT[int(hand[1])]]
        out.append(HandForce(hand[0], hand[1], total, moment[hands[hand]] - _cross(wrist, total), tuple(touches[hand])))
    return out


def _cross(a: F64, b: F64) -> F64:
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _joined(parts: list[_Part]) -> ContactArray:
    """Contacts one after the other, their primitives counted from where those of each part begin."""
    return ContactArray(
        np.concatenate([part.contacts.a[part.rows] + part.first_a for part in parts]),
        np.concatenate([part.contacts.b[part.rows] + part.first_b for part in parts]),
        np.concatenate([part.contacts.point[part.rows] for part in parts]),
        np.concatenate([part.contacts.normal[part.rows] for part in parts]),
        np.concatenate([part.contacts.depth[part.rows] for part in parts]),
        np.concatenate([part.contacts.field_depth[part.rows] for part in parts]),
    )


def _arrays(s: PrimitiveSet) -> tuple[NDArray[np.int32], NDArray[np.int32], F64, F64, F64]:
    return s.kind, s.start, s.params, s.rotation, s.position
