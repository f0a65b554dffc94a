"""What may be asked of the world: each command, how people type it and how they say it.

Lengths in metres, angles in radians, quaternions (x, y, z, w).
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

from vistel.host import HOST
from vistel.space.arguments import THIS, Along, Reaction, Towards, Where, Which
from vistel.space.command_description import (
    Action,
    AxisName,
    ColourName,
    Length,
    Quantity,
    ShapeName,
    command,
    phrase,
    spoken,
    typed,
)

if TYPE_CHECKING:
    from vistel.arrays import F64
else:  # who only asks for something need not load NumPy
    F64 = Any


class Refused(Exception):  # noqa: N818 - said to a person, no error
    """A command cannot be done; the text is one line for the person who asked. thing: what somebody else leads."""

    def __init__(self, reason: str, thing: str = "") -> None:
        super().__init__(reason)
        self.thing = thing


def absent(participant: str) -> str:
    """Why a command of somebody who is not in the room is refused."""
    return f"{participant or 'nobody'} is not in the room"


def unseen(participant: str) -> str:
    """Why a command of somebody who is in the room, but whose posture has not come yet, is refused."""
    if participant == HOST:
        return "the host stands nowhere in the room: name the thing, and say neither a direction nor here"
    return f"nobody knows yet where {participant} is"


Angle = Annotated[
    float,
    Quantity("DEGREES", "by how many degrees?", {"": 45.0, "little": 15.0, "more": 90.0}, tag="degrees", unit=math.radians(1.0)),
]


@command(
    typed("select nothing", nothing=True),
    typed("select WHICH"),
    spoken("select", phrase("verb.select", "えらんで", "select/choose", "選んで")),
    spoken("deselect", phrase("alone.drop", "せんたくかいじょ", "select nothing", "選択解除"), nothing=True, which=THIS),
)
@dataclass(frozen=True)
class Select(Action):
    """From now on "this" means these things; with none, the selection ends."""

    which: Which = THIS
    nothing: bool = False


@command()
@dataclass(frozen=True)
class Move(Action):
    """Put a thing somewhere at once: position (3,), rotation (4,), room frame."""

    which: Which
    position: F64
    rotation: F64


@command(
    typed("move WHICH TOWARDS [DISTANCE]"),
    typed("press WHICH", towards=Towards.AHEAD),
    spoken(
        "move",
        phrase("move.move", "うごかして", "move/slide", "動かして"),
        phrase("push.push", "おして", "push/press", "押して", towards="ahead"),
        phrase("push.pull", "ひっぱって", "pull", "引っ張って", towards="back"),
        phrase("push.lift", "もちあげて", "lift/raise", "持ち上げて", towards="up"),
    ),
)
@dataclass(frozen=True)
class MoveBy(Action):
    """Move in a direction as the speaker sees it; what hangs on a joint as far as that goes. A button is pressed."""

    which: Which
    towards: Towards
    distance: Annotated[float, Length("LENGTH", "how far?", {"": 0.1, "little": 0.03, "more": 0.3}, tag="metres")] = 0.1


@command(
    typed("open WHICH [SHARE]"),
    typed("close WHICH", share=0.0),
    spoken("open", phrase("push.open", "あけて/ひらいて", "open", "開けて/開いて")),
    spoken("close", phrase("push.close", "しめて/とじて", "close/shut", "閉めて/閉じて"), share=0.0),
)
@dataclass(frozen=True)
class Open(Action):
    """Open or close what hangs on a joint: a lid, a door, a drawer; of a box, what hangs on it. share: of the way, 0 closed, 1
    open."""

    which: Which
    share: Annotated[float, Quantity("SHARE", "how far, of 1?", {"": 1.0, "little": 0.3, "more": 1.0}, tag="share")] = 1.0


@command(
    typed("put WHICH [WHERE]"),
    spoken(
        "place",
        phrase("put.put", "おいて", "put/place", "置いて"),
        phrase("verb.bring", "もってきて", "bring/bring me", "持ってきて", where="here"),
    ),
)
@dataclass(frozen=True)
class Place(Action):
    """Move to a place the speaker means."""

    which: Which
    where: Where = Where.HERE


def _turned(action: "Turn", towards: Towards) -> "Turn":
    """To the right is clockwise from above; ahead is over the far edge."""
    sense, about = {
        Towards.RIGHT: (-1.0, Along.UP),
        Towards.LEFT: (1.0, Along.UP),
        Towards.UP: (1.0, Along.ACROSS),
        Towards.DOWN: (-1.0, Along.ACROSS),
        Towards.AHEAD: (-1.0, Along.ACROSS),
        Towards.BACK: (1.0, Along.ACROSS),
    }[towards]
    return replace(action, angle=sense * action.angle, about=about)


@command(
    typed("turn WHICH ANGLE [ABOUT]"),
    spoken("turn", phrase("turn.turn", "まわして", "turn/rotate", "回して"), towards=_turned),
    spoken("flip", phrase("verb.flip", "うらがえして", "flip/turn over", "裏返して"), angle=math.pi, about=Along.ACROSS),
    spoken("tip", phrase("verb.tip", "たおして", "tip over/lay down", "倒して"), angle=-0.5 * math.pi, about=Along.ACROSS),
)
@dataclass(frozen=True)
class Turn(Action):
    """Turn about an axis as the speaker sees it: ACROSS tips a thing over, UP turns it on the spot."""

    which: Which
    angle: Angle
    about: Annotated[Along, AxisName()] = Along.UP


@command(
    typed("scale WHICH FACTOR [ALONG]"),
    typed("larger WHICH", factor=1.5),
    typed("smaller WHICH", factor=1 / 1.5),
    typed("longer WHICH", factor=1.5, along=Along.LONGEST),
    typed("shorter WHICH", factor=1 / 1.5, along=Along.LONGEST),
    typed("taller WHICH", factor=1.5, along=Along.UP),
    typed("lower WHICH", factor=1 / 1.5, along=Along.UP),
    typed("wider WHICH", factor=1.5, along=Along.ACROSS),
    typed("narrower WHICH", factor=1 / 1.5, along=Along.ACROSS),
    typed("deeper WHICH", factor=1.5, along=Along.AHEAD),
    spoken(
        "scale",
        phrase("stretch.stretch", "のばして", "stretch", "伸ばして", change="up"),
        phrase("stretch.shrink", "ちぢめて", "shrink", "縮めて", change="down"),
        phrase("shape_it.inflate", "ふくらませて", "inflate", "膨らませて", change="up", along="all"),
        phrase("make.larger", "おおきくして", "larger/bigger", "大きくして", change="up", along="all"),
        phrase("make.smaller", "ちいさくして", "smaller", "小さくして", change="down", along="all"),
        phrase("make.longer", "ながくして", "longer", "長くして", change="up", along="longest"),
        phrase("make.shorter", "みじかくして", "shorter", "短くして", change="down", along="longest"),
        phrase("make.taller", "たかくして", "taller/higher", "高くして", change="up", along="up"),
        phrase("make.lower", "ひくくして", "lower/flatter", "低くして", change="down", along="up"),
        phrase("make.wider", "ひろくして", "wider", "広くして", change="up", along="across"),
        phrase("make.narrower", "せまくして", "narrower", "狭くして", change="down", along="across"),
        phrase("make.thicker", "ふとくして", "thicker", "太くして", change="up", along="girth"),
        phrase("make.thinner", "ほそくして", "thinner", "細くして", change="down", along="girth"),
    ),
    spoken("double", phrase("become.double", "にばいにして", "twice as large", "二倍にして"), factor=2.0, along=None),
    spoken("halve", phrase("become.half", "はんぶんにして", "half as large", "半分にして"), factor=0.5, along=None),
)
@dataclass(frozen=True)
class Scale(Action):
    """Make a thing larger or smaller; along: in one direction only, None in all."""

    which: Which
    factor: Annotated[
        float,
        Quantity(
            "FACTOR", "by what factor?", {"": 1.5, "little": 1.2, "more": 2.0}, tag="factor", opposite=lambda factor: 1.0 / factor
        ),
    ]
    along: Annotated[Along | None, AxisName(said="longest")] = None


@command(
    typed("bend WHICH ANGLE"),
    typed("straighten WHICH", angle=0.0),
    spoken("bend", phrase("shape_it.bend", "まげて", "bend", "曲げて")),
    spoken("straighten", phrase("become.straight", "まっすぐにして", "straight", "真っ直ぐにして"), angle=0.0),
)
@dataclass(frozen=True)
class Bend(Action):
    """Bend a thing along its longest axis, upwards, by an angle from end to end; 0 makes it straight again."""

    which: Which
    angle: Angle


@command(typed("twist WHICH ANGLE"), spoken("twist", phrase("shape_it.twist", "ねじって", "twist")))
@dataclass(frozen=True)
class Twist(Action):
    """Twist a thing about its longest axis by an angle from end to end."""

    which: Which
    angle: Angle


@command(typed("paint WHICH COLOUR"), spoken("paint"))
@dataclass(frozen=True)
class Paint(Action):
    """Give a thing another colour, 0xRRGGBBAA. Its phrases, which are colours, stand in the grammar's file."""

    which: Which
    colour: Annotated[int, ColourName("paint")]


