"""Simulated hands that take things: of any size, in six ways, with the errors of devices; and hands that take nothing.

The truth comes from the true hand, of a person of their own size: each digit closes along its way with the least jerk until it
meets the thing, and goes on by what nothing real stops. The hand takes hold in the frame in which the second of two opposed sides
touches, and is off when only one does. The world is given what is measured of that hand (`errors`), on a body of the size that the
system believes.
"""

import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from benchmarks.grasping.errors import Errors, measured
from benchmarks.grasping.grips import ENGAGED, KINDS, Grip, bent, grip_of, until
from benchmarks.grasping.things import Things
from benchmarks.grasping.trials import LATE, RATE_HZ, Trial
from vistel.arrays import F64
from vistel.figure.posture.channel import minimum_jerk
from vistel.figure.posture.hands import hand_rotation
from vistel.figure.posture.posture import WRIST, Posture, Stance, pose_joints, standing
from vistel.figure.posture.reach import reach
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_quaternion, rotvec_from_matrix
from vistel.space.dynamics.solids import solids
from vistel.space.hands.fitting import hand_of
from vistel.space.people import HAND_JOINT, Build, build_of
from vistel.space.things.things import Thing

HEIGHTS = tuple(float(h) for h in np.linspace(1.45, 2.05, 10))
"""People of ten sizes [m]: hands of 83 to 117 % of the average."""
HIGH, LIFT = 0.15, 0.2
"""A hand comes from so high, and goes up by so much with what it took [m]."""
SHOULDERS = 1.1
"""Height of the shoulders of who takes a thing with two hands [m]."""


def true_trials(things: Things, errors: Errors, each: int, seed: int, kinds: Sequence[str] = KINDS) -> Iterator[Trial]:
    """Each kind of grasp by hands of each size, `each` times."""
    for number, kind in enumerate(kinds):
        for size, height in enumerate(HEIGHTS):
            for k in range(each):
                rng = np.random.default_rng((seed, KINDS.index(kind), size, k))
                yield (_both if kind == "two hands" else partial(_one, kind=kind))(
                    things, height, errors, rng, name=f"{kind} {number}.{size}.{k}"
                )


def false_trials(things: Things, errors: Errors, each: int, seed: int) -> Iterator[Trial]:
    """Hands of each size that close beside and over things, stay open round them, begin to close and think better of it, are fists,
    lie on them, point at them, push them and sweep past; and two hands that close beside a thing, or stop before it."""
    for number, way in enumerate(FALSE):
        for size, height in enumerate(HEIGHTS):
            for k in range(each):
                rng = np.random.default_rng((seed, 100 + number, size, k))
                name = f"{way} {size}.{k}"
                if way in ("two beside", "two stop", "one of two"):
                    yield _both(things, height, errors, rng, name=name, way=way)
                else:
                    kind = str(rng.choice([*KINDS[:3]] if way in ("fist", "rest", "poke", "push", "sweep") else [*KINDS[:5]]))
                    yield _one(things, height, errors, rng, kind=kind, name=name, way=way)


FALSE = ("beside", "over", "hover", "waver", "fist", "rest", "poke", "push", "sweep", "two beside", "two stop", "one of two")


def _one(things: Things, height: float, errors: Errors, rng: np.random.Generator, *, kind: str, name: str, way: str = "") -> Trial:
    """One hand: takes hold, or does what `way` says instead."""
    build = build_of(height, 1.0)
    heading = float(rng.uniform(-0.35, 0.35))
    ahead = np.array([math.sin(heading), 0.0, math.cos(heading)])
    tilt = float(rng.uniform(-0.3, 0.3))
    palm = math.cos(tilt) * np.array([0.0, -1.0, 0.0]) + math.sin(tilt) * np.cross(ahead, np.array([0.0, 1.0, 0.0]))
    hand_turn = hand_rotation(-1.0, ahead, palm)
    grip = grip_of(things, kind, hand_turn, hand_of(build, True), rng, 0.0 if way == "waver" or kind == "lateral" else 0.6)
    fingers, way_up, marks = _motion(grip, kind, rng, way, ahead)
    place = grip.thing.position - hand_turn @ grip.place + way_up
    seen, at = measured(fingers, place, errors, rng)
    believed = build_of(float(height * (1.0 + rng.normal(0.0, errors.size))), 1.0)
    postures = tuple(_placed(believed, hand_turn, x, f, heading) for x, f in zip(at, seen, strict=True))
    closes, eases, opens = marks if not way else (None, None, None)
    begins = None if closes is None else closes - LATE
    return Trial(name, way or kind, grip.thing.id, postures, believed.skeleton.height, begins, closes, eases, opens, (grip.thing,))


