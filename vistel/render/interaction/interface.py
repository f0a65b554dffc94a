"""What the engine needs of windows at which somebody acts on the pictures. A service that has windows provides it."""

from collections.abc import Mapping
from typing import Protocol

from vistel.render.gl.context import GlWindow
from vistel.render.interaction.events import Event
from vistel.render.painter import Painter
from vistel.render.stage.stage import Instant
from vistel.render.things.outlines import Outline
from vistel.render.view.camera import Camera
from vistel.render.view.screens import Box, Sight
from vistel.render.view.view import Choices
from vistel.space.files.model import Polymesh


class Interaction(Protocol):
    """What somebody does between two pictures and sees over them. Called from the thread that draws."""

    choices: Choices
    """How they want the picture."""

    def take(self, instant: Instant, sights: list[Sight], size: tuple[int, int]) -> None:
        """What was done since the last picture, whose `sights` and `size` [pixels] were these."""
        ...

    def predicted(self, instant: Instant) -> Instant:
        """The instant with what they move already where the world will have it in a moment."""
        ...

    def camera(self, base: Camera) -> Camera:
        """Where the picture is taken from; base: where it would be without them."""
        ...

    def outlines(self, outlines: list[Outline]) -> list[Outline]:
        """With a line round what they point at."""
        ...

    def rows(self) -> tuple[tuple[str, bool], ...]:
        """Lines of text over the picture, each with whether it is a warning."""
        ...

    def draw(self, instant: Instant, hertz: float, drawn: float) -> None:
        """Draw over the picture, into the window's framebuffer, which is bound. hertz: pictures a second; drawn: part of the
        width and height that is drawn."""
        ...

    def close(self) -> None:
        """Give everything back."""
        ...


class InputWindow(Protocol):
    """Windows that take input."""

    eyes_apart: bool
    """Each window shows the two eyes' pictures in one place."""

    def events(self) -> list[Event]:
        """What keyboard and mouse did since the last call."""
        ...

    def size(self, number: int = 0) -> tuple[int, int]:
        """Of a window's picture [pixels]; a 0 in it while it is minimised."""
        ...

    def parts(self, size: tuple[int, int]) -> list[Box]:
        """What each window shows of a picture of `size`."""
        ...


class WindowSystem(Protocol):
    """Opens the windows of a renderer."""

    def open(self) -> GlWindow:
        """The windows, with a context that is current. Raises whatever is in the way."""
        ...

    def interaction(self, painter: Painter, models: Mapping[str, Polymesh]) -> Interaction:
        """What somebody does at the windows, which are those of the painter's surface. models: what things look like."""
        ...
