"""A VR tracking suite over VMC: its bones as a tracker's four receivers would read them.

The suite's frame takes the place of the transmitter's: its floor at `transmitter_position`, its forward along the
transmitter's +X. Bones are those of the suite's avatar, which should have the participant's height.
"""

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.sensors import TRACKER_AXES, receiver_mounts
from vistel.figure.skeleton import standard_skeleton
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.protocol.vmc import PARENTS, ROOT, Body, VmcParser
from vistel.v1.device_pb2 import TrackerBone, TrackerFrame, TrackerReceiver

STATIONS = {"chest": 1, "head": 2, "left_hand": 3, "right_hand": 4}
_CARRIED = {
    "chest": ("LeftShoulder", "UpperChest"),
    "head": ("Head", "Head"),
    "left_hand": ("LeftHand", "LeftHand"),
    "right_hand": ("RightHand", "RightHand"),
}
"""Of each receiver: the bone whose joint it sits by, and the bone it turns with."""
_SPINE = {"Spine": "spine_1", "Chest": "spine_4", "UpperChest": "spine_8"}
_THUMB = {"Proximal": "metacarpal", "Intermediate": "proximal"}


def joint_of_bone(bone: str) -> str:
    """Name in `vistel.figure.skeleton`. Unity counts a thumb's bones from the wrist, VRM 1.0 as anatomists do."""
    if "Thumb" in bone:
        for unity, anatomical in _THUMB.items():
            bone = bone.replace(unity, anatomical.capitalize())
    snake = "".join("_" + c.lower() if c.isupper() else c for c in bone).lstrip("_")
    return _SPINE.get(bone, snake)


_JOINTS = {bone: joint_of_bone(bone) for bone in ("Hips", *PARENTS)}


def joints_of(body: Body) -> dict[str, tuple[F64, F64]]:
    """Position (3,) and rotation (3, 3) of each bone in the suite's frame (X left, Y up, Z forward, metres)."""
    out: dict[str, tuple[F64, F64]] = {ROOT: _placed(body, ROOT, (np.zeros(3), np.eye(3)))}
    for name in ("Hips", *PARENTS):
        out[name] = _placed(body, name, out[PARENTS.get(name, ROOT)])
    return out


def _placed(body: Body, name: str, parent: tuple[F64, F64]) -> tuple[F64, F64]:
    if name not in body.bones:
        return parent
    p, q = body.bones[name]
    return parent[0] + parent[1] @ np.array(p), parent[1] @ matrix_from_quaternion(np.array(q))


class VmcDecoder:
    """A TrackerFrame with all four receivers for each body."""

    def __init__(self, device: str, height_m: float) -> None:
        self.device = device
        self._parser = VmcParser()
        self._mounts = receiver_mounts(standard_skeleton(height_m))

    @property
    def bytes_skipped(self) -> int:
        """Bytes so far that were part of no record."""
        return self._parser.bytes_skipped

    def feed(self, data: bytes, t_ns: int) -> list[TrackerFrame]:
        """The messages of a packet read at `t_ns`."""
        return [self._frame(body) for body in self._parser.feed(data, t_ns)]

    def _frame(self, body: Body) -> TrackerFrame:
        joints = joints_of(body)
        frame = TrackerFrame(device=self.device)
        frame.header.t_ns = max(0, body.t_ns)
        for role, station in STATIONS.items():
            at, turned = _CARRIED[role]
            if at not in body.bones:
                continue
            rotation = joints[turned][1]
            position = TRACKER_AXES.T @ (joints[at][0] + rotation @ self._mounts[role].position)
            q = quaternion_from_matrix(np.ascontiguousarray(TRACKER_AXES.T @ rotation @ self._mounts[role].rotation))
            receiver = TrackerReceiver(station=station, health=TrackerReceiver.HEALTH_GOOD, t_ns=frame.header.t_ns)
            receiver.position.x, receiver.position.y, receiver.position.z = position
            receiver.rotation.x, receiver.rotation.y, receiver.rotation.z, receiver.rotation.w = q
            frame.receivers.append(receiver)
        for bone in body.bones:
            if bone in _JOINTS:
                frame.bones.append(_bone(_JOINTS[bone], *joints[bone]))
        return frame


def _bone(joint: str, position: F64, rotation: F64) -> TrackerBone:
    out = TrackerBone(joint=joint)
    out.position.x, out.position.y, out.position.z = TRACKER_AXES.T @ position
    q = quaternion_from_matrix(np.ascontiguousarray(TRACKER_AXES.T @ rotation))
    out.rotation.x, out.rotation.y, out.rotation.z, out.rotation.w = q
    return out
