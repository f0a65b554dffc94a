"""What the world says after a step. Room frame, metres, seconds, newtons; quaternions (x, y, z, w)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.space.things import Thing

F64 = NDArray[np.float64]


@dataclass(frozen=True)
class ThingView:
    """Where a thing is. holders: participants, first the one who carries it; moved: since the step before."""

    id: str
    position: F64
    rotation: F64
    velocity: F64
    spin: F64
    holders: tuple[str, ...]
    resting: bool
    moved: bool


@dataclass(frozen=True)
class ContactView:
    """Two bodies touch. normal: out of a, into b; depth: overlap of the undeformed surfaces [m]; force [N]."""

    body_a: str
    body_b: str
    primitive_a: int
    primitive_b: int
    point: F64
    normal: F64
    depth: float
    force: float


@dataclass(frozen=True)
class GhostView:
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
    """A hand holds a thing, at `position`, `rotation` in the hand joint's frame, since `since_ns`."""

    participant: str
    right: bool
    thing: str
    position: F64
    rotation: F64
    since_ns: int


@dataclass(frozen=True)
class Outcome:
    """What became of a command; reason: one line for a person, empty when done."""

    id: str
    participant: str
    done: bool
    reason: str
    step: int


@dataclass(frozen=True)
class WorldView:
    """The room after step `step`, at conference time `t_ns`.

    things: all there are; changed: things came or went in this step; hash: of the whole state, once a second, else 0.
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
