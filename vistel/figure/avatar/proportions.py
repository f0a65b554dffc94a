"""The part of an avatar that contacts need: its joint chain and its primitives, without its skin.

It fits into one small message, so that the world's contacts and stand-ins are right before the avatar has arrived.
Numbers are kept as float32, so that sender, re-run and renderer compute with equal ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64
from vistel.figure.body import Body
from vistel.figure.skeleton import JOINTS, Skeleton

MOST_PRIMITIVES = 200
MOST_NAME = 48
FURTHEST = 3.5
"""Ends of bones and primitives lie no further from the origin than this [m]."""
THICKEST = 0.6
"""Radius of a primitive, at most [m]."""
THINNEST = 0.0005
"""Radius of a primitive, at least [m]."""
SHORTEST = 0.45
"""Height of a person, at least [m]: a little below what a conference file allows."""
TALLEST = 2.7
"""Height of a person, at most [m]: a little above what a conference file allows."""
_J = len(JOINTS)


@dataclass(frozen=True)
class Proportions:
    """Joint chain and primitives of a person, comparable and hashable. Make it with `of` or `from_arrays`.

    names: of the P primitives; numbers: little-endian float32 of rest (J, 3), tip (J, 3), a (P, 3), b (P, 3),
    radius_a (P,), radius_b (P,); joint: (P,).
    """

    names: tuple[str, ...]
    joint: tuple[int, ...]
    numbers: bytes

    @staticmethod
    def of(skeleton: Skeleton, body: Body) -> "Proportions":
        """Those of an avatar. Raises ValueError for impossible proportions."""
        return Proportions.from_arrays(
            body.names, body.joint.tolist(), skeleton.rest, skeleton.tip, body.a, body.b, body.radius_a, body.radius_b
        )

    @staticmethod
    def from_arrays(
        names: Sequence[str],
        joint: Sequence[int],
        rest: ArrayLike,
        tip: ArrayLike,
        a: ArrayLike,
        b: ArrayLike,
        radius_a: ArrayLike,
        radius_b: ArrayLike,
    ) -> "Proportions":
        """Checked: they may have come over a network. Raises ValueError, one line."""
        count = len(names)
        if not 1 <= count <= MOST_PRIMITIVES or len(joint) != count:
            raise ValueError(f"proportions: {count} primitives with {len(joint)} joints, expected 1 to {MOST_PRIMITIVES}")
        sizes = (3 * _J, 3 * _J, 3 * count, 3 * count, count, count)
        parts = [np.asarray(x, "<f4").ravel() for x in (rest, tip, a, b, radius_a, radius_b)]
        if tuple(p.size for p in parts) != sizes:
            raise ValueError(f"proportions: {[p.size for p in parts]} numbers, expected {list(sizes)}")
        if not all(bool(np.isfinite(p).all()) for p in parts):
            raise ValueError("proportions: numbers that are not finite")
        if any(len(n) > MOST_NAME for n in names) or any(not 0 <= j < _J for j in joint):
            raise ValueError(f"proportions: a name of more than {MOST_NAME} letters, or a joint beyond {_J - 1}")
        if max(float(np.abs(p).max()) for p in parts[:4]) > FURTHEST:
            raise ValueError(f"proportions: more than {FURTHEST} m across")
        radii = np.concatenate(parts[4:])
        if float(radii.min()) < THINNEST or float(radii.max()) > THICKEST:
            raise ValueError(f"proportions: radii of {radii.min():.4g} to {radii.max():.4g} m")
        out = Proportions(tuple(names), tuple(int(j) for j in joint), b"".join(p.tobytes() for p in parts))
        if not SHORTEST <= out.skeleton.height <= TALLEST:
            raise ValueError(f"proportions: of somebody {out.skeleton.height:.2f} m tall")
        return out

    @cached_property
    def arrays(self) -> tuple[F64, F64, F64, F64, F64, F64]:
        """rest, tip (J, 3), a, b (P, 3), radius_a, radius_b (P,)."""
        flat = np.frombuffer(self.numbers, "<f4").astype(np.float64)
        p = len(self.names)
        rest, tip, a, b, ra, rb = np.split(flat, np.cumsum([3 * _J, 3 * _J, 3 * p, 3 * p, p]))
        return rest.reshape(-1, 3), tip.reshape(-1, 3), a.reshape(-1, 3), b.reshape(-1, 3), ra, rb

    @cached_property
    def skeleton(self) -> Skeleton:
        """The joint chain."""
        return Skeleton(*self.arrays[:2])

    @cached_property
    def body(self) -> Body:
        """The primitives."""
        return Body(self.names, np.array(self.joint, np.int32), *self.arrays[2:])
