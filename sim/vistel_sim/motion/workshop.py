"""The script of a session with things on joints: somebody opens a lid, pulls a drawer and presses a button; the others watch.

One cycle of it: each hand takes what hangs on its side by its handle, leads it along its joint and back, and lets go; then a
forefinger presses the button twice.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.hands import OPEN, POINT, hand_rotation
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec
from vistel.space.joints.joined import Joined, joined
from vistel.space.joints.joint import Joint
from vistel.space.things.things import Thing, identity
from vistel_sim.motion.clay import fingertip
from vistel_sim.motion.layout import Layout
from vistel_sim.motion.script import SIDES, UP, Hand, Script
from vistel_sim.motion.sitter import Sitter
from vistel_sim.motion.source import MotionError
from vistel_sim.motion.tracks import HandTrack

OPENED = math.radians(45.0)
"""How far a lid is opened [rad]."""
PULLED = 0.12
"""How far a drawer is pulled [m]."""
FOLLOWS = 0.5
"""Share of a lid's turn with which the wrist turns."""
LEG = 3
"""A lid's way is cut into so many straight moves of the hand."""
ABOVE = 0.090
"""From where the open hand comes down on a handle [m]..."""
BEFORE = 0.13
"""... and how far before that it passes, clear of what stands over the handle [m]."""
BACK = 0.05
"""How much nearer to the body than usual the hands rest, clear of what stands on the bench [m]."""
PRESS = 0.010
"""How deep a button is pressed [m]."""
WITHIN = 0.75
"""Things further from the seat than this are left alone [m]."""
BEGINS = 0.9, 7.2
"""When the first and the second handle are reached for [s]."""
PRESSES = 14.2, 15.8
"""When the finger is above the button [s]."""


def write_workshop(sitters: Mapping[str, Sitter], layout: Layout) -> Script:
    """The script for the people present; who sits nearest to the first handle works. Raises MotionError where nothing has one."""
    room = layout.room
    on_joints = joined(room.joints, room.things)
    handles = [j for j in on_joints.joints if room.by_id[j.thing].axes]
    buttons = [j for j in on_joints.joints if j.button is not None]
    if not handles and not buttons:
        raise MotionError("workshop: needs a room with things on joints that have handles or are buttons (rooms/workshop.usdz)")
    desk = {(name, side): Hand(s, side, layout) for name, s in sitters.items() for side in SIDES}
    first = room.by_id[(handles or buttons)[0].thing].position
    worker = min(sitters.values(), key=lambda s: (float(np.hypot(*(s.person.seat_position - first)[[0, 2]])), s.person.name))
    for side in SIDES:
        hand = desk[worker.person.name, side]
        hand.rest_at(hand.home[0] - BACK * worker.direction_in_room(np.array([0.0, 0.0, 1.0])))
    looks: list[tuple[float, float, str]] = []
    points: dict[str, F64] = {}
    near = [j for j in handles if _distance(worker, room.by_id[j.thing]) < WITHIN]
    for begins, j in zip(BEGINS, near, strict=False):
        ends = _lead(desk[worker.person.name, _side(worker, room.by_id[j.thing])], on_joints, j, room.things, begins)
        points[j.thing] = room.by_id[j.thing].position
        looks.append((begins - 0.2, ends, f"point:{j.thing}"))
    for j in buttons[:1]:
        thing = room.by_id[j.thing]
        ends = _press(desk[worker.person.name, "right"], worker, on_joints, j, room.things)
        points[j.thing] = thing.position
        looks.append((PRESSES[0] - 0.6, ends, f"point:{j.thing}"))
    tracks = {key: HandTrack(hand.keys) for key, hand in desk.items()}
    return Script(tracks, (), (np.zeros(3), identity()), {}, points, dict.fromkeys(sitters, looks))


def _distance(worker: Sitter, thing: Thing) -> float:
    return float(np.hypot(*(worker.person.seat_position - thing.position)[[0, 2]]))


