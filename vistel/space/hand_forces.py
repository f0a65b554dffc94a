"""What hands feel: the contacts of `contact_forces` of every hand, per finger and body, sixty times a second.

A hand feels furniture, things and other people; not its own body, which the real hand touches as well. Between two people
every contact is integrated once and acts on the other the other way round. Pressures are those of the ghosts that deform
the skin, so a picture of the contact and the force of it agree.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vistel.implicit.contact import ContactArray, find_contacts
from vistel.implicit.contact_set import PrimitiveSet
from vistel.space.contact_forces import STIFFEST, Surface
from vistel.space.dynamics import FIXED, Motions
from vistel.space.people import DIGITS, HAND_JOINT, Posed
from vistel.space.solids import Solids
from vistel.space.touch import FLESH, FLESH_COMPLIANCE
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


@dataclass(frozen=True)
class _Felt:
    """Contacts of one hand with one body: digit (N,), depth (N,) [m], rows (N, FELT) as seen by the hand."""

    hand: Hand
    body: str
    digit: I64
    depth: F64
    rows: F64


@dataclass(frozen=True)
class _Room:
    """primitives: of all things, posed, fixed ones first."""

    primitives: PrimitiveSet
    solids: Solids
    motions: Motions

    @cached_property
    def owner(self) -> I64:
        s = self.solids
        return s.owner[np.concatenate([s.fixed_rows, s.loose_rows])]

    def motion(self, n: int) -> F64:
        """(9,) of thing n; all 0 for a fixed one."""
        m = self.motions
        return np.zeros(9) if m.mode[n] == FIXED else np.concatenate([m.velocity[n], m.spin[n], m.position[n]])


def hand_forces(
    posed: Mapping[str, Posed], skin: Mapping[tuple[str, str], ContactArray], s: Solids, m: Motions,
    held: Iterable[Holding], let_go: Iterable[Holding] = (),
) -> tuple[HandForce, ...]:  # fmt: skip
    """What every hand that touches something feels, by participant, the left one first.

    skin: contacts of every two people, by their names in order; held: participant, right, thing of each grasp: what a
    hand holds does not slide in it; let_go: the same of hands that have let go of a thing and are not off it yet, which do
    not push it either.
    """
    felt: list[_Felt] = []
    sticks, free = frozenset(held), frozenset(let_go)
    names = sorted(posed)
    room = _Room(PrimitiveSet.join([s.fixed, s.loose(m.matrices(), m.position)]), s, m)
    for name in names:
        felt += _of_things(posed[name], room, sticks, free)
    for i, name in enumerate(names):
        for other in names[i + 1 :]:
            felt += _of_people(posed[name], posed[other], skin[name, other])
    out: list[HandForce] = []
    for hand in sorted({f.hand for f in felt}):
        wrist = posed[hand[0]].joints.position[HAND_JOINT[int(hand[1])]]
        out.append(_whole(hand, [f for f in felt if f.hand == hand], wrist))
    return tuple(h for h in out if h.touches)


def nothing(hand: Hand) -> HandForce:
    """What a hand feels that touches nothing."""
    return HandForce(hand[0], hand[1], np.zeros(3), np.zeros(3), ())


def _of_things(p: Posed, room: _Room, sticks: frozenset[Holding], free: frozenset[Holding]) -> list[_Felt]:
    mine = p.build.hands
    b = p.body
    hand = PrimitiveSet.of_cone_spheres(b.a[mine], b.b[mine], b.radius_a[mine], b.radius_b[mine])
    found = find_contacts(hand, room.primitives)
    if len(found) == 0:
        return []
    owner, side = room.owner[found.b], p.build.digit[mine[found.a]] // DIGITS
    out: list[_Felt] = []
    for right in (False, True):
        for n in np.unique(owner[side == int(right)]):
            body = room.solids.things[int(n)]
            if (p.name, right, body.id) in free:
                continue
            of = _contacts(found, (side == int(right)) & (owner == n))
            motion, speed = np.zeros((len(room.primitives), 9)), np.zeros((len(hand), 3))
            if (p.name, right, body.id) not in sticks:
                speed = p.velocity[mine]
                motion[:] = room.motion(int(n))
            rows = _feel(of, hand, room.primitives, FLESH_COMPLIANCE, body.compliance, speed, motion)
            out.append(_Felt((p.name, right), body.id, p.build.digit[mine[of.a]] % DIGITS, of.depth, rows))
    return out


def _of_people(p: Posed, q: Posed, found: ContactArray) -> list[_Felt]:
    digit_p, digit_q = p.build.digit[found.a], q.build.digit[found.b]
    of = _contacts(found, (digit_p >= 0) | (digit_q >= 0))
    if len(of) == 0:
        return []
    motion = np.concatenate([q.velocity, np.zeros((len(q.velocity), 6))], axis=1)
    rows = _feel(of, p.primitives, q.primitives, FLESH_COMPLIANCE, FLESH_COMPLIANCE, p.velocity, motion)
    mirrored = rows * np.array([-1.0] * 6 + [1.0] * 3 + [-1.0] * 3 + [1.0] * 4)
    out: list[_Felt] = []
    for who, other, digit, seen in ((p, q, p.build.digit[of.a], rows), (q, p, q.build.digit[of.b], mirrored)):
        for right in (False, True):
            chosen = (digit >= 0) & (digit // DIGITS == int(right))
            if chosen.any():
                out.append(_Felt((who.name, right), other.name, digit[chosen] % DIGITS, of.depth[chosen], seen[chosen]))
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
    touches: list[DigitTouch] = []
    force, torque = np.zeros(3), np.zeros(3)
    for f in felt:
        for digit in range(DIGITS):
            chosen = (f.digit == digit) & (f.rows[:, 12] > 0.0)
            if not chosen.any():
                continue
            r = f.rows[chosen]
            load = r[:, 12] * r[:, 14]
            total, normal = r[:, 0:3].sum(axis=0), (r[:, 13, None] * r[:, 9:12]).sum(axis=0)
            length, area = float(np.sqrt(normal @ normal)), float(r[:, 12].sum())
            force = force + total
            torque = torque + r[:, 3:6].sum(axis=0)
            touches.append(
                DigitTouch(
                    digit, f.body, (load[:, None] * r[:, 6:9]).sum(axis=0) / load.sum(),
                    normal / max(length, 1e-12), total, length, area, float(load.sum()) / area,
                    float(r[:, 15].max()), float(f.depth[chosen].max()),
                )
            )  # fmt: skip
    touches.sort(key=lambda t: (t.digit, t.body))
    return HandForce(hand[0], hand[1], force, torque - np.cross(wrist, force), tuple(touches))


def _contacts(c: ContactArray, chosen: NDArray[np.bool_]) -> ContactArray:
    """Some of the contacts, of those whose fields overlap."""
    rows = chosen & (c.field_depth > 0.0)
    return replace(
        c, a=c.a[rows], b=c.b[rows], point=np.ascontiguousarray(c.point[rows]),
        normal=np.ascontiguousarray(c.normal[rows]), depth=c.depth[rows],
        field_depth=np.ascontiguousarray(c.field_depth[rows]),
    )  # fmt: skip


def _arrays(s: PrimitiveSet) -> tuple[NDArray[np.int32], NDArray[np.int32], F64, F64, F64]:
    return s.kind, s.start, s.params, s.rotation, s.position

