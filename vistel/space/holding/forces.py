"""Hand forces: the contacts of every hand, by finger and body, sixty times a second.

A hand feels furniture, things and other people; not its own body, which the real hand touches as well. Between two people
every contact is integrated once and acts on the other the other way round. Pressures are those of the ghosts that deform
the skin, so a picture of the contact and the force of it agree.
"""

import itertools
import math
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.implicit.contacts.contact import ContactArray
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.contact.forces import STIFFEST, ContactParameters
from vistel.space.contact.near import Bodies, placed
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
    return len(near) > 0 and bool((p.build.digit[near.a] >= 0).any())


def _hands_on_things(people: list[Posed], loose: PrimitiveSet) -> list[ContactArray]:
    """Contacts of each one's hands with loose things as they lie now, by primitive of the body."""
    if not people:
        return []
    found = Bodies([p.cones[p.build.hands] for p in people]).with_things(placed(loose))
    return [replace(c, a=p.build.hands[c.a].astype(np.int32)) for p, c in zip(people, found, strict=True)]


def _of_things(
    people: list[Posed], reached: Mapping[str, Reached], s: Solids, m: Motions, sticks: frozenset[Holding], free: frozenset[Holding]
) -> _Felt | None:
    """The forces of things on some people's hands: of fixed things, then of loose ones at their present poses."""
    loose = s.loose(m.matrices(), m.position)
    near = [k for k, p in enumerate(people) if _hand_near(p, reached[p.name].near)]
    on_loose = dict(zip(near, _hands_on_things([people[k] for k in near], loose), strict=True))
    parts: list[tuple[int, int, ContactArray]] = [(k, 0, reached[p.name].rest) for k, p in enumerate(people)]
    parts += [(k, len(s.fixed_rows), c) for k, c in on_loose.items()]
    parts = [part for part in sorted(parts, key=lambda part: part[:2]) if len(part[2])]
    if not parts:
        return None
    first = list(itertools.accumulate((len(p.primitives) for p in people), initial=0))
    found = _joined([c for _, _, c in parts], [first[k] for k, _, _ in parts], [begin for _, begin, _ in parts])
    digit = np.concatenate([p.build.digit for p in people])[found.a]
    rows = np.flatnonzero((found.field_depth > 0.0) & (digit >= 0))
    if len(rows) == 0:
        return None
    # In groups of one hand with one thing: only those share points.
    thing: I64 = s.owner[np.concatenate([s.fixed_rows, s.loose_rows])[found.b[rows]]]
    part: I64 = np.repeat(np.arange(len(parts)), [len(c) for _, _, c in parts])[rows]
    group = (part * 2 + digit[rows] // DIGITS) * len(s.things) + thing
    order = np.argsort(group, kind="stable")
    ends: list[int] = [0, *(np.flatnonzero(np.diff(group[order])) + 1).tolist(), len(order)]
    digits: list[int] = digit[rows[order]].tolist()
    sides: list[_Side] = []
    kept: list[I64] = []
    still: list[range] = []
    count = 0
    for i, j in itertools.pairwise(ends):
        k = int(order[i])
        hold = people[parts[int(part[k])][0]].name, digits[i] >= DIGITS, s.things[int(thing[k])].id
        if hold in free:
            continue
        sides.append(_Side(hold[:2], hold[2], range(count, count + j - i), [d % DIGITS for d in digits[i:j]]))
        if hold in sticks:
            still.append(range(count, count + j - i))
        kept.append(order[i:j])
        count += j - i
    if not sides:
        return None
    chosen = np.concatenate(kept)
    found, thing = _contacts(found, rows[chosen]), thing[chosen]
    velocity = np.concatenate([p.velocity for p in people])[found.a]
    motion = np.concatenate([m.velocity[thing], m.spin[thing], m.position[thing]], axis=1)
    motion[m.mode[thing] == FIXED] = 0.0
    for some in still:
        velocity[some.start : some.stop], motion[some.start : some.stop] = 0.0, 0.0
    soft = [s.things[int(thing[side.contacts[0]])].compliance for side in sides]
    bodies = PrimitiveSet.join([p.primitives for p in people]), PrimitiveSet.join([s.fixed, loose])
    return _Felt(_feel(found, [len(side.contacts) for side in sides], soft, bodies, velocity, motion), found.depth, sides)


def _of_people(posed: Mapping[str, Posed], skin: Mapping[tuple[str, str], ContactArray], asked: frozenset[str]) -> _Felt | None:
    """The forces of other people on hands, for every two people in contact: both sides of one contact."""
    parts: list[tuple[Posed, Posed, ContactArray]] = []
    for two, c in sorted(skin.items(), key=lambda item: item[0]):
        if two[0] in asked or two[1] in asked:
            p, q = posed[two[0]], posed[two[1]]
            rows = np.flatnonzero(((p.build.digit[c.a] >= 0) | (q.build.digit[c.b] >= 0)) & (c.field_depth > 0.0))
            if len(rows):
                parts.append((p, q, _contacts(c, rows)))
    if not parts:
        return None
    ends = itertools.accumulate((len(c) for _, _, c in parts), initial=0)
    sides: list[_Side] = []
    for (p, q, c), begins in zip(parts, ends, strict=False):
        for who, other, digit in ((p, q, p.build.digit[c.a]), (q, p, q.build.digit[c.b])):
            for right in (False, True):
                mine = np.flatnonzero((digit >= 0) & (digit // DIGITS == int(right)))
                if who.name in asked and len(mine):
                    digits: list[int] = (digit[mine] % DIGITS).tolist()
                    sides.append(_Side((who.name, right), other.name, (mine + begins).tolist(), digits, who is p))
    names = list(dict.fromkeys(p.name for pair in parts for p in pair[:2]))
    begin = dict(zip(names, itertools.accumulate((len(posed[n].primitives) for n in names), initial=0), strict=False))
    found = _joined([c for _, _, c in parts], [begin[p.name] for p, _, _ in parts], [begin[q.name] for _, q, _ in parts])
    everybody = PrimitiveSet.join([posed[n].primitives for n in names])
    speeds = np.concatenate([posed[n].velocity for n in names])
    motion = np.zeros((len(found), 9))
    motion[:, 0:3] = speeds[found.b]
    sizes, soft = [len(c) for _, _, c in parts], [FLESH_COMPLIANCE] * len(parts)
    return _Felt(_feel(found, sizes, soft, (everybody, everybody), speeds[found.a], motion), found.depth, sides)


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


def _joined(parts: list[ContactArray], first_a: list[int], first_b: list[int]) -> ContactArray:
    """Contacts one after the other, their primitives counted from where those of each part begin."""
    return ContactArray(
        np.concatenate([c.a + k for c, k in zip(parts, first_a, strict=True)]),
        np.concatenate([c.b + k for c, k in zip(parts, first_b, strict=True)]),
        np.concatenate([c.point for c in parts]),
        np.concatenate([c.normal for c in parts]),
        np.concatenate([c.depth for c in parts]),
        np.concatenate([c.field_depth for c in parts]),
    )


def _contacts(c: ContactArray, rows: I64) -> ContactArray:
    return ContactArray(c.a[rows], c.b[rows], c.point[rows], c.normal[rows], c.depth[rows], c.field_depth[rows])


def _arrays(s: PrimitiveSet) -> tuple[NDArray[np.int32], NDArray[np.int32], F64, F64, F64]:
    return s.kind, s.start, s.params, s.rotation, s.position
