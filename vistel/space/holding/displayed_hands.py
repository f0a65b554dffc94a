"""Holding hands as they are displayed: with their fingers on the thing, not as the real person's empty hand has them.

A hand cannot always move its thing: others may hold it too, it may follow its own tracker, or stand against furniture.
The hand is then displayed at the thing, as a god-object is in haptics.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, rotvec_from_matrix
from vistel.implicit.contacts.contact import ContactArray, find_contacts
from vistel.space.dynamics.solids import Solids
from vistel.space.hands.fitting import hand_of
from vistel.space.hands.grasp import Grasp, hand_frame
from vistel.space.people import DIGITS, Posed
from vistel.space.state import State

FURTHEST = 0.06
"""A hand is drawn no further than this from where the real one is [m]."""
MOST_TURN = 0.7
"""A hand is drawn turned no further than this from the real one [rad]."""


def displayed_contacts(
    state: State, solids: Solids, posed: Mapping[str, Posed], near: Mapping[str, ContactArray]
) -> Mapping[str, ContactArray]:
    """The contacts of figures with loose things. Hands that hold a thing count as they are displayed."""
    if not state.grasps:
        return near
    out = dict(near)
    for g in state.grasps:
        if g.participant in out and g.participant in posed:
            out[g.participant] = _with_hand(state, solids, posed[g.participant], out[g.participant], g)
    return out


def displayed_fingers(grasp: Grasp, own: F64, t_ns: int) -> F64:
    """(20,) angles of the hand that holds; own: those of the person's glove."""
    return own + grasp.settled(t_ns) * (grasp.fingers - own)


def displayed_hand(own: tuple[F64, F64], thing: Pose, lies: Pose) -> tuple[F64, F64]:
    """Rotation (3, 3) and position (3,) [m] of a displayed hand joint, in which `thing` (room) has the pose `lies`.

    own: the real hand's; the result differs from it by at most FURTHEST and MOST_TURN.
    """
    turn = thing.matrix @ lies.matrix.T
    place = thing.position - turn @ lies.position
    off, way = place - own[1], rotvec_from_matrix(np.ascontiguousarray(turn @ own[0].T))
    far = max(float(np.sqrt(off @ off)) / FURTHEST, float(np.sqrt(way @ way)) / MOST_TURN)
    if far <= 1.0:
        return turn, place
    return matrix_from_rotvec(way / far) @ own[0], own[1] + off / far


def _with_hand(state: State, solids: Solids, p: Posed, near: ContactArray, g: Grasp) -> ContactArray:
    assert p.figure.posture is not None
    n, m, row = state.rows[g.thing], state.motions, int(g.right)
    hand = hand_of(p.build, g.right)
    fingers = displayed_fingers(g, p.figure.posture.hands[row], state.t_ns)
    shown = hand.placed(fingers).moved(
        *displayed_hand(hand_frame(p, g.right), Pose(m.position[n], m.rotation[n]), g.seen(state.t_ns))
    )
    thing = solids.part(n).moved(matrix_from_quaternion(m.rotation[n]), m.position[n])
    found = find_contacts(shown, thing)
    digit = p.build.digit[near.a]
    kept = ~((digit >= 0) & (digit // DIGITS == row) & (solids.owner[near.b] == n))
    a = np.concatenate([near.a[kept], hand.rows[found.a]])
    b = np.concatenate([near.b[kept], solids.first[n] + found.b])
    order = np.lexsort((b, a))
    return replace(
        near,
        a=a[order].astype(np.int32),
        b=b[order].astype(np.int32),
        point=np.concatenate([near.point[kept], found.point])[order],
        normal=np.concatenate([near.normal[kept], found.normal])[order],
        depth=np.concatenate([near.depth[kept], found.depth])[order],
        field_depth=np.concatenate([near.field_depth[kept], found.field_depth])[order],
    )
