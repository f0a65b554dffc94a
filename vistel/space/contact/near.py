"""All contacts of several bodies, found in one call.

The result equals that of `find_contacts` for each pair, without a Python call for each.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.implicit.contacts.contact import ContactArray
from vistel.implicit.contacts.contact_search_kernels import place  # pyright: ignore[reportUnknownVariableType]
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.contact.near_kernels import (
    boxes_of,  # pyright: ignore[reportUnknownVariableType]
    find_between,  # pyright: ignore[reportUnknownVariableType]
    find_with_things,  # pyright: ignore[reportUnknownVariableType]
)

ROOM_FOR = 64
"""Contacts of each body for which there is room at first."""

NONE = ContactArray(np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
"""No contacts."""


@dataclass(frozen=True)
class PlacedPrimitives:
    """Primitives in the room with their boxes (N, 6); of spheres and cone-spheres also their parameters there (N, 8)."""

    primitives: PrimitiveSet
    cones: F64
    boxes: F64


def placed(primitives: PrimitiveSet) -> PlacedPrimitives:
    """Primitives, ready to be searched."""
    p = primitives
    out = PlacedPrimitives(p, np.empty((len(p), 8)), np.empty((len(p), 6)))
    place(p.kind, p.start, p.params, p.rotation, p.position, out.cones, out.boxes)
    return out


class Bodies:
    """Some bodies made of cone-spheres that stand in the room as `PrimitiveSet.of_cone_spheres` gives them."""

    def __init__(self, bodies: Sequence[F64]) -> None:
        """bodies: (N, 8) cone-spheres of each: ends and radii [m, room]."""
        self._first = np.zeros(len(bodies) + 1, np.int64)
        self._first[1:] = list(itertools.accumulate(len(b) for b in bodies))
        self._cones = np.concatenate([np.zeros((0, 8)), *bodies])
        self._boxes, self._hull = np.empty((len(self._cones), 6)), np.empty((len(bodies), 6))
        boxes_of(self._cones, self._first, self._boxes, self._hull)

    def with_things(self, things: PlacedPrimitives, margin: float = 0.0) -> list[ContactArray]:
        """Contacts of each body with `things`, closer than `margin` metres; b is an index into `things`."""
        ends, p = np.empty(len(self._hull), np.int64), things.primitives
        room = ROOM_FOR * (1 + len(self._hull))
        while True:
            pairs, rows = np.empty((room, 2), np.int32), np.empty((room, 8))
            count: Any = find_with_things(
                self._first,
                self._cones,
                self._boxes,
                self._hull,
                p.kind,
                p.start,
                p.params,
                p.rotation,
                p.position,
                things.cones,
                things.boxes,
                margin,
                pairs,
                rows,
                ends,
            )
            if count <= room:
                break
            room = int(count)
        return [_contacts(pairs[i:j], rows[i:j]) for i, j in itertools.pairwise([0, *ends.tolist()])]

    def with_each_other(self) -> dict[tuple[int, int], ContactArray]:
        """Contacts of every two bodies that touch, by their numbers in order."""
        room = ROOM_FOR * (1 + len(self._hull))
        while True:
            who, pairs = np.empty((room, 2), np.int64), np.empty((room, 2), np.int32)
            rows = np.empty((room, 8))
            count: Any = find_between(self._first, self._cones, self._boxes, self._hull, who, pairs, rows)
            if count <= room:
                break
            room = int(count)
        who = who[:count]
        begin = np.flatnonzero(np.concatenate([np.ones(min(1, count), np.bool_), (who[1:] != who[:-1]).any(axis=1)])).tolist()
        return {
            (a, b): _contacts(pairs[i:j], rows[i:j])
            for (a, b), i, j in zip(who[begin].tolist(), begin, [*begin, count][1:], strict=True)
        }


def _contacts(pairs: NDArray[np.int32], rows: F64) -> ContactArray:
    if len(pairs) == 0:
        return NONE
    return ContactArray(pairs[:, 0], pairs[:, 1], rows[:, 0:3], rows[:, 3:6], rows[:, 6], rows[:, 7])
