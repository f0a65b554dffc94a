"""Fingers closed round a bar until each bone of them touches it."""

import math

import numpy as np

from vistel.arrays import F64
from vistel.figure.body import Body
from vistel.figure.posture.posture import HAND_DOF_COUNT, Posture, pose_joints
from vistel.figure.skeleton import FINGERS, JOINT_INDEX, Skeleton


def closed_round(skeleton: Skeleton, body: Body, side: str, point: F64, radius: float, press: float = 0.001) -> F64:
    """(20,) finger angles that close a hand round a bar lying across the palm until each bone touches it.

    point: (3,) of the bar's axis in the hand's frame; the axis runs along the hand's Z; radius [m]; press: how far
    the fingers' surfaces sink into the bar [m].
    """
    sign = 1.0 if side == "left" else -1.0
    hand = JOINT_INDEX[f"{side}_hand"]
    centre = np.array([sign * point[0], point[1]])
    out = np.zeros(HAND_DOF_COUNT)
    for f, finger in enumerate(FINGERS[1:], start=1):
        bones = [f"{side}_{finger}_{digit}" for digit in ("proximal", "intermediate", "distal")]
        start = skeleton.rest[JOINT_INDEX[bones[0]]] - skeleton.rest[hand]
        p, heading = np.array([sign * start[0], start[1]]), 0.0
        for k, bone in enumerate(bones):
            length = float(np.linalg.norm(skeleton.tip[JOINT_INDEX[bone]]))
            i = body.names.index(bone)
            reach = radius + 0.5 * (body.radius_a[i] + body.radius_b[i]) - press
            bend = _bend_until_touch(p, heading, length, centre, reach, math.radians((80.0, 100.0, 70.0)[k]))
            heading += bend
            p = p + length * np.array([math.cos(heading), -math.sin(heading)])
            out[4 * f + (0 if k == 0 else k + 1)] = bend
    out[:4] = _thumb_over(skeleton, body, side, point, radius)
    return out


def closed_on(skeleton: Skeleton, body: Body, side: str, point: F64, direction: F64, radius: float, press: float = 0.001) -> F64:
    """(20,) finger angles that close a hand on a bar that lies in it at any slant, bone by bone until each touches.

    point, direction: (3,) of the bar's axis in the hand's frame, the direction a unit vector; radius [m]; press: how
    far the surfaces sink into the bar [m].
    """
    row = 0 if side == "left" else 1
    angles = np.zeros((2, HAND_DOF_COUNT))

    def gap(bone: str) -> float:
        return _gap(skeleton, body, side, bone, angles, point, direction) - radius + press

    for f, finger in enumerate(FINGERS[1:], start=1):
        bones = [f"{side}_{finger}_{digit}" for digit in ("proximal", "intermediate", "distal")]
        for k, bone in enumerate(bones):
            at = 4 * f + (0 if k == 0 else k + 1)
            while angles[row, at] < math.radians((80.0, 100.0, 70.0)[k]) and gap(bone) > 0.0:
                angles[row, at] += math.radians(2.0)
    best, best_cost = angles[row, :4].copy(), math.inf
    for roll in np.radians((20, 45, 70, 95)):
        for abduction in np.radians((-10, 10, 30)):
            for bend in np.radians((0, 25, 50)):
                for end in np.radians((5, 35, 65)):
                    angles[row, :4] = (roll, abduction, bend, end)
                    cost = abs(gap(f"{side}_thumb_distal")) + 3.0 * max(0.0, -gap(f"{side}_thumb_proximal"))
                    cost += 0.002 * (bend + end)
                    if cost < best_cost:
                        best, best_cost = angles[row, :4].copy(), cost
    angles[row, :4] = best
    return angles[row]


def _gap(skeleton: Skeleton, body: Body, side: str, bone: str, angles: F64, point: F64, direction: F64) -> float:
    """From a bone's surface to a line in the hand's frame [m]."""
    pose = pose_joints(skeleton, Posture(hands=angles))
    joint, hand, i = JOINT_INDEX[bone], JOINT_INDEX[f"{side}_hand"], body.names.index(bone)
    share = np.linspace(0.0, 1.0, 7)[:, None]
    along = pose.position[joint] + (body.a[i] + share * (body.b[i] - body.a[i])) @ pose.rotation[joint].T
    off = (along - pose.position[hand]) @ pose.rotation[hand] - point
    away = np.linalg.norm(off - (off @ direction)[:, None] * direction, axis=1)
    thick = body.radius_a[i] + share[:, 0] * (body.radius_b[i] - body.radius_a[i])
    return float((away - thick).min())


def _bend_until_touch(p: F64, heading: float, length: float, centre: F64, reach: float, most: float) -> float:
    bend = 0.0
    while bend < most:
        d = np.array([math.cos(heading + bend), -math.sin(heading + bend)])
        along = min(length, max(0.0, float((centre - p) @ d)))
        if float(np.linalg.norm(p + along * d - centre)) <= reach:
            break
        bend += math.radians(1.0)
    return bend


def _thumb_over(skeleton: Skeleton, body: Body, side: str, point: F64, radius: float) -> F64:
    """Thumb angles that lay its end bone over the fingers that are closed round a bar; a search over its range."""
    thumb = body.names.index(f"{side}_thumb_distal")
    finger = body.names.index(f"{side}_index_intermediate")
    thickness = radius + 2.0 * float(body.radius_a[finger]) + float(body.radius_b[thumb])
    target = point + np.array([0.0, -thickness, 0.35 * skeleton.rest[JOINT_INDEX["left_index_proximal"], 2]])
    hand, joint = JOINT_INDEX[f"{side}_hand"], JOINT_INDEX[f"{side}_thumb_distal"]
    row = 0 if side == "left" else 1
    best, best_cost = np.zeros(4), math.inf
    hands = np.zeros((2, HAND_DOF_COUNT))
    for roll in np.radians((20, 45, 70, 95)):
        for abduction in np.radians((-30, -10, 10, 30)):
            for bend in np.radians((0, 25, 50)):
                for end in np.radians((5, 35, 65)):
                    hands[row, :4] = (roll, abduction, bend, end)
                    pose = pose_joints(skeleton, Posture(hands=hands))
                    middle = pose.position[joint] + 0.6 * pose.rotation[joint] @ skeleton.tip[joint]
                    away = pose.rotation[hand].T @ (middle - pose.position[hand]) - target
                    cost = float(np.linalg.norm(away)) + 0.001 * (bend + end)
                    if cost < best_cost:
                        best, best_cost = hands[row, :4].copy(), cost
    return best
