"""The world's output after a step. Room frame, metres, seconds, newtons; quaternions (x, y, z, w)."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.space.boards.stroke import Stroke
from vistel.space.hands.claims import ClaimEvent
from vistel.space.joints.buttons import ButtonEvent
from vistel.space.memory.bonds import Bond, Torn
from vistel.space.memory.dents import DentRecord
from vistel.space.signals import Signals
from vistel.space.things.things import Thing


@dataclass(frozen=True)
class ThingView:
    """The state of a thing. holders: participants, its owner first; moved: its pose changed in this step."""

    id: str
    position: F64
    rotation: F64
    velocity: F64
    spin: F64
    holders: tuple[str, ...]
    resting: bool
    moved: bool


class ContactView(NamedTuple):
    """Two bodies touch. normal: out of a, into b; depth: overlap of the undeformed surfaces [m]; force [N]."""

    body_a: str
    body_b: str
    primitive_a: int
    primitive_b: int
    point: F64
    normal: F64
    depth: float
    force: float


class GhostView(NamedTuple):
    """The field of `source`'s primitives deforms `target` (Singh §2.1). depth: of the overlap, in field units."""

    target: str
    source: str
    target_primitives: tuple[int, ...]
    source_primitives: tuple[int, ...]
    compliance_target: float
    compliance_source: float
    depth: float


@dataclass(frozen=True)
class GraspView:
    """A hand holds a thing, at `position`, `rotation` in the hand joint's frame, since `since_ns`; fingers: (20,) angles
    with which it touches the thing without entering it [rad]. The displayed thing lies at `seen_position`, `seen_rotation`
    in the displayed hand: a hand that cannot move its thing is displayed at the thing."""

    participant: str
    right: bool
    thing: str
    position: F64
    rotation: F64
    since_ns: int
    fingers: F64
    seen_position: F64
    seen_rotation: F64


@dataclass(frozen=True)
class DigitTouch:
    """One digit of a hand on one body. digit: thumb 0 to little finger 4, palm 5.

    point: centre of pressure [m]; normal: out of the hand, into the body; force on the hand [N], friction included;
    normal_force [N] without it; area [m^2]; mean and peak pressure [Pa]; depth: of the undeformed surfaces' overlap [m].
    """

    digit: int
    body: str
    point: F64
    normal: F64
    force: F64
    normal_force: float
    area: float
    mean_pressure: float
    peak_pressure: float
    depth: float


@dataclass(frozen=True)
class HandForce:
    """Force on a hand [N], torque about its joint [N m], and its touches by digit and body. No touches: the contact ended.

    pull: (3,) the part of the force with which others pull at the held thing [N].
    """

    participant: str
    right: bool
    force: F64
    torque: F64
    touches: tuple[DigitTouch, ...]
    pull: F64 = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class Outcome:
    """The outcome of a command. reason: one line for a person, empty when done; things: ids of the changed or created things."""

    id: str
    participant: str
    done: bool
    reason: str
    step: int
    things: tuple[str, ...] = ()


@dataclass(frozen=True)
class WorldView:
    """The room after step `step`, at conference time `t_ns`.

    things: all there are; changed: things came or went in this step; hash: of the whole state, once a second, else 0; hands: hand
    forces, and one last empty one when a contact has ended; dents, bonds, strokes: all there are; fresh: numbers of new or changed
    dents, bonds and strokes; gone: numbers of those that ended in this step; claims: changes of claims; torn: bonds torn in this
    step; buttons: those that were pressed or released in it.
    """

    step: int
    t_ns: int
    things: tuple[Thing, ...]
    changed: bool
    states: tuple[ThingView, ...]
    contacts: tuple[ContactView, ...]
    ghosts: tuple[GhostView, ...]
    grasps: tuple[GraspView, ...]
    participants: tuple[str, ...]
    outcomes: tuple[Outcome, ...]
    hash: int
    hands: tuple[HandForce, ...] = ()
    dents: tuple[DentRecord, ...] = ()
    bonds: tuple[Bond, ...] = ()
    fresh: frozenset[int] = frozenset()
    gone: tuple[int, ...] = ()
    claims: tuple[ClaimEvent, ...] = ()
    selected: tuple[tuple[str, tuple[str, ...]], ...] = ()
    """Participants with the ids of the things that they have selected."""
    torn: tuple[Torn, ...] = ()
    buttons: tuple[ButtonEvent, ...] = ()
    strokes: tuple[Stroke, ...] = ()
    signals: Signals = field(default_factory=Signals)
