"""Things as flat arrays for the kernels: posed primitives, contact points on the surface, mass and inertia."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.space.boards.board import SHAPE as BOARD
from vistel.space.contact.contact_points import contact_points_of
from vistel.space.contact.near import PlacedPrimitives, placed
from vistel.space.dynamics.motion_kernels import inertia, matrices, pose  # pyright: ignore[reportUnknownVariableType]
from vistel.space.joints.joined import Joined, joined
from vistel.space.joints.joint import Joint
from vistel.space.notes.note import SHAPE as NOTE
from vistel.space.things.things import Thing, ThingPrimitive

YIELD = 0.2
"""Share of its size by which a thing as soft as flesh yields before it moves, if it takes dents."""
GRID = 20
"""Samples along each side of a thing's bounding box for its inertia."""


@dataclass(frozen=True)
class Solids:
    """N things with P primitives and M contact points, in the order of `things`.

    first, contact_point_first: (N + 1,) where each thing's primitives and contact points begin; owner: (P,) thing of a primitive;
    primitives: the P primitives, posed in their thing's frame; centre (P, 3) and bound (P,): a sphere round each, thing frame;
    contact_point (M, 3), contact_point_radius (M,): little spheres that together reach the surface from inside; radius: (N,) round
    the whole thing; inverse_mass (N,) [1/kg]; inverse_inertia (N, 3, 3) in the thing's frame [1/(kg m^2)]; both 0 for fixed things;
    joined: the joints between them.
    """

    things: tuple[Thing, ...]
    first: I64
    owner: I64
    primitives: PrimitiveSet
    centre: F64
    bound: F64
    contact_point_first: I64
    contact_point: F64
    contact_point_radius: F64
    radius: F64
    inverse_mass: F64
    inverse_inertia: F64
    joined: Joined

    def part(self, n: int) -> PrimitiveSet:
        """The primitives of thing n, posed in its frame."""
        if n not in self._parts:
            self._parts[n] = _rows(self.primitives, np.arange(int(self.first[n]), int(self.first[n + 1])))
        return self._parts[n]

    @cached_property
    def _parts(self) -> dict[int, PrimitiveSet]:
        """What `part` has given; nobody changes it."""
        return {}

    def first_part(self, n: int) -> PrimitiveSet:
        """The first primitive of thing n, posed in its frame."""
        return _rows(self.primitives, np.array([int(self.first[n])]))

    @cached_property
    def notes(self) -> NDArray[np.bool_]:
        """(N,) whether each thing is a sticky note."""
        return np.array([t.shape == NOTE for t in self.things], np.bool_)

    @cached_property
    def holds_notes(self) -> NDArray[np.bool_]:
        """(N,) whether notes stick to each thing and go along with it: to boards, panels and notes."""
        return self.boards | self.notes | np.array([t.pages is not None for t in self.things], np.bool_)

    @cached_property
    def boards(self) -> NDArray[np.bool_]:
        """(N,) whether each thing is a board to write on."""
        return np.array([t.shape == BOARD for t in self.things], np.bool_)

    @cached_property
    def give(self) -> F64:
        """(N,) depth to which a limb sinks into each thing before it pushes it [m]: a thing that takes dents yields first."""
        soft = [t.compliance if t.material.elasticity != "elastic" else 0.0 for t in self.things]
        least = [min((float(b) for b in self.bound[self.owner == n]), default=0.0) for n in range(len(self.things))]
        return YIELD * np.array(soft, np.float64) * np.array(least, np.float64)

    @cached_property
    def remembering(self) -> tuple[int, ...]:
        """Rows of the things that keep dents or stick."""
        return tuple(n for n, t in enumerate(self.things) if t.material.remembers and not t.fixed)

    @cached_property
    def fixed_rows(self) -> I64:
        """Rows of the primitives of fixed things."""
        return np.flatnonzero(self.inverse_mass[self.owner] == 0.0)

    @cached_property
    def loose_rows(self) -> I64:
        """Rows of the primitives of things that can move."""
        return np.flatnonzero(self.inverse_mass[self.owner] != 0.0)

    @cached_property
    def fixed(self) -> PrimitiveSet:
        """The primitives of all fixed things, posed in the room; primitive k is `fixed_rows[k]`."""
        rotation = _matrices([t.rotation for t in self.things])
        position = _stack([t.position for t in self.things], (3,))
        return _rows(pose_solids(self, rotation, position), self.fixed_rows)

    @cached_property
    def fixed_placed(self) -> PlacedPrimitives:
        """The same, ready to be searched."""
        return placed(self.fixed)

    @cached_property
    def places(self) -> list[tuple[int, int]]:
        """The thing of each primitive, and which of its primitives it is."""
        first: list[int] = self.first.tolist()
        return [(n, k) for n, (i, j) in enumerate(itertools.pairwise(first)) for k in range(j - i)]

    @cached_property
    def fixed_places(self) -> list[tuple[int, int]]:
        """The same of each primitive of `fixed`."""
        return [self.places[k] for k in self.fixed_rows.tolist()]

    @cached_property
    def owners(self) -> tuple[list[int], list[int]]:
        """The thing of each primitive of `fixed`, and of `loose`."""
        return self.owner[self.fixed_rows].tolist(), self.owner[self.loose_rows].tolist()

    @cached_property
    def _loose(self) -> tuple[PrimitiveSet, I64]:
        return _rows(self.primitives, self.loose_rows), self.owner[self.loose_rows]

    def loose(self, rotation: F64, position: F64) -> PrimitiveSet:
        """The primitives of things that can move, posed in the room; primitive k is `loose_rows[k]`."""
        rest, owner = self._loose
        out_r, out_p = np.empty_like(rest.rotation), np.empty_like(rest.position)
        pose(owner, rest.rotation, rest.position, rotation, position, out_r, out_p)
        return PrimitiveSet(rest.kind, rest.start, rest.params, out_r, out_p)

    @cached_property
    def _fixed_and_loose(self) -> PrimitiveSet:
        return PrimitiveSet.join([self.fixed, self._loose[0]])

    def with_loose(self, loose: PrimitiveSet) -> PrimitiveSet:
        """The primitives of `fixed`, then of `loose` where it is."""
        both, fixed = self._fixed_and_loose, self.fixed
        rotation, position = np.concatenate([fixed.rotation, loose.rotation]), np.concatenate([fixed.position, loose.position])
        return PrimitiveSet(both.kind, both.start, both.params, rotation, position)


