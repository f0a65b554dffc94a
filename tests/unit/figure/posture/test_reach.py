"""A hand put somewhere takes its arm along."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.figure.posture.hands import hand_rotation
from vistel.figure.posture.posture import Stance, pose_joints, standing
from vistel.figure.posture.reach import reach
from vistel.figure.posture.standard import standard_postures
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
def test_the_wrist_is_where_it_was_put_and_the_hand_as_it_was_turned(side: str, sign: float) -> None:
    skeleton = standard_skeleton()
    base = standard_postures()["lean"]
    base = type(base)(base.dofs, base.hands, Stance(np.array((1.0, 0.0, -2.0)), 0.7))
    chest = pose_joints(skeleton, base)
    spine = JOINT_INDEX["spine_8"]
    wrist = chest.position[spine] + chest.rotation[spine] @ np.array((0.18 * sign, -0.1, 0.35))
    hand = hand_rotation(sign, np.array((0.0, 0.3, 1.0)), np.array((-sign, 0.0, 0.2)))
    pose = pose_joints(skeleton, reach(skeleton, base, side, wrist, hand, np.array((sign, -1.0, 0.0))))
    assert pose.position[JOINT_INDEX[f"{side}_hand"]] == pytest.approx(wrist, abs=1e-3)
    assert pose.rotation[JOINT_INDEX[f"{side}_hand"]] == pytest.approx(hand, abs=1e-6)
    other = "right" if side == "left" else "left"
    assert pose.position[JOINT_INDEX[f"{other}_hand"]] == pytest.approx(chest.position[JOINT_INDEX[f"{other}_hand"]])


def test_what_is_out_of_reach_is_reached_for() -> None:
    skeleton = standard_skeleton()
    far = np.array((3.0, 1.4, 0.0))
    pose = pose_joints(skeleton, reach(skeleton, standing(), "left", far, np.eye(3), np.array((0.0, -1.0, 0.0))))
    arm = pose.position[JOINT_INDEX["left_hand"]] - pose.position[JOINT_INDEX["left_upper_arm"]]
    assert np.linalg.norm(arm) == pytest.approx(skeleton.upper_arm + skeleton.lower_arm, abs=1e-3)
    assert arm[0] > 0.54
