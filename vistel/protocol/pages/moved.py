"""How a guest moves, by whichever of the page's devices says so."""

from __future__ import annotations

from typing import Literal

from vistel.protocol.pages.camera_body import camera_body_of, is_camera_body
from vistel.protocol.pages.headset import headset_of, is_headset
from vistel.protocol.pages.pointer import posture_of
from vistel.v1.device_pb2 import CameraBodyFrame, HeadsetFrame, PointerFrame

Role = Literal["pointer", "camera_body", "headset"]
"""Mouse and keys, the camera, or the headset."""


def role_of(data: bytes) -> Role:
    """The device that makes such records."""
    return "camera_body" if is_camera_body(data) else "headset" if is_headset(data) else "pointer"


def moved(data: bytes, now_ns: int) -> PointerFrame | CameraBodyFrame | HeadsetFrame | None:
    """A page's record as a message; None where it is none, is from another time, or says what no guest can do."""
    role = role_of(data)
    if role == "camera_body":
        return camera_body_of(data, now_ns)
    return headset_of(data, now_ns) if role == "headset" else posture_of(data)
