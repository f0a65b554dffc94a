"""What may be asked of the world. Lengths in metres, angles in radians, quaternions (x, y, z, w)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from vistel.arrays import F64


class Refused(Exception):  # noqa: N818 - said to a person, no error
    """A command cannot be done; the text is one line for the person who asked. thing: what somebody else leads."""

    def __init__(self, reason: str, thing: str = "") -> None:
        super().__init__(reason)
        self.thing = thing


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
    """Which things are meant: all that is said must be true of them; what is empty or None says nothing.

    thing: id; name: as for people, or part of it; shape: "ball", ...; colour: the name of one; shown: how the speaker
    shows it; every: all of them, not one; size: of those of which all else is true, the one with the most or least extent.
    A Which that says nothing is "this": what is selected, held, pointed at or looked at, in that order.
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


class Where(Enum):
    """A place the speaker means."""

    HERE = "here"
    POINTED = "there"


@dataclass(frozen=True)
class Select:
    """From now on "this" means these; nothing: an end of that."""

    which: Which = THIS
    nothing: bool = False


@dataclass(frozen=True)
class Move:
    """Put a thing somewhere at once: position (3,), rotation (4,), room frame."""

    which: Which
    position: F64
    rotation: F64


@dataclass(frozen=True)
class MoveBy:
    """Move in a direction as the speaker sees it."""

    which: Which
    towards: Towards
    distance: float = 0.1


@dataclass(frozen=True)
class Place:
    """Move to a place the speaker means."""

    which: Which
    where: Where = Where.HERE


@dataclass(frozen=True)
class Turn:
    """Turn about an axis as the speaker sees it: ACROSS tips a thing over, UP turns it on the spot."""

    which: Which
    angle: float
    about: Along = Along.UP


@dataclass(frozen=True)
class Scale:
    """Make a thing larger or smaller; along: in one direction only, None in all."""

    which: Which
    factor: float
    along: Along | None = None


@dataclass(frozen=True)
class Bend:
    """Bend a thing along its longest axis, upwards, by an angle from end to end; 0 makes it straight again."""

    which: Which
    angle: float


@dataclass(frozen=True)
class Twist:
    """Twist a thing about its longest axis by an angle from end to end."""

    which: Which
    angle: float


@dataclass(frozen=True)
class Paint:
    """Give a thing another colour, 0xRRGGBBAA."""

    which: Which
    colour: int


@dataclass(frozen=True)
class Harden:
    """rigidity: 0 as soft as flesh .. 1 rigid."""

    which: Which
    rigidity: float


@dataclass(frozen=True)
class Sharpen:
    """Make edges and tips sharper; by: share of the way to as sharp as they can be, 0 to 1; below 0 to -1: to as round."""

    which: Which
    by: float


@dataclass(frozen=True)
class Dent:
    """Press a dent into a soft thing on the side that the speaker sees; depth: share of half of its smallest extent."""

    which: Which
    depth: float = 0.3


@dataclass(frozen=True)
class Hide:
    """Show a thing no more; it stays where it is and is felt."""

    which: Which = THIS


@dataclass(frozen=True)
class Show:
    """Show a thing again that was hidden; "this" is all that is."""

    which: Which = THIS


@dataclass(frozen=True)
class Align:
    """Stand things in a row, across or ahead for the speaker, along whichever they are spread more."""

    which: Which


@dataclass(frozen=True)
class Copy:
    """Another one like it, beside it."""

    which: Which = THIS


@dataclass(frozen=True)
class Create:
    """A new thing before the speaker, or where they point. shape: one of `create.SHAPES`; size: half of its largest
    extent; colour: 0xRRGGBBAA, None for one of its own."""

    shape: str
    size: float = 0.04
    colour: int | None = None
    where: Where = Where.HERE


@dataclass(frozen=True)
class Delete:
    """Take a thing out of the room."""

    which: Which = THIS


@dataclass(frozen=True)
class Grip:
    """The speaker's hand takes hold of what it touches, closed or not; by force also from others' hands."""

    which: Which = THIS
    force: bool = False


@dataclass(frozen=True)
class Release:
    """Let go of a thing."""

    which: Which = THIS


@dataclass(frozen=True)
class Attach:
    """Fix a thing to another one, as they lie; they must touch, or nearly."""

    which: Which
    to: Which


@dataclass(frozen=True)
class Detach:
    """Take apart what was attached."""

    which: Which = THIS


@dataclass(frozen=True)
class Undo:
    """Take back the last thing the speaker did."""


@dataclass(frozen=True)
class Redo:
    """Do again what the speaker has just taken back."""


@dataclass(frozen=True)
class Stop:
    """Whatever the speaker's commands have set in motion stops where it is."""


@dataclass(frozen=True)
class Reset:
    """Everything back to where it began."""


Action = (
    Select
    | Move
    | MoveBy
    | Place
    | Turn
    | Scale
    | Bend
    | Twist
    | Paint
    | Harden
    | Copy
    | Create
    | Delete
    | Grip
    | Release
    | Attach
    | Detach
    | Undo
    | Redo
    | Stop
    | Reset
    | Sharpen
    | Dent
    | Hide
    | Show
    | Align
)
