"""What a picture is to be of, and how it is to be drawn."""

from dataclasses import dataclass
from enum import Enum

from vistel.render.view.screens import EYE_DISTANCE, RoomScreen, Stereo


class Mode(Enum):
    """From where one looks."""

    SEAT = "seat"
    """Through one's own eyes."""
    FREE = "free"
    """From where one has walked."""
    ROOM = "room"
    """The overview."""
    FOLLOW = "follow"
    """Through somebody else's eyes."""


@dataclass(frozen=True)
class Choices:
    """What can be set while pictures are drawn. mode, who: from where one looks, and through whose eyes; scale: drawn part of
    the width and height, 0: as there is time for; light: "fast" or "fine"; eye_distance, convergence: of stereo [m]."""

    mode: Mode = Mode.SEAT
    who: str = ""
    scale: float = 0.0
    light: str = "fast"
    gauges: bool = False
    eye_distance: float = EYE_DISTANCE
    convergence: float = 1.0


@dataclass(frozen=True)
class View:
    """What the picture is of. kind: "seat" (through the eyes of participant `eyes`) or "room". engine: what deforms
    figures, one of `gpu_deform.ENGINES`. layers: muscles and bones move their
    skins. wrinkles: on clothes and faces. screens: in the room, the picture holds all of theirs; none: a desktop. eye_distance,
    convergence: of stereo [m]. light: "fast", "fine" or, as the machine can, "auto". gauges: how late everybody is stands over
    it. samples: of each pixel; None: as the light wants it, or edges smoothed afterwards where more than one costs too much."""

    width: int
    height: int
    kind: str
    eyes: str
    engine: str = "auto"
    layers: bool = True
    screens: tuple[RoomScreen, ...] = ()
    stereo: Stereo = Stereo.MONO
    eye_distance: float = EYE_DISTANCE
    convergence: float = 1.0
    wrinkles: bool = True
    light: str = "auto"
    gauges: bool = False
    samples: int | None = None
    names: bool = True
    """Whether people's names are over their heads."""

    @property
    def stereoscopic(self) -> bool:
        """Both eyes have a picture."""
        return self.stereo is not Stereo.MONO


def choices_of(view: View) -> Choices:
    """What a view sets of what can be set at a window."""
    mode = Mode.SEAT if view.kind == "seat" else Mode.ROOM
    return Choices(mode, view.eyes, 0.0, view.light, view.gauges, view.eye_distance, view.convergence)
