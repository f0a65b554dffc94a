"""What commands are given: which things, which way, along what, where, how somebody reacts."""

from dataclasses import dataclass
from enum import Enum


class Shown(Enum):
    """How somebody shows which thing they mean."""

    POINTED = "pointed at"
    LOOKED_AT = "looked at"
    SELECTED = "selected"
    HELD = "held"


class Size(Enum):
    """Which of several things, by how large they are."""

    LARGEST = "largest"
    SMALLEST = "smallest"


@dataclass(frozen=True)
class Which:
    """Which things are meant: they must fit every field that is not empty or None.

    thing: id; name: as for people, or part of it; shape: "ball", ...; colour: the name of one; shown: how the speaker
    shows it; every: all of them, not one; size: of those of which all else is true, the one with the most or least extent.
    A Which without any field is "this": what is selected, held, pointed at or looked at, in that order.
    """

    thing: str = ""
    name: str = ""
    shape: str = ""
    colour: str = ""
    shown: Shown | None = None
    every: bool = False
    size: Size | None = None

    @property
    def is_this(self) -> bool:
        """Nothing was said of it."""
        return not (self.thing or self.name or self.shape or self.colour or self.shown or self.every or self.size)


THIS = Which()


class Towards(Enum):
    """A direction as the speaker sees it; ahead is away from them."""

    RIGHT = "right"
    LEFT = "left"
    UP = "up"
    DOWN = "down"
    AHEAD = "ahead"
    BACK = "back"


class Along(Enum):
    """An axis of a thing: its longest, the one that is upright, and those that lie across and ahead for the speaker.
    GIRTH: the two that are not its longest, for making it thicker or thinner."""

    LONGEST = "longest"
    UP = "up"
    ACROSS = "across"
    AHEAD = "ahead"
    GIRTH = "girth"


class Reaction(Enum):
    """To what is said."""

    THUMB_UP = "thumb_up"
    CLAP = "clap"
    HEART = "heart"
    LAUGH = "laugh"
    SURPRISE = "surprise"


class Where(Enum):
    """A place the speaker means."""

    HERE = "here"
    POINTED = "there"
