"""Where a tracker's receivers sit on a body, and the frames they are measured in.

A receiver's own axes follow the tracker's: in the rest pose +X points forward, +Y right, +Z down, so that a person
who faces where the transmitter's +X points reads the identity (Polhemus FASTRAK manual, frames).

Frames, from device to room: *receiver* -> *transmitter* (+X away from the cable, +Y right, +Z down) -> *seat*
(origin on the floor under the seat, +Z where the person faces, +Y up) -> *room*.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX, REFERENCE_HEIGHT, Skeleton
from vistel.geometry.rotation import matrix_from_quaternion, multiply, quaternion_from_matrix, rotation_y, turn
from vistel.jit.kernel_jit import compiled

Placement = tuple[F64, F64]
"""(position (3,) [m], unit quaternion (4,) x y z w): a frame placed in another."""

RECEIVERS = ("chest", "head", "left_hand", "right_hand")

TRACKER_AXES: F64 = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""Columns: the tracker's +X (forward), +Y (right), +Z (down) in a frame with Y up that faces +Z."""


@dataclass(frozen=True)
class Mount:
    """A receiver on a joint: position (3,) in the joint's frame [m], rotation (3, 3) receiver to joint."""

    joint: str
    position: F64
    rotation: F64


# Metres for a person of REFERENCE_HEIGHT. The chest's frame is carried by the left collar joint.
_MOUNTS: dict[str, tuple[str, tuple[float, float, float]]] = {
    "chest": ("left_shoulder", (-0.020, -0.050, 0.085)),  # on the breastbone
    "head": ("head", (0.0, 0.245, 0.005)),  # on top of the helmet
    "left_hand": ("left_hand", (0.055, 0.030, 0.0)),  # back of the hand
    "right_hand": ("right_hand", (-0.055, 0.030, 0.0)),
}


def receiver_mounts(skeleton: Skeleton) -> dict[str, Mount]:
    """The four mounts on a person of `skeleton`'s height."""
    scale = skeleton.height / REFERENCE_HEIGHT
    return {name: Mount(joint, np.array(p) * scale, TRACKER_AXES) for name, (joint, p) in _MOUNTS.items()}


def receiver_poses(skeleton: Skeleton, joint_pose: JointPose, mounts: Mapping[str, Mount] | None = None) -> dict[str, Placement]:
    """Where the receivers of a figure in `joint_pose` are, in its frame (usually the room's)."""
    out: dict[str, Placement] = {}
    for name, mount in (mounts or receiver_mounts(skeleton)).items():
        j = JOINT_INDEX[mount.joint]
        rotation = joint_pose.rotation[j]
        out[name] = (
            joint_pose.position[j] + rotation @ mount.position,
            quaternion_from_matrix(np.ascontiguousarray(rotation @ mount.rotation)),
        )
    return out


def joint_of_receiver(mount: Mount, position: F64, quaternion: F64) -> tuple[F64, F64]:
    """The joint's position (3,) and rotation (3, 3) from its receiver's: the inverse of a mount."""
    return _unmounted(mount.position, mount.rotation, position, quaternion)


def transmitter_in_room(
    seat_position: F64, seat_heading: float, position: tuple[float, float, float] | F64, heading: float
) -> Placement:
    """The transmitter in the room, from its `position` [m] and `heading` in the seat's frame.

    `heading`: where the transmitter's +X points, about the seat's +Y from the seat's +Z [rad]; its +Z is down.
    """
    seat = np.asarray(seat_position, np.float64)
    p_room = seat + rotation_y(seat_heading) @ np.asarray(position, np.float64)
    return p_room, quaternion_from_matrix(rotation_y(seat_heading + heading) @ TRACKER_AXES)


def into_frame(frame: Placement, p: F64, q: F64) -> Placement:
    """A placement (p, q) given in the room, seen from `frame`."""
    return _into(*frame, p, q)


def out_of_frame(frame: Placement, p: F64, q: F64) -> Placement:
    """A placement (p, q) given in `frame`, seen from the room: the inverse of `into_frame`."""
    return _out_of(*frame, p, q)


@compiled
def _unmounted(mount_p: F64, mount_r: F64, p: F64, q: F64) -> tuple[F64, F64]:
    rotation = multiply(matrix_from_quaternion(q), mount_r.T)
    return p - turn(rotation, mount_p), rotation


@compiled
def _into(frame_p: F64, frame_q: F64, p: F64, q: F64) -> tuple[F64, F64]:
    back = matrix_from_quaternion(frame_q).T
    return turn(back, p - frame_p), quaternion_from_matrix(multiply(back, matrix_from_quaternion(q)))


@compiled
def _out_of(frame_p: F64, frame_q: F64, p: F64, q: F64) -> tuple[F64, F64]:
    rotation = matrix_from_quaternion(frame_q)
    return frame_p + turn(rotation, p), quaternion_from_matrix(multiply(rotation, matrix_from_quaternion(q)))
