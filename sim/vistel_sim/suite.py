"""A VR tracking suite that sends a body over VMC."""

import numpy as np

from vistel.figure.posture.posture import JointPose
from vistel.figure.posture.sensors import TRACKER_AXES, Placement
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.protocol.device_pose import DevicePose
from vistel.protocol.vmc import PARENTS, ROOT, encode

_OTHERWISE = {"Hips": "hips", "Spine": "spine_1", "Chest": "spine_4", "UpperChest": "spine_8"}


_UNITY_THUMB = {"ThumbProximal": "ThumbMetacarpal", "ThumbIntermediate": "ThumbProximal"}


def _joint(bone: str) -> int:
    for unity, anatomical in _UNITY_THUMB.items():
        if bone.endswith(unity):
            bone = bone.removesuffix(unity) + anatomical
            break
    snake = "".join("_" + c.lower() if c.isupper() else c for c in bone).lstrip("_")
    return JOINT_INDEX[_OTHERWISE.get(bone, snake)]


def packet(pose: JointPose, origin: Placement) -> bytes:
    """The bundle of a figure in `pose` (room frame), in the frame of a suite whose origin is `origin`."""
    rotation = TRACKER_AXES @ matrix_from_quaternion(origin[1]).T
    bones: dict[str, DevicePose] = {ROOT: ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))}
    for bone in ("Hips", *PARENTS):
        j = _joint(bone)
        if bone == "Hips":
            p, r = rotation @ (pose.position[j] - origin[0]), rotation @ pose.rotation[j]
        else:
            k = _joint(PARENTS[bone])
            p = pose.rotation[k].T @ (pose.position[j] - pose.position[k])
            r = pose.rotation[k].T @ pose.rotation[j]
        x, y, z, w = quaternion_from_matrix(np.ascontiguousarray(r)).tolist()
        bones[bone] = ((float(p[0]), float(p[1]), float(p[2])), (x, y, z, w))
    return encode(bones)