def _side(worker: Sitter, thing: Thing) -> str:
    return "left" if worker.into_seat(thing.position)[0] > 0.0 else "right"


def _lead(hand: Hand, on_joints: Joined, j: Joint, things: Sequence[Thing], begins: float) -> float:
    """Take a thing by its handle from above, lead it along its joint and back. Gives when that is over [s]."""
    k = on_joints.of_thing[j.thing]
    hinged = not on_joints.slides(k)
    most = min(j.upper, OPENED if hinged else PULLED)
    thing = next(t for t in things if t.id == j.thing)
    axis = thing.axes[0]
    position, rotation = np.array([t.position for t in things]), np.array([t.rotation for t in things])
    fist = hand.closed(axis.radius)
    ahead = hand.sitter.direction_in_room(np.array([0.0, 0.0, 1.0]))
    down = hand_rotation(hand.sign, ahead, -UP)

    def at(share: float) -> tuple[F64, F64]:
        """Wrist and rotation of the hand with the thing so far along its joint."""
        p, q = on_joints.posed(k, share * most, position, rotation)
        turn = np.eye(3)
        if hinged:
            about = matrix_from_quaternion(thing.rotation) @ j.on_thing.matrix[:, 0]
            turn = matrix_from_rotvec(np.ascontiguousarray(FOLLOWS * share * most * about))
        wrist = np.ascontiguousarray(turn @ down)
        return hand.wrist_for(p + matrix_from_quaternion(q) @ axis.point, wrist), wrist

    take, flat = at(0.0)
    above = take + ABOVE * UP
    before = above - BEFORE * ahead
    t = begins
    hand.leave(t)
    hand.hold(t + 0.9, before, flat, OPEN, 0.02)
    hand.hold(t + 1.3, above, flat, OPEN)
    hand.hold(t + 1.7, take, flat, OPEN)
    hand.hold(t + 2.1, take, flat, fist)
    hand.hold(t + 2.2, take, flat, fist)
    t += 2.2
    legs = LEG if hinged else 1
    shares = [(n + 1) / legs for n in range(legs)]
    for share in [*shares, 1.0, *reversed([0.0, *shares[:-1]])]:
        t += 1.2 / legs
        hand.hold(t, *at(share), fist)
    hand.hold(t + 0.4, take, flat, OPEN)
    hand.hold(t + 0.8, above, flat, OPEN)
    hand.hold(t + 1.2, before, flat, OPEN)
    hand.rest(t + 2.0)
    return t + 1.2


def _press(hand: Hand, worker: Sitter, on_joints: Joined, j: Joint, things: Sequence[Thing]) -> float:
    """Press a button twice with the forefinger. Gives when that is over [s]."""
    thing = next(t for t in things if t.id == j.thing)
    out = matrix_from_quaternion(thing.rotation) @ j.on_thing.matrix[:, 0]
    ahead = worker.direction_in_room(np.array([0.0, 0.0, 1.0]))
    steep = hand_rotation(hand.sign, 0.35 * ahead - UP, -ahead - 0.35 * UP)
    n = on_joints.ends[on_joints.of_thing[j.thing], 1]
    top = thing.position + _high(things[n]) * out
    on_it = top - steep @ fingertip(worker.person.skeleton)
    hand.leave(PRESSES[0] - 1.3)
    for t in PRESSES:
        hand.hold(t, on_it + 0.05 * UP, steep, POINT, 0.03)
        hand.hold(t + 0.5, on_it - PRESS * out, steep, POINT)
        hand.hold(t + 0.7, on_it - PRESS * out, steep, POINT)
        hand.hold(t + 1.2, on_it + 0.05 * UP, steep, POINT)
    hand.rest(PRESSES[-1] + 2.2)
    return PRESSES[-1] + 1.2


def _high(thing: Thing) -> float:
    """From a button's middle to its top [m]."""
    return max(p.params[2] if p.kind == "superellipsoid" else max(p.params) for p in thing.primitives)
