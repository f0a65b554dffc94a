"""The elbow's swivel: of all that the wrist allows, the one that costs least."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vistel.figure.posture.arm import Bones, arm_dofs, bones_of, elbow_at, elbow_flexion
from vistel.figure.posture.limits import axial_excess
from vistel.figure.posture.swivel import (
    AXIAL_LIMIT,
    FLEXION_LIMIT,
    RADIAL_LIMIT,
    TWIST_LIMIT,
    ULNAR_LIMIT,
    W_LIMIT,
    Comfort,
    solve_arm,
)
from vistel.figure.skeleton import standard_skeleton
from vistel.geometry.rotation import rotation_x, rotation_z

UP = np.array([0.0, 1.0, 0.0])
SWIVELS = np.linspace(-math.pi, math.pi, 2000, endpoint=False)


def beyond(x: float, low: float, high: float) -> float:
    return max(0.0, low - x, x - high) ** 2


def cost(wrist: np.ndarray, hand: np.ndarray, bones: Bones, toward: np.ndarray, rest: np.ndarray, comfort: Comfort) -> float:
    """Of an arm whose elbow points there, from its rotations alone."""
    _, elbow = elbow_at(bones.collar, wrist, bones.upper, bones.lower, toward, 0.0)
    along = (elbow - bones.collar) / bones.upper
    hinge = np.cross(toward, wrist - bones.collar)
    hinge -= (hinge @ along) * along
    hinge /= np.linalg.norm(hinge)
    upper = np.column_stack([bones.side * along, -bones.side * hinge, -np.cross(along, hinge)])
    flexion = elbow_flexion(bones.collar, wrist, bones.upper, bones.lower)
    held = Rotation.from_euler("y", bones.side * flexion) * Rotation.from_matrix(upper).inv() * Rotation.from_matrix(hand)
    turned = Rotation.from_matrix(rest.T @ upper).as_rotvec()
    x, _, _, w = held.as_quat(canonical=True)
    twist = 2.0 * math.atan2(x, w)
    _, y, z = (held * Rotation.from_euler("x", -twist)).as_rotvec()
    deviation, bend = -bones.side * y, -bones.side * z
    height = (elbow - bones.collar) @ UP / (bones.upper + bones.lower)
    wanted = comfort.height * height + comfort.shoulder * turned @ turned + comfort.twist * (twist - comfort.twist_at_rest) ** 2
    wanted += comfort.deviation * (deviation - comfort.deviation_at_rest) ** 2
    wanted += comfort.flexion * (bend - comfort.flexion_at_rest) ** 2
    forbidden = beyond(twist, -TWIST_LIMIT, TWIST_LIMIT) + beyond(deviation, -ULNAR_LIMIT, RADIAL_LIMIT)
    forbidden += beyond(bend, -FLEXION_LIMIT, FLEXION_LIMIT) + beyond(turned[0], -AXIAL_LIMIT, AXIAL_LIMIT)
    return float(wanted + W_LIMIT * (forbidden + axial_excess(upper, bones.side) ** 2))


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_first_solve_takes_the_swivel_that_costs_least_of_all_around(side: str, seed: int) -> None:
    draw = np.random.default_rng(seed)
    bones = bones_of(standard_skeleton(), side)._replace(shortening=0.0)  # one length of collar bone for all swivels
    comfort = Comfort()
    rest = rotation_z(-bones.side * math.radians(80.0)) @ rotation_x(comfort.axial_at_rest)
    wrist = bones.collar + np.array([-0.1 * bones.side, -0.25, 0.25]) + draw.uniform(-0.1, 0.1, 3)  # in reach
    hand = Rotation.from_euler("xyz", draw.uniform(-0.4, 0.4, 3)) * Rotation.from_euler("y", -bones.side * 1.2)
    toward = draw.uniform(-1.0, 1.0, 3)
    given = wrist, hand.as_matrix().copy(), bones
    _, found, scale = solve_arm(*given, UP, rest, toward, 1.0, 0.0, False, np.array(comfort))
    assert scale == pytest.approx(1.0)
    all_around = [arm_dofs(*given, toward, psi, 1.0)[1] for psi in SWIVELS]
    least = min(cost(*given, direction, rest, comfort) for direction in all_around)
    assert cost(*given, found, rest, comfort) <= least + 1e-3
