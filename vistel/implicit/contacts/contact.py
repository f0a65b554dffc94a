"""Contacts between posed primitives: which pairs touch, where, how deep.

Broad phase: boxes of the two sets against each other, then box against box. Narrow phase: cone-sphere against
cone-sphere by alternating closed-form feet; cone-sphere against anything else by a bracketed search along the
skeleton; the rest through probe points on the surface of the first. Everything is deterministic: the same
input gives the same list, ordered by the first primitive, then by the second.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32
from vistel.implicit.contacts.contact_search_kernels import find_among, find_pairs  # pyright: ignore[reportUnknownVariableType]
from vistel.implicit.contacts.contact_set import PrimitiveSet


class ConeSpheres(Protocol):
    """P cone-spheres in the room: a, b (P, 3) skeleton ends, radius_a, radius_b (P,) of the surface [m].

    `vistel.figure.body.PosedBody` is one.
    """

    @property
    def a(self) -> F64:
        """(N, 3) one end of each limb [m]."""
        ...

    @property
    def b(self) -> F64:
        """(N, 3) the other end [m]."""
        ...

    @property
    def radius_a(self) -> F64:
        """(N,) surface radius at a [m]."""
        ...

    @property
    def radius_b(self) -> F64:
        """(N,) the same at b [m]."""
        ...


@dataclass(frozen=True)
class ContactArray:
    """N contacts between a set A and a set B of primitives, ordered by (a, b).

    a, b: (N,) indices into the sets. point: (N, 3) where the two fields are equal [m, room]. normal: (N, 3)
    unit vectors there, from A towards B. depth: (N,) how far surfaces interpenetrate [m]; negative: a gap,
    reported only within the margin. field_depth: (N,) delta = min(F_a, F_b) - T at `point`, with the quartic
    and T = 0.5, which scales the propagation of collision ghosts; negative for a gap.
    """

    a: I32
    b: I32
    point: F64
    normal: F64
    depth: F64
    field_depth: F64

    def __len__(self) -> int:
        return len(self.a)


def find_contacts(a: PrimitiveSet, b: PrimitiveSet, *, margin: float = 0.0, skip: NDArray[np.bool_] | None = None) -> ContactArray:
    """Every pair of a primitive of `a` and one of `b` whose surfaces come closer than `margin` metres.

    skip: (len(a), len(b)) pairs to leave out, for contacts of a body with itself: pass the same set twice and
    skip neighbours and one triangle of the matrix.
    """
    if skip is None:
        skip = np.zeros((0, 0), np.bool_)
    elif skip.shape != (len(a), len(b)):
        raise ValueError(f"skip: expected shape ({len(a)}, {len(b)}), got {skip.shape}")
    capacity = 32
    while True:
        pairs, rows = np.empty((capacity, 2), np.int32), np.empty((capacity, 8))
        count = find_pairs(
            a.kind,
            a.start,
            a.params,
            a.rotation,
            a.position,
            b.kind,
            b.start,
            b.params,
            b.rotation,
            b.position,
            skip,
            float(margin),
            pairs,
            rows,
        )
        if count <= capacity:
            break
        capacity = 2 * count
    pairs, rows = pairs[:count], rows[:count]
    return ContactArray(pairs[:, 0], pairs[:, 1], rows[:, 0:3], rows[:, 3:6], rows[:, 6], rows[:, 7])


class ContactScene:
    """Several bodies and all contacts between them, found in one call without allocating.

    bodies: the primitives of each; `primitives` holds them joined, body b's being first[b] : first[b + 1].
    Place a body by writing to the arrays of `primitives` (position, rotation, params) in place.
    """

    def __init__(self, bodies: Sequence[PrimitiveSet]) -> None:
        self.primitives = PrimitiveSet.join(bodies)
        self.first: I32 = np.cumsum([0] + [len(b) for b in bodies]).astype(np.int32)
        count = len(self.primitives)
        self._cones, self._boxes, self._hull = np.empty((count, 8)), np.empty((count, 6)), np.empty((len(bodies), 6))
        self._near, self._row = np.empty(count, np.int32), np.empty(8)
        self._pairs, self._rows = np.empty((64, 2), np.int32), np.empty((64, 8))

    def place_cone_spheres(self, body: int, posed: ConeSpheres) -> None:
        """Set a body made of cone-spheres by `PrimitiveSet.of_cone_spheres` to where `posed` is."""
        rows = self.primitives.params[self.primitives.start[self.first[body]] : self.primitives.start[self.first[body + 1]]]
        table = rows.reshape(-1, 8)
        table[:, 0:3], table[:, 3:6] = posed.a, posed.b
        table[:, 6], table[:, 7] = posed.radius_a, posed.radius_b

    def find(self, *, margin: float = 0.0) -> ContactArray:
        """Every pair of primitives of different bodies closer than `margin` metres, a and b being indices
        into `primitives`, ordered by body, then by primitive. The arrays are valid until the next call."""
        p = self.primitives
        while True:
            count = find_among(
                self.first,
                p.kind,
                p.start,
                p.params,
                p.rotation,
                p.position,
                float(margin),
                self._cones,
                self._boxes,
                self._hull,
                self._near,
                self._row,
                self._pairs,
                self._rows,
            )
            if count <= len(self._pairs):
                break
            self._pairs, self._rows = np.empty((2 * count, 2), np.int32), np.empty((2 * count, 8))
        pairs, rows = self._pairs[:count], self._rows[:count]
        return ContactArray(pairs[:, 0], pairs[:, 1], rows[:, 0:3], rows[:, 3:6], rows[:, 6], rows[:, 7])
