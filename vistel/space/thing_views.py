"""The published states of things. A thing at rest keeps the view of the step before."""

import numpy as np
from numpy.typing import NDArray

from vistel.space.dynamics.dynamics import ASLEEP, FIXED, Motions
from vistel.space.dynamics.motion_kernels import changed  # pyright: ignore[reportUnknownVariableType]
from vistel.space.hands.grasp import Grasp
from vistel.space.state import State
from vistel.space.view import ThingView

_NOTHING = ThingView("", np.zeros(3), np.zeros(4), np.zeros(3), np.zeros(3), (), True, False)


class ThingViews:
    """Makes the views of things, step by step. It keeps the last ones only to save time."""

    def __init__(self) -> None:
        self._last: tuple[ThingView, ...] = ()
        self._moved: NDArray[np.bool_] = np.zeros(0, np.bool_)
        self._of: Motions | None = None

    def states(self, before: State, now: State) -> tuple[ThingView, ...]:
        """The view of every thing, in the order of the things."""
        m = now.motions
        moved, same = _compared(before, now)
        held, held_before = _holders(now.grasps), _holders(before.grasps)
        for thing in held.keys() | held_before.keys():
            if held.get(thing) != held_before.get(thing) and thing in now.rows:
                moved[now.rows[thing]] = True
        follows = self._of is before.motions and _same_things(before, now)
        fresh = moved | self._moved | ~same if follows else np.ones(len(now.things), np.bool_)
        out: list[ThingView] = list(self._last) if follows else [_NOTHING] * len(now.things)
        for n in np.flatnonzero(fresh).tolist():
            out[n] = ThingView(
                now.things[n].id,
                m.position[n],
                m.rotation[n],
                m.velocity[n],
                m.spin[n],
                held.get(now.things[n].id, ()),
                int(m.mode[n]) in (FIXED, ASLEEP),
                bool(moved[n]),
            )
        self._last, self._moved, self._of = tuple(out), moved, now.motions
        return self._last


def _compared(before: State, now: State) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(N,) whether each thing's pose or mode changed, and (N,) whether nothing of it changed."""
    m, old = now.motions, before.motions
    pose, speed = np.empty(len(now.things), np.bool_), np.empty(len(now.things), np.bool_)
    rows = None
    if not _same_things(before, now):
        rows = np.array([before.rows.get(t.id, -1) for t in now.things], np.int64)
        old = Motions(*(getattr(old, name)[rows] for name in Motions.__dataclass_fields__))
    changed(
        m.position,
        m.rotation,
        m.velocity,
        m.spin,
        m.mode,
        old.position,
        old.rotation,
        old.velocity,
        old.spin,
        old.mode,
        pose,
        speed,
    )
    if rows is not None:
        pose |= rows < 0
    return pose, ~(pose | speed)


def _same_things(before: State, now: State) -> bool:
    """Whether the rows mean the same things."""
    return now.things is before.things or [t.id for t in now.things] == [t.id for t in before.things]


def _holders(grasps: tuple[Grasp, ...]) -> dict[str, tuple[str, ...]]:
    """Participants who hold each held thing, in the order in which they took it."""
    out: dict[str, list[str]] = {}
    for g in grasps:
        out.setdefault(g.thing, []).append(g.participant)
    return {thing: tuple(dict.fromkeys(who)) for thing, who in out.items()}
