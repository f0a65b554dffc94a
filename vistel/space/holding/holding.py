"""Hands take things, carry them and let go (Singh §6.6). Each function returns the state that follows."""

from collections import Counter
from collections.abc import Callable, Container, Mapping, Sequence, Set
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, rotvec_from_matrix
from vistel.implicit.contacts.contact import ContactArray, find_contacts
from vistel.space.dynamics.dynamics import FREE, HELD, Motions, wake_around
from vistel.space.dynamics.motion_kernels import MAX_SPEED, MAX_SPIN
from vistel.space.dynamics.solids import Solids
from vistel.space.hands import grasp as hands
from vistel.space.hands.approach import Approach, apertures, begun, went_on
from vistel.space.hands.grasp import Grasp
from vistel.space.hands.reach_kernels import BESIDE, HANDS, PAIRS
from vistel.space.holding import on_joints, sharing
from vistel.space.people import Posed
from vistel.space.state import LetGo, State

LET_GO_GAP = 0.015
"""A hand that let go pushes the thing again once it was this far off it [m]..."""
LET_GO_STEPS = 45
"""... or after so many steps."""
LATELY_NS = 100_000_000
"""A hand and a tracked thing are compared when both were measured within this long."""
REFIT_STEPS = 15
"""Every so many steps fingers may be laid on a tracked thing anew."""
PUSH_OUT = 0.05
"""Held things are kept out of the furniture by moving them this far at most [m]."""


NOTHING: Mapping[str, Sequence[sharing.Spring]] = MappingProxyType({})


def tracked_things(state: State) -> frozenset[str]:
    """Things that have a tracker of their own."""
    return frozenset(t.thing for t in state.tracked)


def woken_round(state: State, solids: Solids, n: int) -> State:
    """Things on or against thing n wake."""
    m = state.motions
    return state.but(motions=wake_around(solids, m, m.position[n], float(solids.radius[n])))


def holders(state: State, thing: str) -> tuple[str, ...]:
    """Participants who hold a thing, in the order in which they took it."""
    return tuple(dict.fromkeys(g.participant for g in state.grasps if g.thing == thing))


def drop(state: State, gone: Callable[[Grasp], bool]) -> State:
    """End grasps; a thing nobody holds any more falls."""
    dropped = [g for g in state.grasps if gone(g)]
    if not dropped:
        return state
    kept = tuple(g for g in state.grasps if not gone(g))
    m = state.motions.copy()
    tracked = tracked_things(state)
    for g in dropped:
        if g.thing not in tracked and not any(k.thing == g.thing for k in kept):
            n = state.rows[g.thing]
            m.mode[n], m.still[n] = FREE, 0
    ended = tuple(LetGo(g.participant, g.right, g.thing, state.step) for g in dropped)
    return state.but(grasps=kept, motions=m, let_go=state.let_go + ended)


