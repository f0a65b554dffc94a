"""What hands feel: the contacts of `contact_forces` of every hand, per finger and body, sixty times a second.

A hand feels furniture, things and other people; not its own body, which the real hand touches as well. Between two people
every contact is integrated once and acts on the other the other way round. Pressures are those of the ghosts that deform
the skin, so a picture of the contact and the force of it agree.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.implicit.contact import ContactArray
from vistel.implicit.contact_set import PrimitiveSet
from vistel.space.contact_forces import STIFFEST, Surface
from vistel.space.dynamics import FIXED, Motions
from vistel.space.near import Bodies, placed
from vistel.space.people import DIGITS, HAND_JOINT, Posed
from vistel.space.solids import Solids
from vistel.space.touch import FLESH, FLESH_COMPLIANCE
from vistel.space.touch_kernels import (
    FELT,
    feel,  # pyright: ignore[reportUnknownVariableType]
    gather,  # pyright: ignore[reportUnknownVariableType]
)
from vistel.space.view import DigitTouch, HandForce

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Hand = tuple[str, bool]
"""Participant; whether it is the right hand."""
Holding = tuple[str, bool, str]
"""A hand and a thing."""

SKIN = Surface(pressure=FLESH, friction=0.5, damping=0.0, creep=0.05)
"""How hands push and rub. No damping, and friction that sets in over 5 cm/s: speeds are differences of two postures and
tremble, which an actuator must not."""


FELT_EACH_STEP = 8
"""People whose hands are felt in one step."""


@dataclass(frozen=True)
class Reached:
    """What is known of a figure's contacts: rest: with fixed things, by their primitive among those; near: with loose
    things within reach, before they moved."""

    rest: ContactArray
    near: ContactArray


@dataclass(frozen=True)
class _Side:
    """Some contacts, by number, as one hand feels them, which is a of them or b: digit of each, -1 where it is none."""

    hand: Hand
    body: str
    contacts: I64
    digit: I64
    is_a: bool = True


@dataclass(frozen=True)
class _Felt:
    """Contacts that were felt: rows (N, FELT), depth (N,) [m], and whose they are, in the order in which they add up."""

    rows: F64
    depth: F64
    sides: list[_Side]


def hand_forces(
    posed: Mapping[str, Posed], skin: Mapping[tuple[str, str], ContactArray], reached: Mapping[str, Reached],
    s: Solids, m: Motions, held: Iterable[Holding], let_go: Iterable[Holding] = (), due: Container[str] | None = None,
) -> tuple[HandForce, ...]:  # fmt: skip
    """What every hand that touches something feels, by participant, the left one first.

    skin: contacts of every two people who touch, by their names in order; reached: what is known of each figure's other contacts;
    held: participant, right, thing of each grasp: what a hand holds does not slide in it; let_go: the same of hands that
    have let go of a thing and are not off it yet, which do not push it either; due: whose hands are asked about, None:
    everybody's.
    """
    asked = [posed[name] for name in sorted(posed) if due is None or name in due]
    felt = [_of_things(asked, reached, s, m, frozenset(held), frozenset(let_go))]
    felt.append(_of_people(posed, skin, frozenset(p.name for p in asked)))
    forces = _whole([f for f in felt if f is not None], posed)
    return tuple(h for h in forces if h.touches)


def due_at(step: int, people: Sequence[str]) -> frozenset[str]:
    """Whose hands are felt at a step: everybody's of so few, in turns of many, so that a step costs no more."""
    turns = max(1, math.ceil(len(people) / FELT_EACH_STEP))
    return frozenset(people[step % turns :: turns])


