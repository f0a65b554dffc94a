"""Soft bodies that move: rigid motion driven by the pressure of their contacts and constraints (Singh §2.2.4, §4.2).

    room = SoftRoom.of(things, constraints=[...], materials={"ball": Viscoelastic(0.3)})
    room = room.step(1 / 60)
    shapes = room.shapes()          # every body's deformed field

The rigid component is stepped semi-implicitly in small equal substeps, on linear and angular momentum, so that a closed
system keeps both to rounding; the deformable component follows from where the bodies are. Values in, values out.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.ghosts.composition import collisions, deformed
from vistel.implicit.ghosts.constraint import Constraint, ConstraintState, tear
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.ghosts.ghost_kind import Ghost
from vistel.implicit.ghosts.temporal import ContactMemory, Material
from vistel.implicit.graph.combine import union
from vistel.implicit.graph.ghost_terms import constraint_field, hold_level
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.kinds import primitive_of
from vistel.space.contact.forces import STIFFEST, ContactParameters, ContactPatch, Motion, contact_patches
from vistel.space.contact.patch_kernels import value  # pyright: ignore[reportUnknownVariableType]
from vistel.space.dynamics.bristles import Bristle, Key, grip
from vistel.space.dynamics.solids import Solids, solids
from vistel.space.things.things import Thing

SUBSTEP = 1.0 / 240.0
"""Longest substep [s]."""
SHORTEST = 1.0 / 4000.0
"""Shortest substep, however stiff a body is [s]."""
ANGLES = 12
"""Rays of a contact patch while bodies move."""
GRIP = 0.3
"""Share of a constraint's reach that its tension acts on, where it has no plateau."""


