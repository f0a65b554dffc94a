"""What a picture is to be of, and how it is to be drawn."""

from __future__ import annotations

from dataclasses import dataclass

from vistel_services.renderer.screens import EYE_DISTANCE, Screen, Stereo
from vistel_services.renderer.window.navigation import Mode
from vistel_services.renderer.window.panel import Choices
from vistel_services.renderer.window.window import Pane


@dataclass(frozen=True)
class View:
    """What the picture is of. kind: "seat" (through the eyes of participant `eyes`) or "room". window: it is shown in
    one, or in several `panes`. engine: what deforms figures, one of `gpu_deform.ENGINES`. layers: muscles and bones move their
    skins. wrinkles: on clothes and faces. screens: in the room, the picture holds all of theirs; none: a desktop. eye_distance,
    convergence: of stereo [m]. light: "fast", "fine" or, as the machine can, "auto". gauges: how late everybody is stands over
    it. samples: of each pixel; None: as the light wants it, or edges smoothed afterwards where more than one costs too much."""

    width: int
    height: int
    kind: str
    eyes: str
    window: bool
    title: str = "VISTEL"
    engine: str = "auto"
    layers: bool = True
    screens: tuple[Screen, ...] = ()
    stereo: Stereo = Stereo.MONO
    eye_distance: float = EYE_DISTANCE
    convergence: float = 1.0
    wrinkles: bool = True
    light: str = "auto"
    gauges: bool = False
    samples: int | None = None
    panes: tuple[Pane, ...] = ()

    @property
    def stereoscopic(self) -> bool:
        """Both eyes have a picture."""
        return self.stereo is not Stereo.MONO


def choices_of(view: View) -> Choices:
    """What a view sets of what can be set at a window."""
    mode = Mode.SEAT if view.kind == "seat" else Mode.ROOM
    return Choices(mode, view.eyes, 0.0, view.light, view.gauges, view.eye_distance, view.convergence)