def solids(things: tuple[Thing, ...], before: Solids | None = None, joints: tuple[Joint, ...] = ()) -> Solids:
    """The arrays of `things` and of those joints that are between them; before: earlier arrays of the same joints, whose known
    inertias are used again."""
    if before is not None and len(before.things) == len(things) and all(a is b for a, b in zip(things, before.things, strict=True)):
        return before
    primitives = [(n, p) for n, thing in enumerate(things) for p in thing.primitives]
    owner = np.array([n for n, _ in primitives], np.int64)
    rotation = _matrices([p.rotation for _, p in primitives])
    position = _stack([p.position for _, p in primitives], (3,))
    bounds = [_bound(p) for _, p in primitives]
    centre = _stack([r @ b[0] + x for r, x, b in zip(rotation, position, bounds, strict=True)], (3,))
    bound = np.array([b[1] for b in bounds], np.float64)
    contact_points = [contact_points_of(thing) for thing in things]
    count = [len(radii) for _, radii in contact_points]
    shapes = PrimitiveSet.of_kinds([p.kind for _, p in primitives], [p.params for _, p in primitives], rotation, position)
    reach = np.sqrt((centre * centre).sum(axis=1)) + bound
    out = Solids(
        things=things,
        first=np.searchsorted(owner, np.arange(len(things) + 1)).astype(np.int64),
        owner=owner,
        primitives=shapes,
        centre=centre,
        bound=bound,
        contact_point_first=np.cumsum([0, *count]).astype(np.int64),
        contact_point=np.concatenate([np.zeros((0, 3)), *(points for points, _ in contact_points)]),
        contact_point_radius=np.concatenate([np.zeros(0), *(radii for _, radii in contact_points)]),
        radius=np.array([reach[owner == n].max(initial=0.0) for n in range(len(things))], np.float64),
        inverse_mass=np.array([0.0 if t.fixed else 1.0 / t.mass for t in things], np.float64),
        inverse_inertia=np.zeros((len(things), 3, 3)),
        joined=_without_notes(joined(joints, things), things),
    )
    known = {} if before is None else {id(t): n for n, t in enumerate(before.things)}
    for n, thing in enumerate(things):
        if before is not None and id(thing) in known:
            out.inverse_inertia[n] = before.inverse_inertia[known[id(thing)]]
        elif not thing.fixed and thing.inertia is not None:
            out.inverse_inertia[n] = np.linalg.inv(thing.mass * thing.inertia)
        elif not thing.fixed:
            parts = tuple((p.kind, p.params, tuple(p.rotation.tolist()), tuple(p.position.tolist())) for p in thing.primitives)
            out.inverse_inertia[n] = np.linalg.inv(thing.mass * _unit_inertia(parts, float(out.radius[n])))
    return out