def let_go(before: State, state: State, solids: Solids, posed: dict[str, Posed], near: dict[str, ContactArray], dt: float) -> State:
    """Hands that open or have slipped off let go; the others hold on. before: the state a step of `dt` [s] ago."""
    tracked = tracked_things(state)
    first = {g.thing: g.key for g in reversed(state.grasps) if g.thing not in tracked}
    followed: list[Grasp] = []
    for g in state.grasps:
        p = posed.get(g.participant)
        if p is None:
            followed.append(g)
            continue
        joining = _reach(state, solids, p, near[p.name], g) if state.t_ns - g.since_ns < hands.JOINING_NS else None
        followed.append(hands.follow(g, p, _at(state, solids, p, near[p.name], g) or _unsure(state, p, g), dt, joining))
    state = state.but(grasps=tuple(followed))
    strained = _strained(state)

    def over(g: Grasp) -> bool:
        p = posed.get(g.participant)
        patience = hands.PROP_SLIP_STEPS if g.thing in tracked else hands.SLIP_STEPS
        slipped = (g.key != first.get(g.thing) or on_joints.hangs(solids, g.thing)) and g.off > patience
        return p is None or slipped or g.key in strained or hands.opens(g)

    state = drop(state, over)
    had, has = Counter(g.thing for g in before.grasps), Counter(g.thing for g in state.grasps)
    grasps = list(state.grasps)
    for i, g in enumerate(grasps):
        n = state.rows[g.thing]
        p, thing, pose = posed[g.participant], solids.things[n], Pose(state.motions.position[n], state.motions.rotation[n])
        if g.thing in tracked:
            grasps[i] = hands.lies(g, p, pose)
            if state.step % REFIT_STEPS == 0:
                grasps[i] = hands.refitted(grasps[i], p, thing, solids.part(n))
        elif has[g.thing] < had[g.thing]:
            alone = has[g.thing] == 1 and not on_joints.hangs(solids, g.thing)
            grasps[i] = hands.restart(g, p, thing, solids.part(n), pose, state.t_ns, alone=alone)
        elif on_joints.hangs(solids, g.thing):
            grasps[i] = on_joints.slipped_round(solids, g, p, pose, state.t_ns)
    return state.but(grasps=tuple(grasps))


def _strained(state: State) -> set[tuple[str, bool]]:
    """Hands that lose a thing because others pull harder: for each thing the weakest hand, of equals the last."""
    out: dict[str, Grasp] = {}
    for g in state.grasps:
        weakest = out.get(g.thing)
        if g.strained > sharing.STRAINED_STEPS and (weakest is None or sharing.strength(g) <= sharing.strength(weakest)):
            out[g.thing] = g
    return {g.key for g in out.values()}


def _at(state: State, solids: Solids, p: Posed, near: ContactArray, g: Grasp) -> bool:
    """The hand is within reach of the thing it holds."""
    digit = p.build.digit[near.a] // 6
    owner = solids.owner[near.b]
    return bool(((digit == int(g.right)) & (owner == state.rows[g.thing]) & (p.build.digit[near.a] >= 0)).any())


def _reach(state: State, solids: Solids, p: Posed, near: ContactArray, g: Grasp) -> hands.Reach | None:
    """How what a hand holds lies between its digits; None: it is not near."""
    if g.pairs[HANDS] or not any(g.pairs[:BESIDE]):
        return None
    return next((r for r in hands.reaches(p, near, solids.owner, g.right) if r.thing == state.rows[g.thing]), None)


def _unsure(state: State, p: Posed, g: Grasp) -> bool:
    """Whether hand or tracked thing has no recent measurement, so that their distance is unknown."""
    measured = [t.measured.t_ns for t in state.tracked if t.thing == g.thing]
    return bool(measured) and state.t_ns - min(measured[0], p.figure.t_ns) > LATELY_NS


def carry(
    state: State, solids: Solids, posed: dict[str, Posed], dt: float, anchors: Mapping[str, Sequence[sharing.Spring]] = NOTHING
) -> State:
    """Held things follow their hand, or the balance of several hands, unless they have a tracker. anchors: points that sticky
    things are held to."""
    m = state.motions.copy()
    strained: dict[tuple[str, bool], int] = {}
    held = _holds(state, posed)
    # What hangs on a held thing goes where that has gone.
    for thing in sorted(held, key=lambda t: solids.joined.of_thing.get(t, -1)):
        n, holds = state.rows[thing], held[thing]
        back = anchors.get(thing, ())
        if len(holds) == 1 and not back:
            ((g, p),) = holds
            position, rotation = hands.out_of_hand(p, g.right, g.lie(state.t_ns))
        else:
            position, rotation = sharing.balance(holds, state.t_ns, back)
        if on_joints.hangs(solids, thing):
            position, rotation = on_joints.led(solids, m, thing, position, rotation, holds)
        else:
            position = position + out_of_furniture(solids, n, position, rotation)
        guide(m, n, position, rotation, dt)
        if len(holds) > 1 or back:
            for (g, _), pull in zip(holds, sharing.pulls(holds, position, rotation, state.t_ns), strict=True):
                much = float(np.sqrt(pull.force @ pull.force)) > sharing.strength(g)
                strained[g.key] = g.strained + 1 if much else 0
    grasps = tuple(replace(g, strained=strained[g.key]) if g.key in strained else g for g in state.grasps)
    return state.but(motions=m, grasps=grasps)