def nothing(hand: Hand) -> HandForce:
    """What a hand feels that touches nothing."""
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
    people: list[Posed], reached: Mapping[str, Reached], s: Solids, m: Motions, sticks: frozenset[Holding],
    free: frozenset[Holding],
) -> _Felt | None:  # fmt: skip
    """What the hands of some people feel of things: of fixed ones, then of loose ones as they lie now."""
    loose = s.loose(m.matrices(), m.position)
    near = [k for k, p in enumerate(people) if _hand_near(p, reached[p.name].near)]
    on_loose = dict(zip(near, _hands_on_things([people[k] for k in near], loose), strict=True))
    first = np.cumsum([0, *(len(p.primitives) for p in people)])
    parts: list[tuple[int, int, ContactArray]] = []  # whose, where the other's primitives begin, contacts that press
    for k, p in enumerate(people):
        for begin, c in ((0, reached[p.name].rest), (len(s.fixed_rows), on_loose.get(k))):
            if c is None or len(c) == 0:
                continue
            rows = np.flatnonzero((c.field_depth > 0.0) & (p.build.digit[c.a] >= 0))
            if len(rows):
                parts.append((k, begin, _contacts(c, rows)))
    if not parts:
        return None
    who = np.concatenate([np.full(len(c), k) for k, _, c in parts])
    digit = np.concatenate([people[k].build.digit[c.a] for k, _, c in parts])
    found = _joined([c for _, _, c in parts], [int(first[k]) for k, _, _ in parts], [begin for _, begin, _ in parts])
    thing = s.owner[np.concatenate([s.fixed_rows, s.loose_rows])[found.b]]
    # In groups of one hand with one thing: only those share points.
    group = ((who * 2 + (found.b >= len(s.fixed_rows))) * 2 + digit // DIGITS) * len(s.things) + thing
    order = np.argsort(group, kind="stable")
    sides: list[_Side] = []
    still: list[I64] = []
    for rows in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        k = rows[0]
        hold = people[who[k]].name, bool(digit[k] >= DIGITS), s.things[thing[k]].id
        if hold not in free:
            sides.append(_Side(hold[:2], hold[2], rows, digit[rows] % DIGITS))
        if hold in sticks:
            still.append(rows)
    if not sides:
        return None
    velocity = np.concatenate([p.velocity for p in people])[found.a]
    motion = np.concatenate([m.velocity, m.spin, m.position], axis=1)[thing]
    motion[m.mode[thing] == FIXED] = 0.0
    for rows in still:
        velocity[rows], motion[rows] = 0.0, 0.0
    soft = [s.things[thing[side.contacts[0]]].compliance for side in sides]
    bodies = PrimitiveSet.join([p.primitives for p in people]), PrimitiveSet.join([s.fixed, loose])
    return _Felt(_feel(found, [side.contacts for side in sides], soft, bodies, velocity, motion), found.depth, sides)


def _of_people(
    posed: Mapping[str, Posed], skin: Mapping[tuple[str, str], ContactArray], asked: frozenset[str]
) -> _Felt | None:
    """What hands feel of other people, of every two that touch each other: both sides of one contact."""
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
    groups = [np.arange(i, j) for i, j in itertools.pairwise(ends)]
    sides: list[_Side] = []
    for (p, q, c), rows in zip(parts, groups, strict=True):
        for who, other, digit in ((p, q, p.build.digit[c.a]), (q, p, q.build.digit[c.b])):
            for right in (False, True):
                mine = (digit >= 0) & (digit // DIGITS == int(right))
                if who.name in asked and mine.any():
                    sides.append(_Side((who.name, right), other.name, rows[mine], digit[mine] % DIGITS, who is p))
    names = list(dict.fromkeys(p.name for pair in parts for p in pair[:2]))
    begin = dict(zip(names, itertools.accumulate((len(posed[n].primitives) for n in names), initial=0), strict=False))
    found = _joined([c for _, _, c in parts], [begin[p.name] for p, _, _ in parts], [begin[q.name] for _, q, _ in parts])
    everybody = PrimitiveSet.join([posed[n].primitives for n in names])
    speeds = np.concatenate([posed[n].velocity for n in names])
    motion = np.zeros((len(found), 9))
    motion[:, 0:3] = speeds[found.b]
    soft = [FLESH_COMPLIANCE] * len(groups)
    return _Felt(_feel(found, groups, soft, (everybody, everybody), speeds[found.a], motion), found.depth, sides)


def _feel(
    found: ContactArray, groups: list[I64], soft: list[float], bodies: tuple[PrimitiveSet, PrimitiveSet], velocity: F64,
    motion: F64,
) -> F64:  # fmt: skip
    """(N, FELT) rows of the contacts, 0 where they are in no group. soft: of the b of each group."""
    order = np.concatenate(groups)
    first = np.cumsum([0, *(len(rows) for rows in groups)])
    compliance = np.array([[max(FLESH_COMPLIANCE, STIFFEST), max(c, STIFFEST)] for c in soft])
    pairs = np.stack([found.a, found.b], axis=1).astype(np.int64)
    felt, out = np.zeros((len(order), FELT)), np.zeros((len(found), FELT))
    feel(
        first, pairs[order], found.point[order], found.normal[order], found.field_depth[order], compliance,
        _arrays(bodies[0]), _arrays(bodies[1]), SKIN.pressure, SKIN.friction, SKIN.creep, velocity[order], motion[order],
        felt,
    )  # fmt: skip
    out[order] = felt
    return out


def _whole(felt: list[_Felt], posed: Mapping[str, Posed]) -> list[HandForce]:
    """All that hands feel, summed by digit and body."""
    slots: dict[tuple[Hand, int, str], int] = {}
    hands: dict[Hand, int] = {}
    columns: list[tuple[I64, I64, I64, F64]] = []
    for k, f in enumerate(felt):
        begin = sum(len(g.rows) for g in felt[:k])
        for side in f.sides:
            slot = [slots.setdefault((side.hand, d, side.body), len(slots)) for d in side.digit.tolist()]
            hand = hands.setdefault(side.hand, len(hands))
            many = len(slot)
            sign = 1.0 if side.is_a else -1.0
            columns.append((begin + side.contacts, np.array(slot), np.full(many, hand), np.full(many, sign)))
    if not columns:
        return []
    sums, moment = np.zeros((len(slots), 13)), np.zeros((len(hands), 3))
    row, slot, hand, sign = (np.concatenate(c) for c in zip(*columns, strict=True))
    gather(
        row, slot, hand, sign, np.concatenate([f.rows for f in felt]), np.concatenate([f.depth for f in felt]), sums, moment
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
            DigitTouch(
                digit, body, s[3:6] / load, s[6:9] / max(thrust, 1e-12), s[0:3], thrust, area, load / area, peak, depth
            )
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
        np.concatenate([c.point for c in parts]), np.concatenate([c.normal for c in parts]),
        np.concatenate([c.depth for c in parts]), np.concatenate([c.field_depth for c in parts]),
    )  # fmt: skip


def _contacts(c: ContactArray, rows: I64) -> ContactArray:
    """Some of the contacts."""
    return ContactArray(c.a[rows], c.b[rows], c.point[rows], c.normal[rows], c.depth[rows], c.field_depth[rows])


def _arrays(s: PrimitiveSet) -> tuple[NDArray[np.int32], NDArray[np.int32], F64, F64, F64]:
    return s.kind, s.start, s.params, s.rotation, s.position
