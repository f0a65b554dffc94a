"""Held things that hang on joints: they go where their joint lets them, and the hand gives way."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix, rotvec_from_matrix
from vistel.space.dynamics.dynamics import Motions
from vistel.space.dynamics.solids import Solids
from vistel.space.hands import grasp as hands
from vistel.space.hands.fitting import fit
from vistel.space.hands.grasp import Grasp
from vistel.space.holding.sharing import palm
from vistel.space.people import Posed

SLIP_TURN = 0.25
"""A hand goes with a thing that its joint turns by so much, and slips round it beyond [rad]."""


def hangs(solids: Solids, thing: str) -> bool:
    """Whether a thing hangs on a joint."""
    return thing in solids.joined.of_thing


def led(
    solids: Solids, m: Motions, thing: str, position: F64, rotation: F64, holds: Sequence[tuple[Grasp, Posed]] = ()
) -> tuple[F64, F64]:
    """Where a thing that is led to `position` (3,) and `rotation` (4,) goes in this step: there, if it hangs on no joint. holds:
    the hands that lead it, by their palms; without any it is led by its middle."""
    k = solids.joined.of_thing.get(thing)
    if k is None:
        return position, rotation
    grip = np.zeros(3)
    if holds:
        turn = matrix_from_quaternion(rotation)
        grip = sum((turn.T @ (palm(g, p) - position) for g, p in holds), np.zeros(3)) / len(holds)
    return solids.joined.led(k, position, rotation, grip, m.position, m.rotation)


def slipped_round(solids: Solids, g: Grasp, p: Posed, pose: Pose, t_ns: int) -> Grasp:
    """The grasp of a thing that its joint has turned in the hand, now at `pose` (room): beyond SLIP_TURN the hand slips round it,
    with its fingers laid on anew; what lies in the palm stays there."""
    now = hands.into_hand(p, g.right, pose)
    way = rotvec_from_matrix(np.ascontiguousarray(now.matrix @ g.aim.matrix.T))
    angle = float(np.sqrt(way @ way))
    if angle <= SLIP_TURN or g.settled(t_ns) < 1.0 or p.figure.posture is None:
        return g
    turn = matrix_from_rotvec(way * (1.0 - SLIP_TURN / angle))
    in_palm = p.build.palm[int(g.right)]
    lie = Pose(in_palm + turn @ (g.aim.position - in_palm), quaternion_from_matrix(np.ascontiguousarray(turn @ g.aim.matrix)))
    n = next(n for n, t in enumerate(solids.things) if t.id == g.thing)
    found = fit(
        p.build,
        g.right,
        p.figure.posture.hands[int(g.right)],
        g.engaged,
        solids.part(n).moved(lie.matrix, lie.position),
        to_palm=False,
    )
    laid = Pose(lie.position + found.shift, lie.rotation)
    return replace(g, start=lie, aim=lie, fingers=found.fingers, laid=laid, shift=found.shift)
