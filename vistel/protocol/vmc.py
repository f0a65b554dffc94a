"""VMC, the Virtual Motion Capture protocol: a tracked body's bones over OSC, one message each.

    /VMC/Ext/Bone/Pos  name  x y z  qx qy qz qw      relative to the parent bone
    /VMC/Ext/Root/Pos  name  x y z  qx qy qz qw      of the whole, relative to the floor

Names are VRM's humanoid bones (Unity: "LeftUpperArm"). The sender's frame is left-handed: X right, Y up, Z forward. Parsed
poses are right-handed: X left, Y up, Z forward.
"""

import math
from dataclasses import dataclass

from vistel.protocol import osc
from vistel.protocol.device_pose import DevicePose

DEFAULT_PORT = 39539
PARENTS: dict[str, str] = {
    "Spine": "Hips", "Chest": "Spine", "UpperChest": "Chest", "Neck": "UpperChest", "Head": "Neck",
    "LeftShoulder": "UpperChest", "LeftUpperArm": "LeftShoulder", "LeftLowerArm": "LeftUpperArm",
    "LeftHand": "LeftLowerArm",
    "RightShoulder": "UpperChest", "RightUpperArm": "RightShoulder", "RightLowerArm": "RightUpperArm",
    "RightHand": "RightLowerArm",
    "LeftUpperLeg": "Hips", "LeftLowerLeg": "LeftUpperLeg", "LeftFoot": "LeftLowerLeg",
    "RightUpperLeg": "Hips", "RightLowerLeg": "RightUpperLeg", "RightFoot": "RightLowerLeg",
    "LeftToes": "LeftFoot", "RightToes": "RightFoot",
} | {
    f"{side}{finger}{digit}": f"{side}{finger}{before}" if before else f"{side}Hand"
    for side in ("Left", "Right") for finger in ("Thumb", "Index", "Middle", "Ring", "Little")
    for before, digit in (("", "Proximal"), ("Proximal", "Intermediate"), ("Intermediate", "Distal"))
}  # fmt: skip
"""Bones of the body and their parents; a parent that is not sent is at rest."""
ROOT = ""
_BONES = frozenset(PARENTS) | {"Hips"}
_MOST_M = 20.0


@dataclass(frozen=True, slots=True)
class Body:
    """bones: by VRM name; `ROOT`: of the whole body. t_ns: when its last bone was read."""

    bones: dict[str, DevicePose]
    t_ns: int


class VmcParser:
    """Parses packets into bodies: one for each bundle, or, of single bones, whenever one of them comes again."""

    def __init__(self) -> None:
        self.bytes_skipped = 0
        self._bones: dict[str, DevicePose] = {}
        self._fresh: set[str] = set()
        self._t_ns = 0

    def feed(self, data: bytes, t_ns: int) -> list[Body]:
        """The bodies completed by a packet read at `t_ns`. Never raises, whatever the bytes."""
        bodies: list[Body] = []
        messages = osc.parse(data)
        if not any(address.startswith("/VMC/") for address, _ in messages):
            self.bytes_skipped += len(data)
        for address, arguments in messages:
            bone = _bone(address, arguments)
            if bone is None:
                continue
            name, pose = bone
            if name in self._fresh:
                bodies += self._flush()
            self._bones[name] = pose
            self._fresh.add(name)
            self._t_ns = t_ns
        if len(messages) > 1:
            bodies += self._flush()
        return bodies

    def _flush(self) -> list[Body]:
        whole = "Head" in self._fresh
        self._fresh.clear()
        return [Body(dict(self._bones), self._t_ns)] if whole and "Hips" in self._bones else []


def _bone(address: str, arguments: tuple[osc.Argument, ...]) -> tuple[str, DevicePose] | None:
    if address not in ("/VMC/Ext/Bone/Pos", "/VMC/Ext/Root/Pos") or len(arguments) < 8:
        return None
    name, numbers = arguments[0], [a for a in arguments[1:8] if isinstance(a, float)]
    if not isinstance(name, str) or len(numbers) < 7:
        return None
    name = ROOT if address == "/VMC/Ext/Root/Pos" else name[:1].upper() + name[1:]
    if name != ROOT and name not in _BONES:
        return None
    x, y, z, qx, qy, qz, qw = numbers
    norm = math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw) if all(map(math.isfinite, numbers)) else 0.0
    if abs(norm - 1.0) > 0.02 or max(abs(x), abs(y), abs(z)) > _MOST_M:
        return None
    # The frame mirrored in X: x, and rotations about the other two axes, change sign.
    return name, ((-x, y, z), (qx / norm, -qy / norm, -qz / norm, qw / norm))


def encode(bones: dict[str, DevicePose]) -> bytes:
    """The bundle that a sender makes of a body."""
    messages = [osc.encode("/VMC/Ext/OK", 1.0)]
    for name, ((x, y, z), (qx, qy, qz, qw)) in bones.items():
        address = "/VMC/Ext/Root/Pos" if name == ROOT else "/VMC/Ext/Bone/Pos"
        messages.append(osc.encode(address, name or "root", -x, y, z, qx, -qy, -qz, qw))
    return osc.bundle(messages)
