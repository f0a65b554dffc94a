"""The world's whole state between two steps."""

from dataclasses import dataclass, field, fields
from typing import Any

from vistel.space.boards.stroke import Stroke
from vistel.space.dynamics.dynamics import Motions
from vistel.space.hands.approach import Approach
from vistel.space.hands.claims import Claim, ClaimEvent
from vistel.space.hands.grasp import Grasp
from vistel.space.history import History
from vistel.space.ledger import Ledger
from vistel.space.memory.bonds import Bond
from vistel.space.memory.dents import DentRecord
from vistel.space.people import PersonState
from vistel.space.signals import Signals
from vistel.space.things.glide import Glide
from vistel.space.things.props import Tracked
from vistel.space.things.things import Thing


@dataclass(frozen=True)
class LetGo:
    """A hand that released a thing, or began to close round it, at `step`. It does not push the thing until it is away from it."""

    participant: str
    right: bool
    thing: str
    step: int


@dataclass(frozen=True)
class Pen:
    """A hand that writes on a board. number: of its stroke, 0 while it rubs; x, y: where it was last, on the grid."""

    participant: str
    right: bool
    board: str
    number: int
    x: int
    y: int


@dataclass(frozen=True)
class Gesture:
    """What somebody holds a hand for, since which step (`vistel.space.gestures`)."""

    participant: str
    kind: str
    since: int


@dataclass(frozen=True)
class State:
    """things: in the order of `motions`; figures: sorted by name; grasps: oldest first;
    approaches: by hand and thing; tracked: sorted by thing;
    felt: hands (participant, right) with a hand force, sorted; dents, bonds: by thing; marks: the next
    number of a dent, bond or stroke; glides: things that commands move; selected: participants with the things that "this" means to
    them, sorted; history: changes by commands; claims: owners of held things, by thing; claim_events: within a step only;
    pressed: ids of the joints whose buttons are pressed, sorted; strokes: by number; pens: hands that write, by participant and
    hand; signals: raised hands and reactions; gestures: by participant and kind."""

    things: tuple[Thing, ...]
    motions: Motions
    step: int = 0
    t_ns: int = 0
    figures: tuple[PersonState, ...] = ()
    grasps: tuple[Grasp, ...] = ()
    let_go: tuple[LetGo, ...] = ()
    approaches: tuple[Approach, ...] = ()
    ledger: Ledger = field(default_factory=Ledger)
    tracked: tuple[Tracked, ...] = ()
    felt: tuple[tuple[str, bool], ...] = ()
    dents: tuple[DentRecord, ...] = ()
    bonds: tuple[Bond, ...] = ()
    marks: int = 1
    glides: tuple[Glide, ...] = ()
    selected: tuple[tuple[str, tuple[str, ...]], ...] = ()
    history: History = field(default_factory=History)
    claims: tuple[Claim, ...] = ()
    claim_events: tuple[ClaimEvent, ...] = ()
    pressed: tuple[str, ...] = ()
    strokes: tuple[Stroke, ...] = ()
    pens: tuple[Pen, ...] = ()
    signals: Signals = field(default_factory=Signals)
    gestures: tuple[Gesture, ...] = ()

    def but(self, **changes: Any) -> "State":
        """As `dataclasses.replace`, in a sixth of the time: a step makes a dozen states, each of twenty values."""
        if not changes.keys() <= _NAMES:
            raise TypeError(f"a state has no {', '.join(sorted(changes.keys() - _NAMES))}")
        made = object.__new__(State)
        made.__dict__.update(self.__dict__)
        made.__dict__.update(changes)
        return made

    @property
    def rows(self) -> dict[str, int]:
        """Row of each thing, by its id."""
        return _rows_of(self.things)


_NAMES = frozenset(f.name for f in fields(State))

_LAST_ROWS: list[tuple[tuple[Thing, ...], dict[str, int]]] = [((), {})]


def _rows_of(things: tuple[Thing, ...]) -> dict[str, int]:
    """Row of each thing by its id. It is kept, because things change far less often than it is used."""
    if _LAST_ROWS[0][0] is not things:
        _LAST_ROWS[0] = things, {thing.id: n for n, thing in enumerate(things)}
    return _LAST_ROWS[0][1]