def _motion(
    grip: Grip, kind: str, rng: np.random.Generator, way: str, ahead: F64
) -> tuple[F64, F64, tuple[int | None, int | None, int | None]]:
    """Fingers (n, 20), the hand's way (n, 3) from where it takes hold, and the frames in which it does, opens and is off."""
    come, close, hold, ease = (float(rng.uniform(*r)) for r in ((0.4, 0.8), (0.25, 0.7), (0.9, 1.4), (0.2, 0.45)))
    early = float(rng.uniform(-0.1, 0.25))
    begins = come - early * close
    n = round((come + close + hold + ease + 0.5) * RATE_HZ)
    t = np.arange(n) / RATE_HZ
    further = np.full(5, float(rng.uniform(0.04, 0.25)))
    goal = np.where(np.isfinite(grip.touch), grip.touch, 0.9) + further
    goal = np.where(np.isin(np.arange(5), ENGAGED[kind]), goal, np.where(np.isfinite(grip.touch) & (kind == "power"), goal, 0.3))
    delay = rng.uniform(0.0, 0.06, 5)
    u = np.array([[minimum_jerk((s - begins - delay[d]) / close) for d in range(5)] for s in t]) * goal
    shut = u >= np.where(np.isfinite(grip.touch), grip.touch, np.inf)
    taken = np.flatnonzero(_opposed(shut, kind))
    closes = int(taken[0])
    opening = begins + close + hold
    back = np.array([1.0 - 0.95 * minimum_jerk((s - opening) / ease) for s in t])
    u = u * back[:, None]
    shut = u >= np.where(np.isfinite(grip.touch), grip.touch, np.inf)
    opens = closes + int(np.flatnonzero(~_opposed(shut[closes:], kind))[0])
    eases = int(opening * RATE_HZ)
    up = np.array([HIGH * (1.0 - minimum_jerk(s / come)) for s in t])
    rises = closes / RATE_HZ + LATE / RATE_HZ
    lift = np.array([LIFT * minimum_jerk((s - rises) / 0.6) for s in t])
    path = np.zeros((n, 3))
    path[:, 1] = up + lift
    if way:
        u, path = _instead(way, grip, rng, u, up, path, t, ahead)
        return (
            np.array([bent(grip.opened, _curled(way, grip, rng) if way in _HANDS else grip.closed, row) for row in u]),
            path,
            (None,) * 3,
        )
    return np.array([bent(grip.opened, grip.closed, row) for row in u]), path, (closes, eases, opens)


def _opposed(shut: F64, kind: str) -> F64:
    """(n,) whether two opposed sides of a thing are touched. shut: (n, 5) the digits that touch."""
    fingers = shut[:, 1:].sum(axis=1)
    if kind == "lateral":
        return shut[:, 0]
    if kind == "scissor":
        return shut[:, 1] & shut[:, 2]
    return shut[:, 0] & (fingers >= (1 if kind == "pinch" else 2))


_HANDS = ("fist", "rest", "poke", "push")
"""Ways of hands that are shaped otherwise than those that take."""


