"""Looking about and walking, by mouse, keyboard and 3D mouse: where a window's picture is taken from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64
from vistel.render.view.camera import ROOM_FIELD_OF_VIEW, Camera, look_at

WALK = 1.4
"""Speed of walking [m/s]."""
RUN = 3.5
"""Speed with shift held down [m/s]."""
TURN = 1.6
"""How fast arrow keys turn [rad/s]."""
LOOK = 2.4
"""How far a mouse turns that is drawn over the picture's height [rad]."""
STEEPEST = math.radians(85.0)
ZOOM = 0.9
"""A notch of the wheel multiplies the field of view by this."""
NARROWEST = math.radians(12.0)
"""Smallest field of view [rad]."""
WIDEST = math.radians(95.0)
"""Largest field of view [rad]."""
REACH = 7.0
"""How far one can walk from the table's middle [m]."""
LOWEST = 0.15
"""The eyes are no lower than this [m]."""
HIGHEST = 3.2
"""The eyes are no higher than this [m]."""
MOUSE_SPEED = 1.5
"""Speed with a 3D mouse pushed as far as it goes [m/s]."""
MOUSE_TURN = 1.8
"""Turning with a 3D mouse turned as far as it goes [rad/s]."""
MOST_S = 0.1
"""A picture that took longer than this moves one no further."""

_WAYS: Mapping[str, tuple[float, float, float]] = {
    "w": (0.0, 0.0, -1.0),
    "s": (0.0, 0.0, 1.0),
    "a": (-1.0, 0.0, 0.0),
    "d": (1.0, 0.0, 0.0),
    "e": (0.0, 1.0, 0.0),
    "q": (0.0, -1.0, 0.0),
}
"""Right, up and back, as the camera's axes are."""
_TURNS: Mapping[str, tuple[float, float]] = {"left": (1.0, 0.0), "right": (-1.0, 0.0), "up": (0.0, 1.0), "down": (0.0, -1.0)}


@dataclass(frozen=True)
class Deflection:
    """How a 3D mouse is pushed and turned, each -1 to 1. push: to the right, up, towards one; turn: about these axes."""

    push: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def still(self) -> bool:
        """Nobody touches it."""
        return not (any(self.push) or any(self.turn))


@dataclass(frozen=True)
class Viewpoint:
    """position: (3,) of the eyes [m]; heading: about +Y, 0 looks along -Z; pitch: upwards [rad]; field_of_view: of the
    picture's height [rad]."""

    position: F64
    heading: float
    pitch: float
    field_of_view: float = ROOM_FIELD_OF_VIEW

    @staticmethod
    def at(camera: Camera) -> Viewpoint:
        """One who sees what `camera` sees, upright."""
        ahead = -camera.rotation[:, 2]
        pitch = math.asin(max(-1.0, min(1.0, float(ahead[1]))))
        heading = math.atan2(-float(ahead[0]), -float(ahead[2]))
        return Viewpoint(np.array(camera.position), heading, max(-STEEPEST, min(STEEPEST, pitch)), camera.field_of_view)

    @property
    def ahead(self) -> F64:
        """(3,) unit vector of where one looks."""
        c = math.cos(self.pitch)
        return np.array((-c * math.sin(self.heading), math.sin(self.pitch), -c * math.cos(self.heading)))

    @property
    def camera(self) -> Camera:
        """What one sees."""
        return look_at(self.position, self.position + self.ahead, self.field_of_view)

    def turned(self, heading: float, pitch: float) -> Viewpoint:
        """Having turned to the left and upwards [rad]."""
        return replace(
            self,
            heading=math.remainder(self.heading + heading, 2.0 * math.pi),
            pitch=max(-STEEPEST, min(STEEPEST, self.pitch + pitch)),
        )

    def zoomed(self, notches: float) -> Viewpoint:
        """Seeing less, and that larger, for positive `notches`."""
        wanted = self.field_of_view * ZOOM**notches
        return replace(self, field_of_view=max(NARROWEST, min(WIDEST, wanted)))

    def moved(self, right: float, up: float, back: float) -> Viewpoint:
        """Having walked so far [m]: right and back along the floor, whichever way one looks; never out of the room."""
        c, s = math.cos(self.heading), math.sin(self.heading)
        x = float(self.position[0]) + c * right + s * back
        z = float(self.position[2]) - s * right + c * back
        far = math.hypot(x, z)
        if far > REACH:
            x, z = x * REACH / far, z * REACH / far
        y = max(LOWEST, min(HIGHEST, float(self.position[1]) + up))
        return replace(self, position=np.array((x, y, z)))


def navigated(viewpoint: Viewpoint, keys: Set[str], deflection: Deflection, seconds: float) -> Viewpoint:
    """After `seconds` with these keys held down and the 3D mouse pushed so."""
    dt = max(0.0, min(MOST_S, seconds))
    way = np.sum([_WAYS[k] for k in keys if k in _WAYS] or [(0.0, 0.0, 0.0)], axis=0)
    length = float(np.linalg.norm(way))
    speed = RUN if "shift" in keys else WALK
    step = dt * (speed * way / max(1.0, length) + MOUSE_SPEED * np.array(deflection.push))
    heading, pitch = np.sum([_TURNS[k] for k in keys if k in _TURNS] or [(0.0, 0.0)], axis=0)
    turned = viewpoint.turned(
        dt * (TURN * float(heading) + MOUSE_TURN * deflection.turn[1]), dt * (TURN * float(pitch) + MOUSE_TURN * deflection.turn[0])
    )
    return turned.moved(*step.tolist()) if step.any() else turned


def moves(keys: Set[str], deflection: Deflection) -> bool:
    """Whether these take one away from where one is."""
    return not deflection.still or any(k in _WAYS or k in _TURNS for k in keys)
