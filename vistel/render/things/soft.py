"""Soft things: their dents, what presses on them now and what is stuck to them, in the vertices that are drawn."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64
from vistel.figure.body import PosedBody
from vistel.figure.posture.posture import JointPose
from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.geometry.smoothstep import ease
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of
from vistel.implicit.ghosts.constraint import Constraint, ConstraintGhost
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.ghosts.mesh_ghosts import faded, pulled
from vistel.implicit.graph.ghost_terms import decay_quartic
from vistel.implicit.meshes.embedding import embed
from vistel.implicit.primitives.kinds import primitive_of
from vistel.render.figures.ghosts import Touching
from vistel.render.stage.stage import Instant
from vistel.render.stage.world_view import primitive_from, vector
from vistel.render.things.soft_skin import limbs_in, nearest_limb, skin_of
from vistel.space.files.model import Polymesh
from vistel.space.memory.bonds import FADE_NS
from vistel.space.memory.dents import imprints
from vistel.space.things.things import Thing, ThingPrimitive
from vistel.v1 import world_pb2

log = logging.getLogger("vistel.renderer")


SOFT_FROM = 0.1
"""Compliance up to which nobody would see a thing deform."""
DRAWN = 0.004
"""How far a bond is drawn out before it shows in full [m]."""
PLATEAU = 0.3
"""Share of a bond's reach that is held like an area."""


@dataclass(frozen=True, eq=False)
class Reshaped:
    """A thing's drawn vertices now: positions and normals (n, 3), in the room if `in_room`, else in its own frame; turn: (3, 3)
    from its frame to that; bent: (n,) whose normals are not those at rest."""

    positions: F32
    normals: F32
    in_room: bool
    turn: F64
    bent: NDArray[np.bool_]


def is_soft(thing: Thing) -> bool:
    """Whether a thing is drawn deformed: so soft that it shows, and felt."""
    return thing.compliance > SOFT_FROM and bool(thing.primitives)


def bond_pulls(bond: world_pb2.Bond, thing: Thing, pose: Pose, limb: ThingPrimitive, at: F64, t_ns: int) -> list[ConstraintGhost]:
    """What a bond does to the thing (target "thing") and to the limb (target "limb") at `t_ns`.

    pose: the thing's position and quaternion; limb: a primitive of the body or of the other thing, in the room; at:
    (3,) where that is held [m].
    """
    (position, rotation), p = pose, thing.primitives[0]
    held_at = matrix_from_quaternion(np.ascontiguousarray(rotation)) @ vector(bond.point_thing) + position
    drawn = smoothly(float(np.linalg.norm(at - held_at)) / DRAWN)
    if drawn <= 0.01:  # in touch: the contact holds them together
        return []
    own = primitive_of(p.kind, p.params).moved(_three(p.position), _four(p.rotation))
    a = Deformable("thing", own, thing.compliance, _three(position), _four(rotation))
    there = primitive_of(limb.kind, limb.params).moved(_three(limb.position), _four(limb.rotation))
    b = Deformable("limb", there, 1.0)
    torn = bond.torn_ns * 1e-9 if bond.torn_ns else None
    held = Constraint(
        "thing",
        "limb",
        _three(vector(bond.point_thing)),
        _three(at),
        bond.reach,
        bond.reach,
        PLATEAU,
        torn_at=torn,
        fade=FADE_NS * 1e-9,
    )
    return [replace(pull, strength=drawn * pull.strength) for pull in held.pulls(a, b, t_ns * 1e-9)]


def smoothly(u: float) -> float:
    """0 for u <= 0, 1 for u >= 1, without slope at both ends."""
    return ease(min(max(u, 0.0), 1.0))