@command(
    typed("soften WHICH", rigidity=0.3),
    typed("harden WHICH", rigidity=1.0),
    spoken(
        "harden",
        phrase("make.harder", "かたくして", "hard/harder", "硬くして", change="up"),
        phrase("make.softer", "やわらかくして", "soft/softer", "柔らかくして", change="down"),
    ),
)
@dataclass(frozen=True)
class Harden(Action):
    """rigidity: 0 as soft as flesh .. 1 rigid."""

    which: Which
    rigidity: Annotated[
        float,
        Quantity(
            "RIGIDITY", "to what rigidity?", {"": 1.0, "little": 0.8, "more": 1.0}, down={"": 0.3, "little": 0.4, "more": 0.0}
        ),
    ]


@command(
    typed("sharpen WHICH", by=0.6),
    typed("round WHICH", by=-0.6),
    spoken(
        "sharpen",
        phrase("make.sharper", "とがらせて", "sharp/sharper", "尖らせて", change="up"),
        phrase("make.rounder", "まるくして", "round/rounder", "丸くして", change="down"),
    ),
)
@dataclass(frozen=True)
class Sharpen(Action):
    """Make edges and tips sharper; by: share of the way to as sharp as they can be, 0 to 1; below 0 to -1: to as round."""

    which: Which
    by: Annotated[
        float, Quantity("SHARE", "by what share?", {"": 0.6, "little": 0.3, "more": 1.0}, tag="by", opposite=lambda by: -by)
    ]


