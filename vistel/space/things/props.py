"""Tracked things: they follow their own receiver, or a mouse, as long as its measurements arrive."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix
from vistel.space.inputs import FURTHEST, PropInput

SILENT_NS = 500_000_000
"""A thing without a measurement for so long is an ordinary thing again."""


MOST_AHEAD_NS = 60_000_000
"""A pose is carried on by its speed for no longer than this."""
FASTEST = 10.0
"""A greater speed is a tracker's jump [m/s]."""
MOST_SPIN = 50.0
"""Faster turning is a tracker's jump [rad/s]."""


@dataclass(frozen=True)
class Tracked:
    """A thing that follows its tracker, or a mouse. received_ns: time of the step that received `measured`; begun_at: position
    (3,) and rotation (4,) before the mouse took it."""

    measured: PropInput
    received_ns: int
    begun_at: tuple[F64, F64] | None = None

    @property
    def thing(self) -> str:
        """Id of the thing it moves."""
        return self.measured.thing

    def at(self, t_ns: int, before_s: float = 0.0) -> tuple[F64, F64]:
        """Position (3,) [m] and rotation (4,) at the step about `t_ns`: carried on from the measurement, so that a
        picture of that instant has it in the hand. before_s: so long before that, as its speed has it [s]."""
        ahead = 1e-9 * min(MOST_AHEAD_NS, max(0, t_ns - self.measured.t_ns)) - before_s
        turn = matrix_from_rotvec(self.measured.spin * ahead) @ matrix_from_quaternion(self.measured.rotation)
        return self.measured.position + self.measured.velocity * ahead, quaternion_from_matrix(turn)


def usable(prop: PropInput) -> bool:
    """Whether its numbers are finite, its position in the world, its rotation a unit quaternion, and its speeds possible."""
    p, q, v, w = prop.position, prop.rotation, prop.velocity, prop.spin
    if (p.shape, q.shape, v.shape, w.shape) != ((3,), (4,), (3,), (3,)):
        return False
    if not all(bool(np.isfinite(n).all()) for n in (p, q, v, w)):
        return False
    slow = float(np.sqrt(v @ v)) < FASTEST and float(np.sqrt(w @ w)) < MOST_SPIN
    return slow and float(np.abs(p).max()) < FURTHEST and 0.9 < float(np.sqrt(q @ q)) < 1.1


def received(
    tracked: Sequence[Tracked], measured: Iterable[PropInput], things: Iterable[str], t_ns: int
) -> tuple[tuple[Tracked, ...], tuple[Tracked, ...]]:
    """The tracked things at the step of `t_ns`, sorted, and those that end: let go, or without measurements. things: ids of the
    loose things. A mouse cannot take a thing that has a tracker or another mouse."""
    known = frozenset(things)
    now = {old.thing: old for old in tracked if old.thing in known}
    for prop in measured:
        old = now.get(prop.thing)
        taken = old is not None and prop.led_by not in ("", old.measured.led_by)
        if prop.thing not in known or not usable(prop) or taken or (old is None and prop.let_go):
            continue
        rotation = prop.rotation / float(np.sqrt(prop.rotation @ prop.rotation))
        begun_at = old.begun_at if old is not None and old.measured.led_by == prop.led_by else None
        now[prop.thing] = Tracked(replace(prop, rotation=rotation), t_ns, begun_at)
    over = {name: t for name, t in now.items() if t.measured.let_go or t_ns - t.received_ns > SILENT_NS}
    return tuple(now[name] for name in sorted(now) if name not in over), tuple(over[name] for name in sorted(over))
