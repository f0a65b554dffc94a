"""What is said about where things are: what lies still is said in the words of the step before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vistel.space.dynamics import ASLEEP, FIXED
from vistel.space.grasp import Grasp
from vistel.space.state import State
from vistel.space.view import ThingView


class ThingViews:
    """Makes the views of things, step by step. What it keeps saves time and changes nothing."""

    def __init__(self) -> None:
        self._last: dict[str, ThingView] = {}

    def states(self, before: State, now: State) -> tuple[ThingView, ...]:
        """Where every thing is, in the order of the things."""
        m = now.motions
        moved, same = _compared(before, now)
        held, held_before = _holders(now.grasps), _holders(before.grasps)
        resting = np.isin(m.mode, (FIXED, ASLEEP)).tolist()
        out: list[ThingView] = []
        for n, (thing, has_moved, is_same) in enumerate(zip(now.things, moved.tolist(), same.tolist(), strict=True)):
            holders = held.get(thing.id, ())
            has_moved = has_moved or holders != held_before.get(thing.id, ())  # noqa: PLW2901
            last = self._last.get(thing.id)
            if last is not None and is_same and not has_moved and not last.moved:
                out.append(last)
                continue
            out.append(
                ThingView(
                    thing.id, m.position[n], m.rotation[n], m.velocity[n], m.spin[n], holders, resting[n], has_moved
                )
            )
        self._last = {view.id: view for view in out}
        return tuple(out)


def _compared(before: State, now: State) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(N,) which things are elsewhere or move by other means than before, and which are the same in all."""
    m, old = now.motions, before.motions
    rows = slice(None)
    known = np.ones(len(now.things), np.bool_)
    if now.things is not before.things:
        rows = np.array([before.rows.get(t.id, -1) for t in now.things], np.int64)
        known = rows >= 0
    pose = (m.position == old.position[rows]).all(axis=1) & (m.rotation == old.rotation[rows]).all(axis=1)
    pose &= known & (m.mode == old.mode[rows])
    same = pose & (m.velocity == old.velocity[rows]).all(axis=1) & (m.spin == old.spin[rows]).all(axis=1)
    return ~pose, same


def _holders(grasps: tuple[Grasp, ...]) -> dict[str, tuple[str, ...]]:
    """Who holds each thing that is held, in the order in which they took it."""
    out: dict[str, list[str]] = {}
    for g in grasps:
        out.setdefault(g.thing, []).append(g.participant)
    return {thing: tuple(dict.fromkeys(who)) for thing, who in out.items()}