def pulled(state: State, posed: dict[str, Posed], sticking: Container[str] = ()) -> list[sharing.Pull]:
    """Pulls on hands that share a thing with others, or hold a thing that sticks to something."""
    m = state.motions
    out: list[sharing.Pull] = []
    for thing, holds in _holds(state, posed).items():
        if len(holds) > 1 or thing in sticking:
            n = state.rows[thing]
            out += sharing.pulls(holds, m.position[n], m.rotation[n], state.t_ns)
    return out


def _holds(state: State, posed: dict[str, Posed]) -> dict[str, list[tuple[Grasp, Posed]]]:
    """The hands at each thing that is led by hands."""
    tracked = tracked_things(state)
    out: dict[str, list[tuple[Grasp, Posed]]] = {}
    for g in state.grasps:
        if g.thing not in tracked and g.participant in posed:
            out.setdefault(g.thing, []).append((g, posed[g.participant]))
    return out


def out_of_furniture(solids: Solids, n: int, position: F64, rotation: F64) -> F64:
    """(3,) by which thing n must move not to stand in fixed things."""
    mine = solids.part(n).moved(matrix_from_quaternion(rotation), position)
    found = find_contacts(mine, solids.fixed)
    if len(found) == 0:
        return np.zeros(3)
    k = int(np.argmax(found.depth))
    return -found.normal[k] * min(PUSH_OUT, max(0.0, float(found.depth[k])))


def take_hold(state: State, solids: Solids, posed: dict[str, Posed], near: dict[str, ContactArray], dt: float) -> State:
    """Hands that close round a thing take it. dt: of the step [s]."""
    held = {g.key for g in state.grasps}
    held |= {(e.participant, e.right) for e in state.let_go if e.step == state.step}
    tracked = tracked_things(state)
    just_let_go = {(e.participant, e.right, e.thing) for e in state.let_go}
    before = {a.key: a for a in state.approaches}
    takes: list[tuple[float, str, bool, hands.Reach, NDArray[np.bool_]]] = []
    about: list[LetGo] = []
    approaches: list[Approach] = []
    for name in sorted(posed):
        p = posed[name]
        for right in (False, True):
            if (name, right) in held:
                continue
            reached = [r for r in hands.reaches(p, near[name], solids.owner, right) if not solids.things[r.thing].fixed]
            if not reached:
                continue
            apart = apertures(p, right)
            mine: list[tuple[float, str, bool, hands.Reach, NDArray[np.bool_]]] = []
            for r in reached:
                if (name, not right) in held:
                    r.play[HANDS] = hands.FAR  # that hand is busy
                thing = solids.things[r.thing].id
                old = before.get((name, right, thing)) or begun(name, right, thing, apart)
                new = went_on(old, apart, r.play, dt)
                approaches.append(new)
                known = (name, right, thing) in just_let_go
                if not known and thing not in tracked and r.around:
                    about.append(LetGo(name, right, thing, state.step))
                if (thing in tracked and not known and hands.encloses(p, right, r)) or hands.closes(r, new):
                    mine.append((r.nearest, name, right, r, hands.closing_pairs(r, new)))
            if mine:
                takes.append(min(mine, key=lambda t: (t[0], t[3].thing)))
    # The nearest hand comes first, and leads a thing that several hands take in one step.
    for _, name, right, chosen, pairs in sorted(takes, key=lambda t: t[:3]):
        state = grasped(state, solids, posed[name], right, chosen, pairs)
    taken = {(g.participant, g.right, g.thing) for g in state.grasps}
    busy = {key[:2] for key in taken}
    let_go = tuple(e for e in (*state.let_go, *about) if (e.participant, e.right, e.thing) not in taken)
    return state.but(let_go=let_go, approaches=tuple(a for a in approaches if a.key[:2] not in busy))


