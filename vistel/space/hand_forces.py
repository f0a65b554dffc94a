"""What hands feel: the contacts of `contact_forces` of every hand, per finger and body, sixty times a second.

A hand feels furniture, things and other people; not its own body, which the real hand touches as well. Between two people
every contact is integrated once and acts on the other the other way round. Pressures are those of the ghosts that deform
the skin, so a picture of the contact and the force of it agree.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from vistel.implicit.contact import ContactArray
from vistel.implicit.contact_set import PrimitiveSet
from vistel.space.contact_forces import STIFFEST, Surface
from vistel.space.dynamics import FIXED, Motions
from vistel.space.near import Bodies, placed
from vistel.space.people import DIGITS, HAND_JOINT, Posed
from vistel.space.solids import Solids
from vistel.space.touch import FLESH, FLESH_COMPLIANCE, grouped
from vistel.space.touch_kernels import FELT, feel  # pyright: ignore[reportUnknownVariableType]
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
class _Felt:
    """Contacts of one hand with one body: digit (N,), depth (N,) [m], rows (N, FELT) as seen by the hand."""

    hand: Hand
    body: str
    digit: I64
    depth: F64
    rows: F64


@dataclass(frozen=True)
class Reached:
    """What is known of a figure's contacts: rest: with fixed things, by their primitive among those; near: with loose
    things within reach, before they moved."""

    rest: ContactArray
    near: ContactArray


@dataclass(frozen=True)
class _Part:
    """Contacts of a hand with the primitives of some things; owner: (len(primitives),) thing of each."""

    found: ContactArray
    primitives: PrimitiveSet
    owner: I64


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
    felt: list[_Felt] = []
    sticks, free = frozenset(held), frozenset(let_go)
    names = sorted(name for name in posed if due is None or name in due)
    loose = _hands_on_things([posed[name] for name in names if _hand_near(posed[name], reached[name].near)], s, m)
    for name in names:
        parts = [_Part(reached[name].rest, s.fixed, s.owner[s.fixed_rows])]
        if name in loose:
            parts.append(loose[name])
        for part in parts:
            felt += _of_things(posed[name], part, s, m, sticks, free)
    for two, found in sorted(skin.items(), key=lambda item: item[0]):
        if due is None or two[0] in due or two[1] in due:
            both = _of_people(posed[two[0]], posed[two[1]], found)
            felt += [f for f in both if due is None or f.hand[0] in due]
    out: list[HandForce] = []
    for hand in sorted({f.hand for f in felt}):
        wrist = posed[hand[0]].joints.position[HAND_JOINT[int(hand[1])]]
        out.append(_whole(hand, [f for f in felt if f.hand == hand], wrist))
    return tuple(h for h in out if h.touches)


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


def _hands_on_things(people: list[Posed], s: Solids, m: Motions) -> dict[str, _Part]:
    """Contacts of some people's hands with loose things as they lie now, by primitive of the body."""
    if not people:
        return {}
    things, owner = s.loose(m.matrices(), m.position), s.owner[s.loose_rows]
    found = Bodies([p.cones[p.build.hands] for p in people]).with_things(placed(things))
    return {
        p.name: _Part(replace(c, a=p.build.hands[c.a].astype(np.int32)), things, owner)
        for p, c in zip(people, found, strict=True)
        if len(c)
    }