class SoftThing:
    """One thing's surface and what deforms it. Not for two threads at once."""

    def __init__(self, thing: Thing, models: Mapping[str, Polymesh] = MappingProxyType({})) -> None:
        """models: what its looks need; without them its primitives are drawn."""
        self.thing = thing
        self.skin = skin_of(thing, models)
        self.surface = self.skin.surface
        v, limbs = self.surface.vertices, limbs_in(thing.primitives)
        self._a, self._b = limbs.a, limbs.b
        self._deformer = Deformer(self.surface.triangles, embed(v, nearest_limb(v, limbs), limbs))
        self._kept: tuple[object, Reshaped] | None = None

    def reshape(self, dents: Sequence[world_pb2.Dent], live: Sequence[GhostSource], pose: Pose, t_ns: int) -> Reshaped | None:
        """The surface under its dents and what acts on it now (room frame); None where nothing does."""
        if not dents and not live:
            self._kept = None
            return None
        if not live:
            key = tuple((d.number, d.depth, d.left_ns, _share(d, t_ns)) for d in dents)
            if self._kept is None or self._kept[0] != key:
                still = np.eye(3), np.zeros(3)
                self._kept = key, self._deform(self._dents(dents, *still, t_ns), *still, False)
            return self._kept[1]
        r, at = matrix_from_quaternion(np.ascontiguousarray(pose[1])), pose[0]
        sources = [*self._dents(dents, r, at, t_ns), *(self._as_soft(s) for s in live)]
        return self._deform(sources, r, at, True)

    def _deform(self, sources: Sequence[GhostSource], r: F64, at: F64, in_room: bool) -> Reshaped:
        positions = (self.surface.vertices @ r.T + at).astype(np.float32)
        normals = np.ascontiguousarray(self.surface.normals @ r.T, np.float32)
        rest = normals.copy()
        self._deformer.deform(positions, normals, self._a @ r.T + at, self._b @ r.T + at, sources)
        return Reshaped(positions, normals, in_room, r, (normals != rest).any(axis=1))

    def _dents(self, dents: Sequence[world_pb2.Dent], r: F64, at: F64, t_ns: int) -> list[GhostSource]:
        whole = [d for d in dents if _share(d, t_ns) == 1.0]
        out: list[GhostSource] = []
        if whole:
            shapes = imprints([primitive_from(d.shape) for d in whole]).moved(r, at)
            source = ghosts_of(shapes, groups=range(len(whole)))
            out.append(self._as_soft(replace(source, depth=np.array([d.depth for d in whole], np.float32))))
        for d in dents:
            share = _share(d, t_ns)
            if 0.0 < share < 1.0:
                shape = imprints([primitive_from(d.shape)]).moved(r, at)
                out.append(self._as_soft(faded(ghosts_of(shape), share)))
        return out

    def _as_soft(self, source: GhostSource) -> GhostSource:
        """A source as a body of this thing's compliance sees it: only the quotient of both counts."""
        c = np.minimum(source.compliance / max(self.thing.compliance, 1e-3), 50.0)
        return replace(source, compliance=c.astype(np.float32))


class SoftThings:
    """All soft things."""

    def __init__(self) -> None:
        self._things: dict[str, SoftThing] = {}

    def make(self, thing: Thing, models: Mapping[str, Polymesh]) -> SoftThing:
        """The soft side of a thing for which `is_soft` holds, made anew."""
        made = SoftThing(thing, models)
        self.keep(made)
        return made

    def keep(self, made: SoftThing) -> None:
        """What has been made elsewhere of a thing, in place of what was made of it before."""
        self._things[made.thing.id] = made

    def of(self, thing_id: str) -> SoftThing:
        """What `make` has made of it. Raises KeyError."""
        return self._things[thing_id]

    def drop(self, thing_id: str) -> None:
        """It is not soft, or not there, any more."""
        self._things.pop(thing_id, None)

    def reshaped(
        self,
        instant: Instant,
        shapes: Mapping[str, Touching],
        posed: Mapping[str, PosedBody],
        pulls: Mapping[str, Sequence[tuple[ThingPrimitive, ConstraintGhost]]],
    ) -> dict[str, Reshaped | None]:
        """Every soft thing's surface at this instant. posed: the figures' primitives; pulls: by thing, limb and pull."""
        dents: dict[str, list[world_pb2.Dent]] = {}
        for number in sorted(instant.world.dents):
            d = instant.world.dents[number]
            dents.setdefault(d.thing, []).append(d)
        live: dict[str, list[GhostSource]] = {}
        for g in instant.world.ghosts:
            if g.source in posed and g.target in instant.things:
                live.setdefault(g.target, []).append(shapes[g.source].ghosts(posed[g.source], None))
        for name, some in pulls.items():
            live.setdefault(name, []).extend(pulled(ghosts_of(imprints([limb])), [pull]) for limb, pull in some)
        out: dict[str, Reshaped | None] = {}
        for name, soft in self._things.items():
            if name in instant.things and name in instant.world.poses:
                pose = instant.world.poses[name]
                try:
                    out[name] = soft.reshape(dents.get(name, ()), live.get(name, ()), pose, instant.now_ns)
                except ValueError as e:  # a dent that is none must not take the picture away
                    log.error("event=bad_dent thing=%s reason=%r shown=undented", name, str(e))
                    out[name] = None
        return out


