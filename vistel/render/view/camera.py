"""Where the picture is taken from: matrices of a pinhole camera and the smoothed eyes of a participant."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, slerp

NEAR = 0.05
"""Nothing nearer to the eye is drawn [m]."""
FAR = 30.0
"""Nothing further from the eye is drawn [m]."""
SEAT_FIELD_OF_VIEW = math.radians(56.0)
ROOM_FIELD_OF_VIEW = math.radians(42.0)


@dataclass(frozen=True)
class Pinhole(ABC):
    """position: (3,) room frame [m]. rotation: (3, 3) camera to room; the camera looks along its -Z, +Y up."""

    position: F64
    rotation: F64

    @abstractmethod
    def edges(self, aspect: float) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of the picture at distance one; `aspect` is width / height."""

    def through(self, u: float, v: float, aspect: float) -> F64:
        """(3,) from the eye to the part (u, v) of the picture, from its lower left, at distance one, room frame."""
        left, right, bottom, top = self.edges(aspect)
        return self.rotation @ np.array((left + u * (right - left), bottom + v * (top - bottom), -1.0))

    def view(self) -> F64:
        """(4, 4) room to camera."""
        out = np.eye(4)
        out[:3, :3] = self.rotation.T
        out[:3, 3] = -self.rotation.T @ self.position
        return out

    def projection(self, aspect: float) -> F64:
        """(4, 4) camera to clip space; `aspect` is width / height."""
        left, right, bottom, top = self.edges(aspect)
        out = np.zeros((4, 4))
        out[0, 0], out[0, 2] = 2.0 / (right - left), (right + left) / (right - left)
        out[1, 1], out[1, 2] = 2.0 / (top - bottom), (top + bottom) / (top - bottom)
        out[2, 2], out[2, 3] = (FAR + NEAR) / (NEAR - FAR), 2.0 * FAR * NEAR / (NEAR - FAR)
        out[3, 2] = -1.0
        return out

    def pixels_per_m(self, distance: float, height: int) -> float:
        """Size of a metre at `distance` [m] in a picture `height` pixels high."""
        _, _, bottom, top = self.edges(1.0)
        return height / ((top - bottom) * max(NEAR, distance))

    def project(self, points: F64, width: int, height: int) -> F64:
        """(n, 3) pixel x (right), y (down) and distance in front of the camera [m] of (n, 3) room points."""
        p = (np.asarray(points) - self.position) @ self.rotation
        depth = -p[:, 2]
        safe = np.where(np.abs(depth) < 1e-9, 1e-9, depth)
        left, right, bottom, top = self.edges(width / height)
        x = width * (p[:, 0] / safe - left) / (right - left)
        y = height * (top - p[:, 1] / safe) / (top - bottom)
        return np.stack((x, y, depth), axis=1)


@dataclass(frozen=True)
class Camera(Pinhole):
    """Straight ahead. field_of_view: of the picture's height [rad]."""

    field_of_view: float

    def edges(self, aspect: float) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of the picture at distance one. aspect: width to height."""
        top = math.tan(0.5 * self.field_of_view)
        return -top * aspect, top * aspect, -top, top


@dataclass(frozen=True)
class WindowCamera(Pinhole):
    """Through a window that need not stand before the eye. window: left, right, bottom, top at distance one; lean: so much of its
    height its upper edge lies to the right of where the corners of a rectangle would have it."""

    window: tuple[float, float, float, float]
    lean: float = 0.0

    def edges(self, aspect: float) -> tuple[float, float, float, float]:
        """Those of the window, whatever the picture's shape; at its lower edge."""
        return self.window

    def through(self, u: float, v: float, aspect: float) -> F64:
        """As `Pinhole.through`, in the leaning window."""
        out = super().through(u, v, aspect)
        return out + self.lean * v * (self.window[3] - self.window[2]) * self.rotation[:, 0]

    def projection(self, aspect: float) -> F64:
        """As `Pinhole.projection`, through the leaning window."""
        left, right, bottom, _ = self.window
        out = super().projection(aspect)
        slope = -2.0 * self.lean / (right - left)
        out[0, 1], out[0, 2] = slope, out[0, 2] + slope * bottom
        return out

    def project(self, points: F64, width: int, height: int) -> F64:
        """As `Pinhole.project`, through the leaning window."""
        left, right, bottom, top = self.window
        out = super().project(points, width, height)
        out[:, 0] -= width * self.lean * (1.0 - out[:, 1] / height) * (top - bottom) / (right - left)
        return out