@command(typed("dent WHICH"), spoken("dent", phrase("shape_it.dent", "へこませて", "dent")))
@dataclass(frozen=True)
class Dent(Action):
    """Press a dent into a soft thing on the side that the speaker sees; depth: share of half of its smallest extent."""

    which: Which
    depth: Annotated[float, Quantity("SHARE", "how deep?", {"": 0.3, "little": 0.15, "more": 0.5}, tag="depth")] = 0.3


@command(typed("align WHICH"), spoken("align", phrase("verb.align", "そろえて", "align/line up", "揃えて")))
@dataclass(frozen=True)
class Align(Action):
    """Stand things in a row, across or ahead for the speaker, along whichever they are spread more."""

    which: Which


@command(typed("hide WHICH"), spoken("hide", phrase("verb.hide", "かくして", "hide", "隠して")))
@dataclass(frozen=True)
class Hide(Action):
    """Hide a thing; it stays where it is and still has contacts."""

    which: Which = THIS


@command(typed("show [WHICH]"), spoken("show", phrase("verb.show", "みせて", "show", "見せて")))
@dataclass(frozen=True)
class Show(Action):
    """Show a hidden thing again; "this" means all hidden things."""

    which: Which = THIS


@command(typed("copy WHICH"), spoken("copy", phrase("verb.copy", "こぴーして", "copy/duplicate", "コピーして")))
@dataclass(frozen=True)
class Copy(Action):
    """Make a copy of a thing beside it."""

    which: Which = THIS


@command(typed("delete WHICH"), spoken("delete", phrase("verb.delete", "けして", "delete/remove", "消して")))
@dataclass(frozen=True)
class Delete(Action):
    """Take a thing out of the room."""

    which: Which = THIS


@command(
    typed("create [COLOUR] SHAPE [SIZE] [WHERE]"), spoken("create", phrase("create.create", "つくって", "create/make", "作って"))
)
@dataclass(frozen=True)
class Create(Action):
    """A new thing before the speaker, or where they point. shape: one of `names.SHAPES`; size: half of its largest
    extent, of which people say the whole; colour: 0xRRGGBBAA, None for one of its own."""

    shape: Annotated[str, ShapeName()]
    size: Annotated[float, Length("LENGTH", "how large?", {"": 0.08, "large": 0.14, "small": 0.04}, by="size", unit=0.5)] = 0.04
    colour: Annotated[int | None, ColourName("colour")] = None
    where: Where = Where.HERE


@command(typed("take WHICH"), typed("snatch WHICH", force=True), spoken("grip", phrase("verb.grip", "つかんで", "take/grab/hold")))
@dataclass(frozen=True)
class Grip(Action):
    """The speaker's hand takes hold of what it touches, closed or not; by force also from others' hands."""

    which: Which = THIS
    force: bool = False


@command(typed("release [WHICH]"), spoken("release", phrase("verb.release", "はなして", "release/let go of", "放して")))
@dataclass(frozen=True)
class Release(Action):
    """Let go of a thing."""

    which: Which = THIS