def pulls_of(
    instant: Instant, posed: Mapping[str, PosedBody], joints: Mapping[str, JointPose], shapes: Mapping[str, Touching]
) -> tuple[dict[str, list[tuple[ThingPrimitive, ConstraintGhost]]], dict[str, list[GhostSource]]]:
    """What bonds do: to things, by thing, and to figures, by participant, as ghosts of the thing that hold the limb."""
    to_things: dict[str, list[tuple[ThingPrimitive, ConstraintGhost]]] = {}
    to_figures: dict[str, list[GhostSource]] = {}
    for number in sorted(instant.world.bonds):
        b = instant.world.bonds[number]
        thing, pose, body = instant.things.get(b.thing), instant.world.poses.get(b.thing), posed.get(b.body)
        if thing is None or pose is None or [p.kind for p in thing.primitives] not in (["sphere"], ["cone_sphere"]):
            continue
        if b.body in instant.things:
            to_things.setdefault(b.thing, []).extend(_by_thing(b, instant, thing, pose))
        if body is None or b.primitive >= len(body.radius_a):
            continue
        i, joint = int(b.primitive), int(shapes[b.body].body.joint[b.primitive])
        ends = (*body.a[i].tolist(), *body.b[i].tolist(), float(body.radius_a[i]), float(body.radius_b[i]))
        limb = ThingPrimitive("cone_sphere", ends)
        at = joints[b.body].rotation[joint] @ vector(b.point_body) + joints[b.body].position[joint]
        for pull in bond_pulls(b, thing, pose, limb, at, instant.now_ns):
            if pull.target == "thing":
                to_things.setdefault(b.thing, []).append((limb, pull))
            else:
                mask = np.zeros(len(body.radius_a), np.bool_)
                mask[i] = True
                r = matrix_from_quaternion(np.ascontiguousarray(pose[1]))
                placed = imprints(thing.primitives).moved(r, pose[0])
                source = ghosts_of(placed, compliance=max(thing.compliance, 0.02), target=mask)
                to_figures.setdefault(b.body, []).append(pulled(source, [pull]))
    return to_things, to_figures


def _by_thing(b: world_pb2.Bond, instant: Instant, thing: Thing, pose: Pose) -> list[tuple[ThingPrimitive, ConstraintGhost]]:
    """How a bond with another thing, the table as it may be, draws the sticky one out."""
    other, at = instant.things[b.body], instant.world.poses.get(b.body)
    if at is None or b.primitive >= len(other.primitives):
        return []
    p, turn = other.primitives[b.primitive], matrix_from_quaternion(np.ascontiguousarray(at[1]))
    rotation = quaternion_from_matrix(np.ascontiguousarray(turn @ matrix_from_quaternion(np.ascontiguousarray(p.rotation))))
    there = ThingPrimitive(p.kind, p.params, at[0] + turn @ p.position, rotation)
    held = at[0] + turn @ vector(b.point_body)
    return [(there, pull) for pull in bond_pulls(b, thing, pose, there, held, instant.now_ns) if pull.target == "thing"]


def _share(d: world_pb2.Dent, t_ns: int) -> float:
    """What is left of a dent."""
    if d.left_ns == 0 or d.fade_s <= 0.0:
        return 1.0
    return decay_quartic(max(0, t_ns - d.left_ns) * 1e-9, d.fade_s)


def _three(v: F64) -> tuple[float, float, float]:
    return float(v[0]), float(v[1]), float(v[2])


def _four(q: F64) -> tuple[float, float, float, float]:
    return float(q[0]), float(q[1]), float(q[2]), float(q[3])