@lru_cache(1024)
def _unit_inertia(parts: tuple[tuple[str, tuple[float, ...], tuple[float, ...], tuple[float, ...]], ...], radius: float) -> F64:
    """(3, 3) inertia per kilogram of a thing: kind, params, rotation and position of its primitives; its radius [m]. It takes a
    millisecond, and a room is made several times before its first step."""
    rotation, position = _matrices([p[2] for p in parts]), np.array([p[3] for p in parts], np.float64)
    s = PrimitiveSet.of_kinds([p[0] for p in parts], [p[1] for p in parts], rotation, position)
    unit: Any = inertia(s.kind, s.start, s.params, s.rotation, s.position, radius, GRID)  # pyright: ignore[reportUnknownVariableType]
    return np.asarray(unit, np.float64)


def _without_notes(j: Joined, things: tuple[Thing, ...]) -> Joined:
    """The same, with notes apart from every other thing: they stick to it, and paper pushes nothing away."""
    count, notes = len(things), np.array([n for n, t in enumerate(things) if t.shape == NOTE], np.int64)
    if len(notes) == 0:
        return j
    others = np.arange(count)
    pairs = (notes[:, None] * count + others).ravel(), (others[:, None] * count + notes).ravel()
    return replace(j, apart=np.unique(np.concatenate((j.apart, *pairs))))


def outline(thing: Thing) -> Solids:
    """The arrays of a single thing, without its inertia, which takes longest: for questions about its shape."""
    return solids((replace(thing, mass=0.0),))


def pose_solids(s: Solids, rotation: F64, position: F64) -> PrimitiveSet:
    """All primitives in the room, for things at `rotation` (N, 3, 3) and `position` (N, 3) [m]."""
    rest = s.primitives
    out_r, out_p = np.empty_like(rest.rotation), np.empty_like(rest.position)
    pose(s.owner, rest.rotation, rest.position, rotation, position, out_r, out_p)
    return PrimitiveSet(rest.kind, rest.start, rest.params, out_r, out_p)


def _rows(s: PrimitiveSet, rows: I64) -> PrimitiveSet:
    params = [s.params[s.start[k] : s.start[k + 1]] for k in rows]
    start = np.zeros(len(rows) + 1, np.int32)
    start[1:] = np.cumsum([len(p) for p in params])
    flat = np.concatenate(params) if params else np.zeros(0)
    return PrimitiveSet(s.kind[rows], start, flat, np.ascontiguousarray(s.rotation[rows]), np.ascontiguousarray(s.position[rows]))


def _matrices(quaternions: Sequence[Sequence[float] | F64]) -> F64:
    out = np.empty((len(quaternions), 3, 3))
    matrices(np.array(quaternions, np.float64).reshape(-1, 4), out)
    return out


def _stack(rows: list[F64], shape: tuple[int, ...]) -> F64:
    return np.array(rows, np.float64) if rows else np.zeros((0, *shape))


def _bound(p: ThingPrimitive) -> tuple[F64, float]:
    """Centre (3,) in the primitive's frame and radius of a sphere round it."""
    q = p.params
    if p.kind == "cone_sphere":
        a, b = np.array(q[:3]), np.array(q[3:6])
        return 0.5 * (a + b), 0.5 * math.dist(q[:3], q[3:6]) + max(q[6:])
    if p.kind == "rounded_polygon":
        corners = np.array(q[1:]).reshape(-1, 3)
        centre = corners.mean(axis=0)
        return centre, float(np.sqrt(((corners - centre) ** 2).sum(axis=1)).max()) + q[0]
    if p.kind == "superellipsoid":
        outline = 2.0 ** (0.5 - min(1.0, q[4]) / 2.0)  # a square outline reaches sqrt(2) times as far
        return np.zeros(3), math.hypot(max(q[:2]) * outline, q[2])
    if p.kind == "supertoroid":
        return np.zeros(3), math.hypot(max(q[:2]) * (q[3] + 1.0) * 2.0 ** (0.5 - min(1.0, q[5]) / 2.0), q[2])
    return np.zeros(3), q[0]