def grasped(state: State, solids: Solids, posed: Posed, right: bool, reach: hands.Reach, pairs: NDArray[np.bool_]) -> State:
    """The state after a hand has taken the thing it reaches, by some pairs of digits; by the thumb and all fingers if by none."""
    n, m = reach.thing, state.motions
    thing, pose = solids.things[n], Pose(m.position[n], m.rotation[n])
    led = thing.id not in tracked_things(state) and not holders(state, thing.id) and not on_joints.hangs(solids, thing.id)
    if not pairs.any():
        pairs = np.arange(PAIRS) < BESIDE
    new = hands.take(posed, right, thing, solids.part(n), pose, reach, pairs, state.t_ns, led)
    state = woken_round(state, solids, n)
    m = state.motions.copy()
    m.mode[n], m.still[n] = HELD, 0
    return state.but(motions=m, grasps=(*state.grasps, new), glides=tuple(g for g in state.glides if g.thing != new.thing))


def glide(state: State, solids: Solids, dt: float) -> State:
    """Things that commands have set in motion go on their way, and are free at its end."""
    if not state.glides:
        return state
    tracked = tracked_things(state)
    m = state.motions.copy()
    for g in state.glides:
        if g.thing not in tracked:
            n = state.rows[g.thing]
            guide(m, n, *on_joints.led(solids, m, g.thing, *g.at(state.step)), dt)
            m.mode[n], m.still[n] = HELD, 0
    state = state.but(motions=m)
    return glides_ended(state, {g.thing for g in state.glides if g.over(state.step) or g.thing in tracked})


def glides_ended(state: State, things: Set[str]) -> State:
    """Some things are on their way no longer: they stand still and are free."""
    if not things:
        return state
    tracked = tracked_things(state)
    m = state.motions.copy()
    for g in state.glides:
        if g.thing in things and g.thing not in tracked:
            n = state.rows[g.thing]
            m.velocity[n], m.spin[n], m.mode[n], m.still[n] = 0.0, 0.0, FREE, 0
    return state.but(motions=m, glides=tuple(g for g in state.glides if g.thing not in things))


def forget_let_go(state: State, solids: Solids, near: dict[str, ContactArray], posed: dict[str, Posed]) -> State:
    """A hand and the thing it let go push each other again once they were apart, or after a while."""

    def still(entry: LetGo) -> bool:
        if entry.thing not in state.rows or state.step - entry.step > LET_GO_STEPS:
            return False
        p = posed.get(entry.participant)
        if p is None:
            return False
        c = near[p.name]
        mine = (p.build.digit[c.a] // 6 == int(entry.right)) & (p.build.digit[c.a] >= 0)
        return bool((mine & (solids.owner[c.b] == state.rows[entry.thing]) & (c.depth > -LET_GO_GAP)).any())

    return state.but(let_go=tuple(e for e in state.let_go if still(e)))


def guide(m: Motions, n: int, position: F64, rotation: F64, dt: float) -> None:
    """Moves thing n to a pose within a step of dt [s]: `m` is changed."""
    turn = matrix_from_quaternion(rotation) @ matrix_from_quaternion(m.rotation[n]).T
    velocity = (position - m.position[n]) / dt
    spin = rotvec_from_matrix(np.ascontiguousarray(turn)) / dt
    # Half of the last value: trackers tremble, and a throw should not.
    m.velocity[n] = 0.5 * m.velocity[n] + 0.5 * _limited(velocity, MAX_SPEED)
    m.spin[n] = 0.5 * m.spin[n] + 0.5 * _limited(spin, MAX_SPIN)
    m.position[n], m.rotation[n] = position, rotation


def _limited(v: F64, most: float) -> F64:
    length = float(np.sqrt(v @ v))
    return v * (most / length) if length > most else v
