"""Free things: gravity, collisions, friction, rest. Semi-implicit, with soft contacts in small steps.

Contacts are found once a step, between the contact points of one thing and the primitives of another; a step is cut into
substeps, in each of which impulses at the contacts are iterated (Catto, "Solver2D", 2024: soft step). Nothing here
depends on the order of a set or a dictionary, and no thread is started: equal inputs give equal bytes.
"""

import math
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, I64
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.dynamics.collide_kernels import PUSHER, WIDTH, detect  # pyright: ignore[reportUnknownVariableType]
from vistel.space.dynamics.motion_kernels import matrices, solve  # pyright: ignore[reportUnknownVariableType]
from vistel.space.dynamics.solids import Solids, pose_solids
from vistel.space.joints.joint_kernels import wake  # pyright: ignore[reportUnknownVariableType]

FIXED = 0
"""Nothing moves the thing."""
FREE = 1
"""Forces move the thing."""
ASLEEP = 2
"""Nothing moves the thing until it is touched."""
HELD = 3
"""A hand moves the thing."""

MOST_CONTACTS = 768
"""Contacts there is room for, whatever the number of things."""
CONTACTS_OF_EACH = 4
"""Further contacts there is room for, per thing."""


@dataclass(frozen=True)
class Motions:
    """How N things move: position (N, 3) [m], rotation (N, 4) quaternions (x, y, z, w), velocity (N, 3) [m/s],
    spin (N, 3) [rad/s], mode (N,), still (N,) steps without motion. Room frame."""

    position: F64
    rotation: F64
    velocity: F64
    spin: F64
    mode: I64
    still: I64

    def copy(self) -> "Motions":
        """The same in arrays of its own."""
        return Motions(
            self.position.copy(), self.rotation.copy(), self.velocity.copy(), self.spin.copy(), self.mode.copy(), self.still.copy()
        )

    def matrices(self) -> F64:
        """(N, 3, 3) rotations, thing to room."""
        out = np.empty((len(self.rotation), 3, 3))
        matrices(self.rotation, out)
        return out


@dataclass(frozen=True)
class Pushes:
    """K contacts of things with what no impulse moves (people): thing (K,), point (K, 3), normal (K, 3) into the
    thing, gap (K,) [m], velocity (K, 3) of the pusher there [m/s]."""

    thing: I64
    point: F64
    normal: F64
    gap: F64
    velocity: F64

    @staticmethod
    def none() -> "Pushes":
        """No contact."""
        e = np.zeros((0, 3))
        return Pushes(np.zeros(0, np.int64), e, e, np.zeros(0), e)


@dataclass(frozen=True)
class Touches:
    """K contacts between things this step: a, b (K,) things, primitive_b (K,) of b (index within b), point (K, 3),
    normal (K, 3) out of b into a, gap (K,) [m], force (K,) [N]. b = -1: the floor."""

    a: I64
    b: I64
    primitive_b: I64
    point: F64
    normal: F64
    gap: F64
    force: F64


LONGEST = 1.0 / 60.0
"""Contacts are found anew at least this often [s]; a longer step is cut into pieces."""


def advance(s: Solids, m: Motions, pushes: Pushes, dt: float) -> tuple[Motions, Touches]:
    """The things `dt` seconds later, and their contacts. Held things move with their velocity and spin.

    A long dt is cut into pieces; the pushes are those of the first piece.
    """
    pieces = max(1, math.ceil(dt / LONGEST - 1e-6))
    for _ in range(pieces - 1):
        m, _ = _advance(s, m, pushes, dt / pieces)
        pushes = Pushes.none()
    return _advance(s, m, pushes, dt / pieces)


def _advance(s: Solids, m: Motions, pushes: Pushes, dt: float) -> tuple[Motions, Touches]:
    out = m.copy()
    most = MOST_CONTACTS + CONTACTS_OF_EACH * len(m.mode)
    contacts, pairs = np.empty((most, WIDTH)), np.empty((most, 3), np.int64)
    count, woken = 0, True
    if s.joined.joints:
        wake(s.joined.ends, out.velocity, out.spin, out.mode, out.still)
    rotation = out.matrices()
    posed: PrimitiveSet = pose_solids(s, rotation, out.position)
    for _ in range(3):  # a woken thing may wake the next
        count, woken = detect(  # pyright: ignore[reportUnknownVariableType]
            s.first,
            posed.kind,
            posed.start,
            posed.params,
            posed.rotation,
            posed.position,
            s.contact_point_first,
            s.contact_point,
            s.contact_point_radius,
            s.radius,
            s.bound,
            rotation,
            s.centre,
            out.position,
            out.velocity,
            out.spin,
            out.mode,
            out.still,
            pushes.thing,
            pushes.point,
            pushes.normal,
            pushes.gap,
            pushes.velocity,
            s.joined.apart,
            dt,
            pairs,
            contacts,
        )
        if not woken:
            break
    solve(
        s.inverse_mass,
        s.inverse_inertia,
        out.position,
        out.rotation,
        out.velocity,
        out.spin,
        out.mode,
        out.still,
        pairs[:count],
        contacts[:count],
        s.joined.rows,
        s.joined.ends,
        dt,
    )
    between = pairs[:count, 1] != PUSHER
    c, p = contacts[:count][between], pairs[:count][between]
    return out, Touches(p[:, 0], p[:, 1], p[:, 2], c[:, 0:3], c[:, 3:6], c[:, 21], c[:, 22] / dt)


def wake_around(s: Solids, m: Motions, centre: F64, radius: float) -> Motions:
    """Asleep things within `radius` metres of `centre` (3,) wake: their support may be gone."""
    near = np.sqrt(((m.position - centre) ** 2).sum(axis=1)) < radius + s.radius + 0.01
    chosen = near & (m.mode == ASLEEP)
    out = m.copy()
    out.mode[chosen], out.still[chosen] = FREE, 0
    return out