def _of_things(
    p: Posed, part: _Part, s: Solids, m: Motions, sticks: frozenset[Holding], free: frozenset[Holding]
) -> list[_Felt]:
    found = part.found
    pressed = np.flatnonzero(found.field_depth > 0.0)
    if len(pressed) == 0:
        return []
    digit = p.build.digit[found.a[pressed]]
    pressed, digit = pressed[digit >= 0], digit[digit >= 0]
    things = len(s.things)
    out: list[_Felt] = []
    for key, rows in sorted(grouped(digit // DIGITS * things + part.owner[found.b[pressed]], pressed).items()):
        right, n = key >= things, key % things
        body = s.things[n]
        hold = p.name, right, body.id
        if hold in free:
            continue
        of = _contacts(found, rows)
        motion, speed = _still(len(part.primitives), 9), _still(len(p.velocity), 3)
        if hold not in sticks:
            speed = p.velocity
            if m.mode[n] != FIXED:
                motion = np.tile(np.concatenate([m.velocity[n], m.spin[n], m.position[n]]), (len(part.primitives), 1))
        rows_felt = _feel(of, p.primitives, part.primitives, FLESH_COMPLIANCE, body.compliance, speed, motion)
        out.append(_Felt((p.name, right), body.id, p.build.digit[of.a] % DIGITS, of.depth, rows_felt))
    return out


@cache
def _still(count: int, width: int) -> F64:
    """(count, width) zeros, never written to: nothing moves."""
    return np.zeros((count, width))


def _of_people(p: Posed, q: Posed, found: ContactArray) -> list[_Felt]:
    touched = (p.build.digit[found.a] >= 0) | (q.build.digit[found.b] >= 0)
    rows = np.flatnonzero(touched & (found.field_depth > 0.0))
    if len(rows) == 0:
        return []
    of = _contacts(found, rows)
    motion = np.concatenate([q.velocity, np.zeros((len(q.velocity), 6))], axis=1)
    seen = _feel(of, p.primitives, q.primitives, FLESH_COMPLIANCE, FLESH_COMPLIANCE, p.velocity, motion)
    mirrored = seen * np.array([-1.0] * 6 + [1.0] * 3 + [-1.0] * 3 + [1.0] * 4)
    out: list[_Felt] = []
    for who, other, digit, felt in ((p, q, p.build.digit[of.a], seen), (q, p, q.build.digit[of.b], mirrored)):
        for right in (False, True):
            chosen = (digit >= 0) & (digit // DIGITS == int(right))
            if chosen.any():
                out.append(_Felt((who.name, right), other.name, digit[chosen] % DIGITS, of.depth[chosen], felt[chosen]))
    return out


def _feel(of: ContactArray, a: PrimitiveSet, b: PrimitiveSet, c_a: float, c_b: float, velocity: F64, motion: F64) -> F64:
    """(N, FELT) rows of the contacts."""
    rows = np.zeros((len(of), FELT))
    feel(
        np.stack([of.a, of.b], axis=1).astype(np.int64), of.point, of.normal, of.field_depth, max(c_a, STIFFEST),
        max(c_b, STIFFEST), _arrays(a), _arrays(b), SKIN.pressure, SKIN.friction, SKIN.creep, velocity, motion, rows,
    )  # fmt: skip
    return rows


def _whole(hand: Hand, felt: list[_Felt], wrist: F64) -> HandForce:
    """All that a hand feels, summed by digit and body. Plain numbers: arrays of so few cost more than they save."""
    sums: dict[tuple[int, str], list[float]] = {}
    moment = [0.0, 0.0, 0.0]
    for f in felt:
        for digit, depth, r in zip(f.digit.tolist(), f.depth.tolist(), f.rows.tolist(), strict=True):
            if not r[12] > 0.0:
                continue
            load = r[12] * r[14]
            s = sums.setdefault((digit, f.body), [0.0] * 13)
            for m in range(3):
                s[m] += r[m]
                s[3 + m] += load * r[6 + m]
                s[6 + m] += r[13] * r[9 + m]
                moment[m] += r[3 + m]
            s[9], s[10] = s[9] + r[12], s[10] + load
            s[11], s[12] = max(s[11], r[15]), max(s[12], depth)
    touches: list[DigitTouch] = []
    force = np.zeros(3)
    for (digit, body), s in sorted(sums.items()):
        normal = np.array(s[6:9])
        thrust = math.sqrt(s[6] * s[6] + s[7] * s[7] + s[8] * s[8])
        total = np.array(s[0:3])
        force = force + total
        touches.append(
            DigitTouch(
                digit, body, np.array(s[3:6]) / s[10], normal / max(thrust, 1e-12), total, thrust, s[9], s[10] / s[9],
                s[11], s[12],
            )
        )  # fmt: skip
    return HandForce(hand[0], hand[1], force, np.array(moment) - _cross(wrist, force), tuple(touches))


def _cross(a: F64, b: F64) -> F64:
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _contacts(c: ContactArray, rows: I64 | list[int]) -> ContactArray:
    """Some of the contacts."""
    return ContactArray(c.a[rows], c.b[rows], c.point[rows], c.normal[rows], c.depth[rows], c.field_depth[rows])


def _arrays(s: PrimitiveSet) -> tuple[NDArray[np.int32], NDArray[np.int32], F64, F64, F64]:
    return s.kind, s.start, s.params, s.rotation, s.position

