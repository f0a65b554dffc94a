"""The script of a session with a soft thing: somebody presses, pokes and squeezes it; the others watch.

One cycle of it: the palm on its top, the forefinger into it twice, both palms on its ends.
"""

from collections.abc import Mapping

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.hands import FLAT, OPEN, POINT, PRESSED, hand_rotation
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.figure.skeleton import JOINT_INDEX, Skeleton
from vistel.space.room import Extra
from vistel.space.things.things import identity
from vistel_sim.motion.layout import Layout
from vistel_sim.motion.script import SIDES, UP, Hand, Script
from vistel_sim.motion.sitter import Sitter
from vistel_sim.motion.tracks import HandTrack

PALM_BELOW = 0.010
"""Height of the palm's skin above the grip point [m]."""
ASIDE = 0.07
"""By how much further apart the hands rest, clear of the thing [m]."""
LENGTH = {"ball": 1.0, "lump": 2.0, "bar": 6.0}
"""Half lengths of things, in radii."""


def write_clay(sitters: Mapping[str, Sitter], layout: Layout, thing: Extra) -> Script:
    """The script for the people present; who sits nearest to the thing works on it."""
    lies = layout.thing(thing.id)
    place = lies.position if lies is not None else thing.thing().position
    desk = {(name, side): Hand(s, side, layout) for name, s in sitters.items() for side in SIDES}
    worker = min(sitters.values(), key=lambda s: (float(np.linalg.norm(s.person.seat_position - place * (1, 0, 1))), s.person.name))
    left, right = desk[worker.person.name, "left"], desk[worker.person.name, "right"]
    ahead = worker.direction_in_room(np.array([0.0, 0.0, 1.0]))

    across = np.array([1.0, 0.0, 0.0])
    if float(across @ np.cross(UP, ahead)) < 0.0:
        across = -across  # from the worker's right to their left
    left.rest_at(left.home[0] + ASIDE * across)
    right.rest_at(right.home[0] - ASIDE * across)

    down = hand_rotation(SIDES["right"], ahead, -UP)
    top = place + thing.size * UP
    lain = right.wrist_for(top - PALM_BELOW * UP - 0.02 * ahead, down)
    deep = min(0.4 * thing.size, 0.018)
    right.leave(0.9)
    right.hold(2.2, lain + 0.09 * UP, down, OPEN, 0.06)
    right.hold(2.9, lain - deep * UP, down, FLAT)
    right.hold(3.5, lain - deep * UP, down, FLAT)
    right.hold(4.2, lain + 0.10 * UP, down, OPEN)

    steep = hand_rotation(SIDES["right"], 0.35 * ahead - UP, -ahead - 0.35 * UP)
    tip = fingertip(worker.person.skeleton)
    for t, aside in ((5.6, -0.6), (7.6, 0.5)):
        target = top + aside * thing.size * np.cross(UP, ahead)
        poke = target - steep @ tip
        right.hold(t, poke + 0.06 * UP, steep, POINT)
        right.hold(t + 0.5, poke - deep * UP, steep, POINT)
        right.hold(t + 0.8, poke - deep * UP, steep, POINT)
        right.hold(t + 1.3, poke + 0.06 * UP, steep, POINT)

    end = LENGTH[thing.shape] * thing.size
    left.leave(8.6)
    for hand, out in ((left, across), (right, -across)):
        flat = hand_rotation(hand.sign, ahead + 0.3 * UP, -out)
        at = hand.wrist_for(place + (end - PALM_BELOW) * out + 0.01 * UP, flat)
        hand.hold(10.4, at + 0.08 * out, flat, PRESSED, 0.03)
        hand.hold(11.2, at - 0.7 * deep * out, flat, PRESSED)
        hand.hold(11.9, at - 0.7 * deep * out, flat, PRESSED)
        hand.hold(12.6, at + 0.08 * out, flat, PRESSED)
        hand.rest(13.9)

    looks = {name: [(1.0, 13.0, "point:clay")] for name in sitters}
    tracks = {key: HandTrack(hand.keys) for key, hand in desk.items()}
    return Script(tracks, (), (place, identity()), {}, {"clay": top}, looks)


def fingertip(skeleton: Skeleton) -> F64:
    """(3,) tip of a pointing right forefinger, in the hand's frame [m]."""
    pose = pose_joints(skeleton, Posture(Posture().dofs, np.stack([POINT, POINT])))
    hand, last = JOINT_INDEX["right_hand"], JOINT_INDEX["right_index_distal"]
    tip = pose.position[last] + pose.rotation[last] @ skeleton.tip[last]
    return pose.rotation[hand].T @ (tip - pose.position[hand])