def _curled(way: str, grip: Grip, rng: np.random.Generator) -> F64:
    """(20,) the fingers of a fist, of a hand at rest, of one that points or pushes."""
    bend = {"fist": (85.0, 95.0, 60.0), "rest": (22.0, 24.0, 12.0), "poke": (80.0, 90.0, 60.0), "push": (6.0, 8.0, 4.0)}[way]
    out = np.zeros(20)
    for f in range(4):
        out[4 + 4 * f : 8 + 4 * f] = np.radians([bend[0], 0.0, bend[1], bend[2]])
    if way == "poke":
        out[4:8] = np.radians([5.0, 0.0, 8.0, 5.0])
    out[:4] = np.radians({"fist": [85.0, 15.0, 40.0, 40.0], "poke": [80.0, 20.0, 35.0, 35.0]}.get(way, [35.0, 40.0, 0.0, 0.0]))
    return out


def _instead(way: str, grip: Grip, rng: np.random.Generator, u: F64, up: F64, path: F64, t: F64, ahead: F64) -> tuple[F64, F64]:
    """How far the digits close, and the hand's way, of a hand that takes nothing."""
    aside = np.cross(np.array([0.0, 1.0, 0.0]), ahead)
    side = float(rng.choice([-1.0, 1.0]))
    if way == "beside":
        path = path + aside * side * (0.09 + _half(grip.thing)) + np.array([0.0, 0.02, 0.0])
    elif way == "over":
        path = path + np.array([0.0, float(rng.uniform(0.10, 0.13)), 0.0])
    elif way == "hover":
        u = u * 0.0
        path[:, 1] = up
    elif way == "waver":
        u = 0.4 * u
        path[:, 1] = up
    elif way == "sweep":
        speed, start = float(rng.uniform(0.4, 1.0)), -0.25
        u = np.full_like(u, 0.1)
        path = np.outer(start + speed * t, side * aside) + np.array([0.0, 0.01, 0.0])
    else:
        u = np.ones_like(u)
        path[:, 1] = up + _lying(grip, _curled(way, grip, rng))
        if way == "poke":
            path = path + np.outer(0.01 * np.sin(4.0 * t), ahead)
        elif way == "push":
            low = -0.02 - _half(grip.thing)
            path = np.outer(-0.22 + 0.12 * t, aside * side) + np.array([0.0, low, 0.0])
    return u, path


def _lying(grip: Grip, fingers: F64) -> float:
    """How much higher than when it takes a hand lies on its thing [m]."""
    down = grip.rotation @ matrix_from_quaternion(grip.thing.rotation).T @ np.array([0.0, -1.0, 0.0])  # in the hand's frame
    part, low, high = solids((grip.thing,)).part(0), -0.05, 0.15
    for _ in range(14):
        middle = 0.5 * (low + high)
        deep = float(grip.hand.depths(fingers, part.moved(grip.rotation, grip.place + middle * down))[0].max()) > 0.001
        low, high = (middle, high) if deep else (low, middle)
    return high


def _half(thing: Thing) -> float:
    """How far a thing reaches from its middle [m]."""
    return float(solids((thing,)).radius[0])


def _placed(build: Build, turn: F64, place: F64, fingers: F64, heading: float) -> Posture:
    """Somebody whose right hand joint is at `place` (3,) [m, room], turned by `turn`; the feet stand where it comes right."""
    dofs = standing().dofs.copy()
    forearm = pose_joints(build.skeleton, Posture(dofs, stance=Stance(np.zeros(3), heading))).rotation[
        JOINT_INDEX["right_lower_arm"]
    ]
    dofs[WRIST["right"]] = rotvec_from_matrix(np.ascontiguousarray(forearm.T @ turn))
    hands = np.zeros((2, 20))
    hands[1] = fingers
    pose = pose_joints(build.skeleton, Posture(dofs, hands, Stance(np.zeros(3), heading)))
    return Posture(dofs, hands, Stance(place - pose.position[HAND_JOINT[1]], heading))


# -- two hands ---------------------------------------------------------------------------------------------------


