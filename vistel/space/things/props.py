"""Tracked things: they go where their own receiver is, or where a mouse leads them, for as long as it speaks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix
from vistel.space.inputs import FURTHEST, PropInput

SILENT_NS = 500_000_000
"""A thing whose tracker has said nothing for so long is an ordinary thing again."""


MOST_AHEAD_NS = 60_000_000
"""A pose is carried on by its speed for no longer than this."""
FASTEST = 10.0
"""A greater speed is a tracker's jump [m/s]."""
MOST_SPIN = 50.0
"""Faster turning is a tracker's jump [rad/s]."""


@dataclass(frozen=True)
class Tracked:
    """A thing that follows its tracker, or a mouse. heard_ns: time of the step that heard `news` of it; stood: position (3,) and
    rotation (4,) where it was before the mouse had it."""

    news: PropInput
    heard_ns: int
    stood: tuple[F64, F64] | None = None

    @property
    def thing(self) -> str:
        """Id of the thing it moves."""
        return self.news.thing

    def at(self, t_ns: int, before_s: float = 0.0) -> tuple[F64, F64]:
        """Position (3,) [m] and rotation (4,) at the step about `t_ns`: carried on from the measurement, so that a
        picture of that instant has it in the hand. before_s: so long before that, as its speed has it [s]."""
        ahead = 1e-9 * min(MOST_AHEAD_NS, max(0, t_ns - self.news.t_ns)) - before_s
        turn = matrix_from_rotvec(self.news.spin * ahead) @ matrix_from_quaternion(self.news.rotation)
        return self.news.position + self.news.velocity * ahead, quaternion_from_matrix(turn)


def usable(prop: PropInput) -> bool:
    """Its numbers are finite, its place within the world, its rotation one, its speeds a thing's."""
    p, q, v, w = prop.position, prop.rotation, prop.velocity, prop.spin
    if (p.shape, q.shape, v.shape, w.shape) != ((3,), (4,), (3,), (3,)):
        return False
    if not all(bool(np.isfinite(n).all()) for n in (p, q, v, w)):
        return False
    slow = float(np.sqrt(v @ v)) < FASTEST and float(np.sqrt(w @ w)) < MOST_SPIN
    return slow and float(np.abs(p).max()) < FURTHEST and 0.9 < float(np.sqrt(q @ q)) < 1.1


def heard(
    tracked: Sequence[Tracked], news: Iterable[PropInput], things: Iterable[str], t_ns: int
) -> tuple[tuple[Tracked, ...], tuple[Tracked, ...]]:
    """What is tracked at the step about `t_ns`, sorted, and what is so no longer: let go of, as its news then say, or silent.
    things: loose things there are. No mouse takes what a tracker, or another mouse, has."""
    known = frozenset(things)
    now = {old.thing: old for old in tracked if old.thing in known}
    for prop in news:
        old = now.get(prop.thing)
        taken = old is not None and prop.led_by not in ("", old.news.led_by)
        if prop.thing not in known or not usable(prop) or taken or (old is None and prop.let_go):
            continue
        rotation = prop.rotation / float(np.sqrt(prop.rotation @ prop.rotation))
        stood = old.stood if old is not None and old.news.led_by == prop.led_by else None
        now[prop.thing] = Tracked(replace(prop, rotation=rotation), t_ns, stood)
    over = {name: t for name, t in now.items() if t.news.let_go or t_ns - t.heard_ns > SILENT_NS}
    return tuple(now[name] for name in sorted(now) if name not in over), tuple(over[name] for name in sorted(over))
