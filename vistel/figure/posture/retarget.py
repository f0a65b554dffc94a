"""Retargets a measured person's posture to the body that others see: hands, head and chest stay where they are in the room."""

from vistel.arrays import F64
from vistel.figure.posture.limits import SIDES
from vistel.figure.posture.posture import Posture, Stance, pose_joints
from vistel.figure.posture.sensors import receiver_mounts, receiver_poses
from vistel.figure.posture.solve import PostureSolver
from vistel.figure.skeleton import JOINT_INDEX, Skeleton

_COLLARS = JOINT_INDEX["left_shoulder"], JOINT_INDEX["right_shoulder"]


class Retargeter:
    """Follows one person over time; times must not go back."""

    def __init__(self, measured: Skeleton, shown: Skeleton, seat: Stance | None) -> None:
        self._measured = measured
        self._mounts = receiver_mounts(shown)
        self._solver = PostureSolver(shown, seat, self._mounts)
        self._half_width = 0.5 * (shown.rest[_COLLARS[0]] - shown.rest[_COLLARS[1]])

    def retarget(self, t_s: float, posture: Posture) -> Posture:
        """The posture of the shown person that corresponds to `posture` of the measured one."""
        pose = pose_joints(self._measured, posture)
        chest = pose.rotation[_COLLARS[0]]
        middle = 0.5 * (pose.position[_COLLARS[0]] + pose.position[_COLLARS[1]])
        receivers = receiver_poses(self._measured, pose, self._mounts)
        # The chest's receiver sits by the left collar; wider people have it farther out.
        p, q = receivers["chest"]
        receivers["chest"] = (p + middle + chest @ self._half_width - pose.position[_COLLARS[0]], q)
        elbows: dict[str, F64] = {}
        for side in SIDES:
            j = JOINT_INDEX[f"{side}_upper_arm"]
            elbows[side] = chest.T @ (pose.position[j + 1] - pose.position[j])
        return self._solver.solve(t_s, receivers, (posture.hands[0], posture.hands[1]), elbows).posture