def _both(things: Things, height: float, errors: Errors, rng: np.random.Generator, *, name: str, way: str = "") -> Trial:
    """Flat hands that come from both sides, press, lift and part; or stop before the thing, close beside it, or only one comes."""
    build = build_of(height, 1.0)
    thing = things.large[int(rng.integers(len(things.large)))](rng)
    part = solids((thing,)).part(0)
    fingers = np.zeros(20)
    bend = float(rng.uniform(2.0, 18.0))
    for f in range(4):
        fingers[4 + 4 * f : 8 + 4 * f] = np.radians([bend, (5.0, 0.0, -4.0, -8.0)[f], bend, 0.5 * bend])
    fingers[:4] = np.radians([20.0, 25.0, -5.0, -5.0])
    hand, turn = hand_of(build, True), hand_rotation(-1.0, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    drop = float(rng.uniform(-0.01, 0.02))
    start = -turn.T @ np.array([0.0, drop, 0.0]) + np.array([-0.09 * height / 1.75, 0.0, 0.0])
    gap = until(
        hand,
        fingers,
        part,
        turn.T @ matrix_from_quaternion(thing.rotation),
        start,
        np.array([0.0, -1.0, 0.0]),
        0.0,
        hand.digit >= 0,
    )
    assert gap is not None
    touch = thing.position - turn @ gap  # the right hand joint as it touches
    come, squeeze, hold, ease = (float(rng.uniform(*r)) for r in ((0.5, 0.9), (0.004, 0.02), (1.1, 1.5), (0.3, 0.5)))
    n = round((come + hold + ease + 0.7) * RATE_HZ)
    t = np.arange(n) / RATE_HZ
    away = 0.10
    inward = np.array([(away + squeeze) * minimum_jerk(s / come) - away for s in t])
    inward = inward - np.array([0.12 * minimum_jerk((s - come - hold) / ease) for s in t])
    closes = int(np.flatnonzero(inward >= 0.0)[0])
    opens = closes + int(np.flatnonzero(inward[closes:] < 0.0)[0])
    eases = int((come + hold) * RATE_HZ)
    rises = closes / RATE_HZ + LATE / RATE_HZ
    up = np.array([LIFT * minimum_jerk((s - rises) / 0.6) for s in t])
    shift = np.zeros(3)
    if way == "two stop":
        inward = np.minimum(inward, -0.035)
    elif way == "two beside":
        shift = np.array([0.0, 0.05 + 2.0 * _half(thing), 0.0])
    mine = np.stack([touch[0] + inward, touch[1] + up, np.full(n, touch[2])], 1) + shift
    centre = thing.position[0]
    other = mine * np.array([-1.0, 1.0, 1.0]) + np.array([2.0 * centre, 0.0, 0.0])
    if way == "one of two":
        other[:, 0] += 0.3
    right, place = measured(np.repeat(fingers[None], n, axis=0), mine, errors, rng)
    left, place_left = measured(np.repeat(fingers[None], n, axis=0), other, errors, rng)
    believed = build_of(float(height * (1.0 + rng.normal(0.0, errors.size))), 1.0)
    # As people sit: their shoulders at one height above the table, whatever their own.
    stance = Stance(np.array([centre, SHOULDERS - 0.82 * height, thing.position[2] - 0.27 * height / 1.75]), 0.0)
    postures = tuple(_reached(believed, stance, (place_left[k], place[k]), np.stack([left[k], right[k]])) for k in range(n))
    marks = (closes - LATE, closes, eases, opens) if not way else (None,) * 4
    return Trial(name, way or "two hands", thing.id, postures, believed.skeleton.height, *marks, (thing,))


def _reached(build: Build, stance: Stance, places: tuple[F64, F64], fingers: F64) -> Posture:
    """Somebody whose left and right hand joints are at two places [m, room], their palms towards each other."""
    posture = Posture(standing().dofs, fingers, stance)
    for row, side in enumerate(("left", "right")):
        sign = 1.0 - 2.0 * row
        turn = hand_rotation(sign, np.array([0.0, 0.0, 1.0]), np.array([-sign, 0.0, 0.0]))
        posture = reach(build.skeleton, posture, side, places[row], turn, np.array([0.5 * sign, -1.0, 0.0]))
    return posture
