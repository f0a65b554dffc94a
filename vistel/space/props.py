"""Tracked things: they go where their own receiver is, for as long as it speaks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.space.inputs import FURTHEST, PropInput

F64 = NDArray[np.float64]

SILENT_NS = 500_000_000
"""A thing whose tracker has said nothing for so long is an ordinary thing again."""


@dataclass(frozen=True)
class Tracked:
    """A thing that follows its tracker: position (3,) [m], rotation (4,) quaternion (x, y, z, w), room frame.

    heard_ns: time of the step that heard of it last.
    """

    thing: str
    position: F64
    rotation: F64
    heard_ns: int


def usable(prop: PropInput) -> bool:
    """Its numbers are finite, its place within the world, its rotation one."""
    p, q = prop.position, prop.rotation
    if p.shape != (3,) or q.shape != (4,) or not (np.isfinite(p).all() and np.isfinite(q).all()):
        return False
    return float(np.abs(p).max()) < FURTHEST and 0.9 < float(np.sqrt(q @ q)) < 1.1


def heard(
    tracked: Sequence[Tracked], news: Iterable[PropInput], things: Iterable[str], t_ns: int
) -> tuple[tuple[Tracked, ...], tuple[str, ...]]:
    """What is tracked at the step about `t_ns`, sorted, and what has fallen silent. things: loose things there are."""
    known = frozenset(things)
    now = {old.thing: old for old in tracked if old.thing in known}
    for prop in news:
        if prop.thing in known and usable(prop):
            rotation = prop.rotation / float(np.sqrt(prop.rotation @ prop.rotation))
            now[prop.thing] = Tracked(prop.thing, prop.position, rotation, t_ns)
    silent = tuple(name for name in sorted(now) if t_ns - now[name].heard_ns > SILENT_NS)
    return tuple(now[name] for name in sorted(now) if name not in silent), silent