def look_at(eye: F64 | Sequence[float], target: F64 | Sequence[float], field_of_view: float) -> Camera:
    """A camera at `eye` (3,) [m] with `target` (3,) in the middle of the picture, upright. field_of_view: of its height [rad]."""
    back = np.asarray(eye, np.float64) - np.asarray(target, np.float64)
    back = back / np.linalg.norm(back)
    right = np.cross((0.0, 1.0, 0.0), back)
    norm = np.linalg.norm(right)
    right = np.array((1.0, 0.0, 0.0)) if norm < 1e-9 else right / norm
    return Camera(np.asarray(eye, np.float64), np.stack((right, np.cross(back, right), back), axis=1), field_of_view)


class SeatCamera:
    """The eyes of the local participant, steadied: a display does not shake when a head does."""

    POSITION_TAU_S = 0.08
    ROTATION_TAU_S = 0.22

    def __init__(self) -> None:
        self._position: F64 | None = None
        self._quaternion: F64 | None = None
        self._t_ns = 0

    def follow(self, t_ns: int, joints: JointPose) -> Camera:
        """The camera at `t_ns` for a head as it is then; upright (a head that tilts does not tilt the room)."""
        eyes = joints.position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0)
        head = joints.rotation[JOINT_INDEX["head"]]
        ahead = joints.rotation[JOINT_INDEX["hips"]][:, 2]
        tilt = _tilt(float(joints.position[JOINT_INDEX["hips"]][1]))
        looking = FOLLOW * (head @ np.array((0.0, math.sin(tilt), math.cos(tilt))))
        looking = looking + (1.0 - FOLLOW) * (ahead + np.array((0.0, math.tan(tilt), 0.0)))
        aim = quaternion_from_matrix(np.ascontiguousarray(look_at(eyes, eyes + looking, SEAT_FIELD_OF_VIEW).rotation))
        if self._position is None or self._quaternion is None:
            position, quaternion = eyes, aim
        else:
            dt = max(0.0, (t_ns - self._t_ns) * 1e-9)
            position = self._position + (1.0 - math.exp(-dt / self.POSITION_TAU_S)) * (eyes - self._position)
            quaternion = slerp(self._quaternion, aim, 1.0 - math.exp(-dt / self.ROTATION_TAU_S))
        self._t_ns, self._position, self._quaternion = t_ns, position, quaternion
        return Camera(position, matrix_from_quaternion(quaternion), SEAT_FIELD_OF_VIEW)


FOLLOW = 0.55
"""How much of the head's turn the picture makes: a display stands still while one looks about in it."""
SEAT_TILT = math.radians(-6.0)
"""The picture's middle is so far below where the head of a sitting person points, so that table and hands are in it [rad]."""
STAND_TILT = math.radians(-17.0)
"""The same for a standing person [rad]."""
SITTING = 0.60
"""Somebody whose hips are no higher sits [m]."""
STANDING = 0.85
"""Somebody whose hips are no lower stands [m]."""


def _tilt(hips: float) -> float:
    """How far below the head's direction to look with hips at that height [rad]."""
    share = min(1.0, max(0.0, (hips - SITTING) / (STANDING - SITTING)))
    return SEAT_TILT + share * (STAND_TILT - SEAT_TILT)


def overview() -> Camera:
    """The whole table, between two seats, from the height of a standing person."""
    return look_at(np.array((0.62, 1.66, 2.30)), np.array((0.0, 0.82, 0.05)), ROOM_FIELD_OF_VIEW)