@command(typed("attach WHICH to TO"), spoken("attach", phrase("attach.attach", "くっつけて", "attach/fix")))
@dataclass(frozen=True)
class Attach(Action):
    """Fix a thing to another one in their present poses; they must touch, or nearly."""

    which: Which
    to: Which


@command(typed("detach WHICH"), spoken("detach", phrase("verb.detach", "わけて", "detach/take apart", "分けて")))
@dataclass(frozen=True)
class Detach(Action):
    """Separate things that were attached."""

    which: Which = THIS


@command()
@dataclass(frozen=True)
class Present(Action):
    """Put up a panel that shows pictures, before everybody. pages: digests of polymeshes (`vistel.space.pages.sheet`), in order;
    aspect: width of every page by its height; title: name of the panel for people; live: `Pages.live`, with one page."""

    pages: tuple[str, ...]
    aspect: float
    title: str = ""
    live: bool = False


@command(
    typed("next page [WHICH]", by=1.0),
    typed("previous page [WHICH]", by=-1.0),
    typed("page PAGE"),
    spoken("next_page", phrase("alone.next_page", "つぎのぺーじ", "next page", "次のページ"), by=1.0),
    spoken("previous_page", phrase("alone.previous_page", "まえのぺーじ", "previous page", "前のページ"), by=-1.0),
)
@dataclass(frozen=True)
class TurnPage(Action):
    """Show another page on a panel. which: "this" means the speaker's newest panel, else the newest; by: so many pages on, below 0
    back; page: its number, from 1, in place of that, 0 for none."""

    which: Which = THIS
    by: Annotated[float, Quantity("COUNT", "by how many pages?", {"": 1.0})] = 0.0
    page: Annotated[float, Quantity("NUMBER", "which page?", {"": 1.0})] = 0.0


@command(typed("put away [WHICH]"))
@dataclass(frozen=True)
class PutAway(Action):
    """Take a panel out of the room; "this" as for `TurnPage`."""

    which: Which = THIS


@command(typed("new board"))
@dataclass(frozen=True)
class PutUpBoard(Action):
    """Put up a board to write on, before everybody. title: its name for people."""

    title: str = ""


@command(
    typed("note [TEXT]"), spoken("new_note", phrase("alone.new_note", "あたらしいふせん", "new note/sticky note", "新しい付箋"))
)
@dataclass(frozen=True)
class WriteNote(Action):
    """Write on a blank note of the speaker's, or else on a new one before them. text: at most 120 letters; without any, the new
    note is blank."""

    text: str = ""


@command()
@dataclass(frozen=True)
class Draw(Action):
    """Draw a stroke on a board. points: x and y of each in turn, on the grid of its face (`vistel.space.boards.stroke`); which:
    "this" means the newest board; colour: 0xRRGGBBFF, None for black; width: in units of the grid, None for that of a pen;
    stroke: what the speaker calls it: another one of the same name goes on with it."""

    points: tuple[int, ...]
    which: Which = THIS
    colour: int | None = None
    width: int | None = None
    stroke: str = ""


@command()
@dataclass(frozen=True)
class Rub(Action):
    """Rub out each stroke of a board that a way touches. points, which: as of `Draw`; width: of the way, None for that of a
    sponge."""

    points: tuple[int, ...]
    which: Which = THIS
    width: int | None = None


@command(typed("wipe [WHICH]"))
@dataclass(frozen=True)
class Wipe(Action):
    """Rub out all that is on a board; which: as of `Draw`."""

    which: Which = THIS


@command(typed("hand up"), typed("hand down", down=True))
@dataclass(frozen=True)
class RaiseHand(Action):
    """Raise the speaker's hand, so that everybody sees that they want to speak, or take it down."""

    down: bool = False


@command(typed("react REACTION"))
@dataclass(frozen=True)
class React(Action):
    """Show for three seconds what the speaker thinks of what is said."""

    reaction: Reaction


@command(typed("undo"), spoken("undo", phrase("alone.undo", "もとにもどして", "undo/undo that", "元に戻して")))
@dataclass(frozen=True)
class Undo(Action):
    """Undo the speaker's last change."""


@command(typed("redo"), spoken("redo", phrase("alone.redo", "やりなおして", "redo", "やり直して")))
@dataclass(frozen=True)
class Redo(Action):
    """Redo the speaker's last undone change."""


@command(typed("stop"), spoken("stop", phrase("alone.stop", "とめて/とまって", "stop/stop that", "止めて/止まって")))
@dataclass(frozen=True)
class Stop(Action):
    """Stop everything that the speaker's commands have set in motion."""


@command(typed("reset"), spoken("reset", phrase("alone.reset", "さいしょから", "start over/reset the room", "最初から")))
@dataclass(frozen=True)
class Reset(Action):
    """Put everything back to its beginning."""
