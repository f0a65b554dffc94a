"""What somebody at a window requests: of the world, of the picture, of the recording."""

from dataclasses import dataclass

from vistel.arrays import F64
from vistel.space.actions import Action


@dataclass(frozen=True)
class CommandRequest:
    """The world is to perform an action."""

    action: Action


@dataclass(frozen=True)
class Drag:
    """A thing is where the mouse drags it. position: (3,) [m]; rotation: (4,) quaternion; velocity: (3,) [m/s]; room frame."""

    thing: str
    position: F64
    rotation: F64
    velocity: F64


@dataclass(frozen=True)
class Drop:
    """A thing is no longer dragged: it is free from now on, and moves on at its velocity. Fields as in `Drag`."""

    thing: str
    position: F64
    rotation: F64
    velocity: F64


@dataclass(frozen=True)
class RecordRequest:
    """Recording of the picture is to begin, or to end."""

    on: bool


@dataclass(frozen=True)
class DrawingRequest:
    """How to draw from now on. light: "fast", "fine"; scale: what part of the width and height, 0: as there is time for; None:
    as before."""

    light: str | None = None
    scale: float | None = None


Request = CommandRequest | Drag | Drop | RecordRequest | DrawingRequest