@dataclass(frozen=True)
class SoftRoom:
    """N soft bodies at one time.

    solids: their primitives, mass, inertia; position (N, 3) [m], rotation (N, 4) (x, y, z, w), velocity (N, 3) [m/s],
    spin (N, 3) [rad/s]; gravity (3,) [m/s^2]; surface: how they push and rub; memory: their dents; patches: the contacts
    of the last substep, by the bodies' numbers, without friction; strayed: names of bodies that were stopped
    because their numbers became invalid; bristles: friction springs by contact.
    """

    solids: Solids
    position: F64
    rotation: F64
    velocity: F64
    spin: F64
    time: float = 0.0
    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    surface: ContactParameters = field(default_factory=ContactParameters)
    constraints: tuple[Constraint, ...] = ()
    memory: ContactMemory = field(default_factory=lambda: ContactMemory({}))
    patches: tuple[tuple[int, int, ContactPatch], ...] = ()
    strayed: tuple[str, ...] = ()
    bristles: Mapping[Key, Bristle] = field(default_factory=dict[Key, Bristle])

    @staticmethod
    def of(
        things: Sequence[Thing],
        *,
        velocity: Mapping[str, Sequence[float]] | None = None,
        constraints: Iterable[Constraint] = (),
        materials: Mapping[str, Material] | None = None,
        gravity: tuple[float, float, float] = (0.0, -9.81, 0.0),
        surface: ContactParameters | None = None,
    ) -> "SoftRoom":
        """Things where they begin; velocity: of some of them, by id [m/s]. Things of mass 0 stay where they are."""
        s = solids(tuple(things))
        moving = velocity or {}
        return SoftRoom(
            s,
            np.array([t.position for t in things]),
            np.array([t.rotation for t in things]),
            np.array([moving.get(t.id, (0.0, 0.0, 0.0)) for t in things], np.float64),
            np.zeros((len(things), 3)),
            gravity=gravity,
            surface=surface or ContactParameters(),
            constraints=tuple(constraints),
            memory=ContactMemory(materials or {}),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """The bodies' ids, in order."""
        return tuple(t.id for t in self.solids.things)

    def step(self, dt: float) -> "SoftRoom":
        """The room `dt` seconds later: any dt, cut into substeps; then dents are pressed and constraints torn."""
        count = max(1, math.ceil(dt / self._substep() - 1e-9))
        state = _State(self)
        strayed: set[str] = set()
        for k in range(count):
            strayed |= state.substep(dt / count, self.time + k * dt / count)
        moved = replace(
            self,
            position=state.position,
            rotation=state.rotation,
            velocity=state.velocity(),
            spin=state.spin(),
            time=self.time + dt,
            patches=tuple(state.patches),
            strayed=tuple(sorted(strayed)),
            bristles=state.bristles,
        )
        bodies = moved.bodies()
        if self.constraints:
            by_name = {b.name: b for b in bodies}
            moved = replace(moved, constraints=tear(self.constraints, by_name, moved.time))
        if self.memory.materials:
            moved = replace(moved, memory=self.memory.step(bodies, moved.time, dt))
        return moved

    def _substep(self) -> float:
        """Seconds: short beside the swing of the stiffest and lightest body on its own pressure."""
        s = self.solids
        soft = np.array([max(t.compliance, STIFFEST) for t in s.things])
        rate = np.sqrt(1.3 * self.surface.pressure * s.radius * s.inverse_mass / soft)
        return min(SUBSTEP, max(SHORTEST, 0.6 / max(float(rate.max(initial=0.0)), 1e-9)))

    def bodies(self) -> list[Deformable]:
        """The bodies as they take and give ghosts, where they are."""
        return [_shape_of(t).at(self.position[n], self.rotation[n]) for n, t in enumerate(self.solids.things)]

    def shapes(self, extra: Iterable[Ghost] = ()) -> dict[str, Shape]:
        """Every body's field under collisions, constraints, dents and `extra` ghosts."""
        bodies = self.bodies()
        ghosts = [*collisions(bodies), *self.constraints, *self.memory.ghosts(self.time), *extra]
        return deformed(bodies, ghosts, self.time)

    def holds(self) -> list[ConstraintState]:
        """How every constraint fares."""
        by_name = {b.name: b for b in self.bodies()}
        return [c.held(by_name[c.a], by_name[c.b]) for c in self.constraints]

    def momentum(self) -> tuple[F64, F64]:
        """Linear (3,) [kg m/s] and angular momentum about the room's origin (3,) [kg m^2/s] of all free bodies."""
        state = _State(self)
        orbit = np.cross(state.position, state.linear)
        return state.linear.sum(axis=0), (orbit + state.angular).sum(axis=0)

    def kinetic_energy(self) -> float:
        """Joules."""
        state = _State(self)
        return 0.5 * float((state.linear * state.velocity()).sum() + (state.angular * state.spin()).sum())


def _shape_of(thing: Thing) -> Deformable:
    """A thing at the origin, as a body that deforms: the union of its primitives."""
    parts = [primitive_of(p.kind, p.params).moved(p.position, p.rotation) for p in thing.primitives]
    colour = tuple((thing.colour >> shift & 0xFF) / 255.0 for shift in (24, 16, 8))
    whole: Shape = parts[0] if len(parts) == 1 else union(*parts)
    return Deformable(thing.id, whole.with_attributes(colour=colour), thing.compliance)


class _State:
    """The bodies while they are stepped, by their momenta."""

    def __init__(self, room: SoftRoom) -> None:
        s = room.solids
        self.room = room
        self.position, self.rotation = room.position.copy(), room.rotation.copy()
        self.free = s.inverse_mass > 0
        mass = np.where(self.free, 1.0 / np.where(self.free, s.inverse_mass, 1.0), 0.0)
        self.linear: F64 = room.velocity * mass[:, None]
        self.mass: F64 = mass
        self.angular = np.zeros_like(room.spin)
        for n in np.flatnonzero(self.free):
            r = matrix_from_quaternion(self.rotation[n])
            self.angular[n] = r @ np.linalg.solve(s.inverse_inertia[n], r.T @ room.spin[n])
        self.rest = [s.part(n) for n in range(len(s.things))]
        self.index = {t.id: n for n, t in enumerate(s.things)}
        self.patches: list[tuple[int, int, ContactPatch]] = []
        self.bristles: dict[Key, Bristle] = dict(room.bristles)

    def velocity(self) -> F64:
        """(N, 3) [m/s]."""
        return self.linear * self.room.solids.inverse_mass[:, None]

    def spin(self) -> F64:
        """(N, 3) [rad/s]."""
        out = np.zeros_like(self.angular)
        for n in np.flatnonzero(self.free):
            r = matrix_from_quaternion(self.rotation[n])
            out[n] = r @ self.room.solids.inverse_inertia[n] @ r.T @ self.angular[n]
        return out

    def substep(self, h: float, time: float) -> set[str]:
        """Forces, then momenta, then places. Returns the names of bodies that had to be stopped."""
        velocity, spin = self.velocity(), self.spin()
        turns = [matrix_from_quaternion(q) for q in self.rotation]
        posed = [s.moved(r, p) for s, r, p in zip(self.rest, turns, self.position, strict=True)]
        force: F64 = self.mass[:, None] * np.array(self.room.gravity)
        torque = np.zeros_like(force)
        self.patches = []
        stuck, self.bristles = self.bristles, {}
        smooth = replace(self.room.surface, friction=0.0)
        things, s = self.room.solids.things, self.room.solids
        for a, b in self._near():
            motions = [Motion(velocity[n], spin[n], self.position[n]) for n in (a, b)]
            for patch in contact_patches(
                posed[a],
                posed[b],
                things[a].compliance,
                things[b].compliance,
                motion_a=motions[0],
                motion_b=motions[1],
                surface=smooth,
                angles=ANGLES,
            ):
                self.patches.append((a, b, patch))
                speeds = [velocity[n] + np.cross(spin[n], patch.point - self.position[n]) for n in (a, b)]
                key = (a, b, patch.a, patch.b)
                mass = 1.0 / float(s.inverse_mass[[a, b]].sum())
                held = grip(patch, stuck.get(key), speeds[1] - speeds[0], spin[b] - spin[a], mass, h, self.room.surface)
                self.bristles[key] = held.bristle
                force[a] += patch.force + held.force
                force[b] -= patch.force + held.force
                for n, sign in ((a, 1.0), (b, -1.0)):
                    arm = patch.point - self.position[n]
                    torque[n] += sign * (patch.torque_about(self.position[n]) + np.cross(arm, held.force) + held.torque)
        for c in self.room.constraints:
            a, b = self.index[c.a], self.index[c.b]
            pull = self._tension(c, (a, b), turns, posed, velocity, spin, time, h)
            if pull is None:
                continue
            at_a, at_b, f = pull
            force[a] += f
            force[b] -= f
            torque[a] += np.cross(at_a - self.position[a], f)
            torque[b] -= np.cross(at_b - self.position[b], f)
        before = self.position.copy(), self.rotation.copy()
        free = self.free[:, None]
        self.linear += h * np.where(free, force, 0.0)
        self.angular += h * np.where(free, torque, 0.0)
        self.position += h * s.inverse_mass[:, None] * self.linear
        moved = self.spin()
        for n in np.flatnonzero(self.free):
            self.rotation[n] = _turned(self.rotation[n], moved[n], h)
        sound = np.isfinite(self.position).all(axis=1) & np.isfinite(self.rotation).all(axis=1)
        sound &= np.isfinite(self.linear).all(axis=1) & np.isfinite(self.angular).all(axis=1)
        for n in np.flatnonzero(~sound):
            self.position[n], self.rotation[n] = before[0][n], before[1][n]
            self.linear[n], self.angular[n] = 0.0, 0.0
        return {things[n].id for n in np.flatnonzero(~sound)}

    def _near(self) -> list[tuple[int, int]]:
        """Pairs whose bounding balls meet and of which one can move; lower number first."""
        radius = self.room.solids.radius
        apart = np.linalg.norm(self.position[:, None] - self.position[None], axis=2)
        close = (apart < radius[:, None] + radius[None]) & (self.free[:, None] | self.free[None])
        return [(int(a), int(b)) for a, b in np.argwhere(np.triu(close, 1))]

    def _tension(
        self,
        c: Constraint,
        pair: tuple[int, int],
        turns: Sequence[F64],
        posed: Sequence[PrimitiveSet],
        velocity: F64,
        spin: F64,
        time: float,
        h: float,
    ) -> tuple[F64, F64, F64] | None:
        """Where a constraint holds both bodies (3,), (3,), and the force on a (3,) [N]; None where it is slack.

        The pressure is the ghosts' own at Q, falling to nothing where they fall short: c(y) / compliance.
        """
        strength = c.strength(time)
        if strength <= 0 or not c.since <= time < c.until:
            return None
        a, b = pair
        at_a = self.position[a] + turns[a] @ np.array(c.point_a)
        at_b = self.position[b] + turns[b] @ np.array(c.point_b)
        line = at_b - at_a
        gap = float(np.linalg.norm(line))
        if gap < 1e-9 or float(line @ (self.position[b] - self.position[a])) <= 0:
            return None
        things = self.room.solids.things
        soft_a, soft_b = (max(things[n].compliance, STIFFEST) for n in pair)
        q = at_a + soft_a / (soft_a + soft_b) * line
        y = [max(0.0, T - _field(posed[n], q)) for n in pair]
        reach = min(c.reach_a or self._reach(a), c.reach_b or self._reach(b))
        held = float(constraint_field((y[0] + y[1]) / (soft_a + soft_b), hold_level(c.hold)))
        area = math.pi * (max(c.plateau, GRIP) * reach) ** 2
        along = line / gap
        speeds = [velocity[n] + np.cross(spin[n], at - self.position[n]) for n, at in ((a, at_a), (b, at_b))]
        parting = float((speeds[1] - speeds[0]) @ along)
        pull = self.room.surface.pressure * held * area * strength
        # Implicit in the speed, with gravity and the pull itself: however thick, honey slows bodies down and no more.
        light = float(self.room.solids.inverse_mass[[a, b]].sum())
        weight = float(np.array(self.room.gravity) @ along) * (int(self.free[b]) - int(self.free[a]))
        parting += h * (weight - pull * light)
        drag = pull * self.room.surface.viscosity
        drag /= 1.0 + h * drag * light
        return at_a, at_b, max(0.0, pull + drag * parting) * along

    def _reach(self, n: int) -> float:
        return 0.4 * float(self.room.solids.radius[n])


def _field(s: PrimitiveSet, at: F64) -> float:
    """The largest field of posed primitives at a point."""
    best = 0.0
    for i in range(len(s)):
        best = max(best, float(value(at, i, s.kind, s.start, s.params, s.rotation, s.position, np.empty(5))))
    return best


def _turned(q: F64, spin: F64, h: float) -> F64:
    """Quaternion q turned by spin [rad/s] for h seconds."""
    angle = h * float(np.linalg.norm(spin))
    if angle < 1e-15:
        return q
    axis = spin * (h / angle) * math.sin(0.5 * angle)
    w = math.cos(0.5 * angle)
    v, s = q[:3], q[3]
    out = np.concatenate([w * v + s * axis + np.cross(axis, v), [w * s - axis @ v]])
    return out / np.linalg.norm(out)
