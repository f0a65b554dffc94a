"""What somebody at a window wants: of the world, of the picture, of the recording."""

from __future__ import annotations

from dataclasses import dataclass

from vistel.arrays import F64
from vistel.space.actions import Action


@dataclass(frozen=True)
class Ask:
    """The world is to do this."""

    action: Action


@dataclass(frozen=True)
class Carry:
    """A thing is where the mouse leads it. position: (3,) [m]; rotation: (4,) quaternion; velocity: (3,) [m/s]; room frame."""

    thing: str
    position: F64
    rotation: F64
    velocity: F64


@dataclass(frozen=True)
class LetGo:
    """A thing is no longer led by the mouse: from here on it is free, and goes on as fast as it was drawn. As in `Carry`."""

    thing: str
    position: F64
    rotation: F64
    velocity: F64


@dataclass(frozen=True)
class Record:
    """The picture is to be recorded, or no longer."""

    on: bool


@dataclass(frozen=True)
class Draw:
    """How to draw from now on. light: "fast", "fine"; scale: what part of the width and height, 0: as there is time for; None:
    as before."""

    light: str | None = None
    scale: float | None = None


Wish = Ask | Carry | LetGo | Record | Draw
