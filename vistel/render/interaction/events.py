"""What comes from a window's keyboard and mouse between two pictures. It knows no window library and no clock."""

from dataclasses import dataclass, field

# Buttons of a mouse.
LEFT = 0
RIGHT = 1
MIDDLE = 2


@dataclass(frozen=True)
class Key:
    """A key went down or up. name: what is on it on an American keyboard ("w", "f1", "left", "shift"), for its place counts."""

    name: str
    down: bool


@dataclass(frozen=True)
class Button:
    """A mouse button went down or up at (x, y), pixels of its window from the upper left. window: its number."""

    number: int
    down: bool
    x: float
    y: float
    window: int = 0


@dataclass(frozen=True)
class Pointer:
    """The mouse is at (x, y), as above."""

    x: float
    y: float
    window: int = 0


@dataclass(frozen=True)
class Wheel:
    """The wheel turned; positive: away from the hand."""

    notches: float
    sideways: float = 0.0


@dataclass(frozen=True)
class Text:
    """Somebody wrote this."""

    text: str


@dataclass(frozen=True)
class FocusLost:
    """The window has lost the keyboard: no event says what is released from now on."""


Event = Key | Button | Pointer | Wheel | Text | FocusLost


@dataclass
class InputState:
    """Keys and buttons that are down now, and where the mouse is."""

    keys: set[str] = field(default_factory=set[str])
    buttons: set[int] = field(default_factory=set[int])
    at: Pointer | None = None

    def take(self, event: Event) -> None:
        """Update it by an event."""
        if isinstance(event, Key):
            (self.keys.add if event.down else self.keys.discard)(event.name)
        elif isinstance(event, Button):
            (self.buttons.add if event.down else self.buttons.discard)(event.number)
            self.at = Pointer(event.x, event.y, event.window)
        elif isinstance(event, Pointer):
            self.at = event
        elif isinstance(event, FocusLost):
            self.keys.clear()
            self.buttons.clear()
