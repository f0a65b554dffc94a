"""Forces of bonds on held things, loose things and hands.

A bond is a spring of no length between two points (`bonds.Glue`). A held thing moves to the balance of hand and bonds
(`sharing.balance`), so that it lags behind the hand until they tear. A loose thing gets the springs' impulses, implicitly
(they are stiff for so light things), before it is moved.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.dynamics.dynamics import ASLEEP, FREE, Motions
from vistel.space.dynamics.motion_kernels import GRAVITY
from vistel.space.dynamics.solids import Solids
from vistel.space.hands.grasp import into_hand
from vistel.space.holding.sharing import Pull, Spring
from vistel.space.memory.bonds import Bond, Frame, Glue, ends, glue_of
from vistel.space.people import DIGITS, Posed
from vistel.space.state import State

DAMPING = 0.4
"""Damping of a bond, as a share of twice the critical damping."""
WAKES = 0.02
"""A greater force of a bond wakes a sleeping thing [N]."""
ROUNDS = 4


@dataclass(frozen=True)
class BondForce:
    """One bond now: row of its thing, of the other thing (-1: a person's limb), its ends (3,) [m, room], glue, and force on the
    thing (3,) [N]; speed: of a limb (3,) [m/s]."""

    bond: Bond
    n: int
    other: int
    at_thing: F64
    at_body: F64
    glue: Glue
    force: F64
    speed: F64


def frame_of(state: State, posed: Mapping[str, Posed], body: str, primitive: int) -> Frame | None:
    """The frame of the joint that carries a person's primitive, or of a thing; None when it is not there."""
    p = posed.get(body)
    if p is not None:
        if primitive >= len(p.build.body):
            return None
        joint = int(p.build.body.joint[primitive])
        return p.joints.rotation[joint], p.joints.position[joint]
    if body not in state.rows:
        return None
    n = state.rows[body]
    return matrix_from_quaternion(state.motions.rotation[n]), state.motions.position[n]


def bond_forces(state: State, s: Solids, posed: Mapping[str, Posed]) -> list[BondForce]:
    """The forces of all holding bonds now."""
    out: list[BondForce] = []
    for b in state.bonds:
        if b.torn_ns or b.thing not in state.rows:
            continue
        frame, other = frame_of(state, posed, b.thing, 0), frame_of(state, posed, b.body, b.primitive)
        if frame is None or other is None:
            continue
        n = state.rows[b.thing]
        at_thing, at_body = ends(b, frame, other)
        glue = glue_of(s.things[n], float(s.radius[n]), b.reach)
        off = at_body - at_thing
        gap = math.sqrt(float(off @ off))
        force = off * (glue.force(gap, b.rest) / max(gap, 1e-9))
        p = posed.get(b.body)
        row, speed = (state.rows[b.body], np.zeros(3)) if p is None else (-1, p.velocity[b.primitive])
        out.append(BondForce(b, n, row, at_thing, at_body, glue, force, speed))
    return out


def anchors(drawn: list[BondForce], state: State, s: Solids) -> dict[str, list[Spring]]:
    """The anchors of each held thing: its bonds to things, and to people who do not hold it."""
    holders = {(g.thing, g.participant) for g in state.grasps}
    held = {g.thing for g in state.grasps}
    out: dict[str, list[Spring]] = {}
    for d in drawn:
        for thing, here, there, body in ((d.n, d.at_thing, d.at_body, d.bond.body), (d.other, d.at_body, d.at_thing, d.bond.thing)):
            if thing < 0 or s.things[thing].id not in held or (s.things[thing].id, body) in holders:
                continue
            off = there - here
            gap = math.sqrt(float(off @ off))
            q = matrix_from_quaternion(state.motions.rotation[thing])
            own = q.T @ (here - state.motions.position[thing])
            felt = there - off * (min(gap, d.bond.rest) / max(gap, 1e-9))
            out.setdefault(s.things[thing].id, []).append(Spring(own, felt, d.glue.stiffness))
    return out


def with_bond_impulses(m: Motions, s: Solids, drawn: list[BondForce], dt: float) -> Motions:
    """Motions with the bonds' impulses, before the things move by `dt` [s]."""
    out = m.copy()
    for d in drawn:
        for n in (d.n, d.other):
            if n >= 0 and out.mode[n] == ASLEEP and float(d.force @ d.force) > WAKES**2:
                out.mode[n], out.still[n] = FREE, 0
    some = [d for d in drawn if out.mode[d.n] == FREE or (d.other >= 0 and out.mode[d.other] == FREE)]
    if not some:
        return m
    done = np.zeros(len(some))
    for _ in range(ROUNDS):
        for k, d in enumerate(some):
            off = d.at_body - d.at_thing
            gap = math.sqrt(float(off @ off))
            if gap <= d.bond.rest or gap < 1e-6:
                continue
            way = off / gap
            falls = -GRAVITY * dt * float(way[1])  # what it will have gained when it has been moved
            give, speed = _side(out, s, d.n, d.at_thing, way, falls)
            more, other = _side(out, s, d.other, d.at_body, way, falls) if d.other >= 0 else (0.0, float(d.speed @ way))
            give, parting = give + more, other - speed
            if give <= 0.0:
                continue
            damping = 2.0 * DAMPING * math.sqrt(d.glue.stiffness / give)
            soft = 1.0 / (dt * (damping + dt * d.glue.stiffness))  # Catto, "Soft constraints", 2011
            wanted = parting + (gap - d.bond.rest) * dt * d.glue.stiffness * soft - soft * done[k]
            impulse = max(wanted / (give + soft), -done[k])
            done[k] += impulse
            for n, at, sign in ((d.n, d.at_thing, 1.0), (d.other, d.at_body, -1.0)):
                if n >= 0 and out.mode[n] == FREE:
                    out.velocity[n] += sign * impulse * s.inverse_mass[n] * way
                    out.spin[n] += _turned(out, s, n, sign * impulse * np.cross(at - out.position[n], way))
    return out


def _side(m: Motions, s: Solids, n: int, at: F64, way: F64, falls: float) -> tuple[float, float]:
    """How much faster an impulse of 1 N s along `way` at a point of thing n makes it go so [m/s], and how fast it does,
    with `falls` [m/s] if it is loose."""
    arm = at - m.position[n]
    speed = float((m.velocity[n] + np.cross(m.spin[n], arm)) @ way)
    if m.mode[n] != FREE:
        return 0.0, speed
    lever = np.cross(arm, way)
    return float(s.inverse_mass[n]) + float(lever @ _turned(m, s, n, lever)), speed + falls


def _turned(m: Motions, s: Solids, n: int, moment: F64) -> F64:
    r = matrix_from_quaternion(m.rotation[n])
    return r @ (s.inverse_inertia[n] @ (r.T @ moment))


def pulls(drawn: list[BondForce], state: State, posed: Mapping[str, Posed]) -> list[Pull]:
    """Pulls of bonds on hands, without bonds to the things that they hold."""
    held = {(g.participant, g.thing) for g in state.grasps}
    out: list[Pull] = []
    for d in drawn:
        p = posed.get(d.bond.body)
        if p is None or (p.name, d.bond.thing) in held or (digit := int(p.build.digit[d.bond.primitive])) < 0:
            continue
        out.append(Pull(p.name, digit >= DIGITS, d.bond.thing, d.at_body, -d.force, digit % DIGITS))
    return out


def regrasped(state: State, posed: Mapping[str, Posed], things: frozenset[str]) -> State:
    """Hands whose thing has just come off something bring it smoothly to its pose in the hand."""
    if not any(g.thing in things and g.participant in posed for g in state.grasps):
        return state
    m, out = state.motions, list(state.grasps)
    for i, g in enumerate(out):
        if g.thing in things and g.participant in posed:
            n = state.rows[g.thing]
            lie = into_hand(posed[g.participant], g.right, Pose(m.position[n], m.rotation[n]))
            out[i] = replace(g, start=lie, since_ns=state.t_ns)
    return state.but(grasps=tuple(out))
