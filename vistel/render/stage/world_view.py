"""The shared room at an instant of playout, from the world's messages."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from vistel.arrays import F64
from vistel.geometry.pose import Pose
from vistel.render.stage.prediction import BODY_FADES_S, faded
from vistel.space.things.arc import Arc
from vistel.space.things.things import Curve, Look, Pages, Thing, ThingPrimitive
from vistel.space.touch import FLESH_COMPLIANCE
from vistel.v1 import geometry_pb2, world_pb2
from vistel.wire.world.decoder import RoomState, Touch


@dataclass(frozen=True)
class ActingGhost:
    """The field of `source` deforms `target` (Singh §2.1), a participant at some of their primitives, a thing as a whole."""

    target: str
    source: str
    target_primitives: tuple[int, ...]
    compliance_source: float


@dataclass(frozen=True)
class PlayoutWorld:
    """poses: position (3,) [m] and quaternion (4,) (x, y, z, w) of each thing; ghosts and grasps that act; dents, bonds
    and strokes by number."""

    step: int = 0
    poses: Mapping[str, Pose] = field(default_factory=dict[str, Pose])
    ghosts: tuple[ActingGhost, ...] = ()
    grasps: tuple[world_pb2.Grasp, ...] = ()
    dents: Mapping[int, world_pb2.Dent] = field(default_factory=dict[int, world_pb2.Dent])
    bonds: Mapping[int, world_pb2.Bond] = field(default_factory=dict[int, world_pb2.Bond])
    strokes: Mapping[int, world_pb2.Stroke] = field(default_factory=dict[int, world_pb2.Stroke])
    selected: tuple[tuple[str, tuple[str, ...]], ...] = ()
    """Ids of the things that people have selected, by participant."""
    signals: world_pb2.Signals = field(default_factory=world_pb2.Signals)


def vector(v: geometry_pb2.Vec3) -> F64:
    """(3,) of a message."""
    return np.array((v.x, v.y, v.z))


def quaternion(q: geometry_pb2.Quaternion) -> F64:
    """(4,) unit quaternion of a message; all zero means identity."""
    out = np.array((q.x, q.y, q.z, q.w))
    n = float(np.linalg.norm(out))
    return out / n if n > 1e-6 else np.array((0.0, 0.0, 0.0, 1.0))


def view_of(now: RoomState, ghosts: tuple[ActingGhost, ...]) -> PlayoutWorld:
    """What is shown of a step."""
    poses = {thing: Pose(*pose) for thing, pose in now.poses.items()}
    return PlayoutWorld(now.step, poses, ghosts, now.grasps, now.dents, now.bonds, now.strokes, now.selected, now.signals)


def ghosts_from(touches: Iterable[Touch], things: Mapping[str, world_pb2.Thing]) -> tuple[ActingGhost, ...]:
    """Who deforms whom: whoever is touched, by what touches them, and a soft thing by who touches it."""
    out: list[ActingGhost] = []
    for t in touches:
        thing = things.get(t.source)
        soft = FLESH_COMPLIANCE if thing is None else thing.compliance
        out.append(ActingGhost(t.target, t.source, t.limbs, soft))
        if thing is not None and soft > 0.0:
            out.append(ActingGhost(t.source, t.target, (), FLESH_COMPLIANCE))
    return tuple(out)


def between(a: PlayoutWorld, b: PlayoutWorld, u: float) -> PlayoutWorld:
    """Things between their places in `a` (u = 0) and `b` (u = 1); grasps and marks are those of the nearer one.

    Ghosts are those of `b`: what begins to touch acts as soon as it does, and what has ceased to is named a while longer.
    """
    poses = dict(a.poses)
    for thing, pose in b.poses.items():
        before = poses.get(thing, pose)
        poses[thing] = pose if before.position is pose.position else before.interpolate(pose, u)
    near = a if u < 0.5 else b
    if near.poses.keys() != poses.keys():
        poses = {k: v for k, v in poses.items() if k in near.poses}
    kept = near.grasps, near.dents, near.bonds, near.strokes, near.selected, near.signals
    return PlayoutWorld(near.step, poses, b.ghosts, *kept)


def world_after(before: PlayoutWorld, newest: PlayoutWorld, span_s: float, ahead_s: float) -> PlayoutWorld:
    """The room a moment after its newest step: what moves goes on."""
    return between(before, newest, 1.0 + faded(ahead_s, BODY_FADES_S) / span_s)


def thing_of(message: world_pb2.Thing) -> Thing:
    """A thing as the room describes it. Raises ValueError for a primitive that is none."""
    primitives = tuple(primitive_from(p) for p in message.primitives)
    m = message
    looks = tuple(_look(k) for k in m.looks)
    pages = Pages(tuple(m.pages.models), m.pages.shown, m.pages.by, m.pages.live) if m.HasField("pages") else None
    thing = Thing(
        m.id, m.name, m.shape, primitives, m.mass_kg, m.compliance, m.colour, np.zeros(3), looks=looks, hidden=m.hidden, pages=pages
    )
    if not m.HasField("curve"):
        return thing
    c = m.curve
    arc = Arc(vector(c.along), vector(c.side), c.low, c.high, c.bend, c.twist, vector(c.centre))
    straight = replace(thing, primitives=tuple(primitive_from(p) for p in c.straight))
    return replace(thing, curve=Curve(straight, arc))


def _look(k: world_pb2.Look) -> Look:
    matrix = np.array(k.matrix).reshape(3, 3) if k.matrix else np.eye(3)
    if not np.isfinite(matrix).all():
        raise ValueError("a look with numbers that are not finite")
    return Look(k.model, matrix, vector(k.offset), k.colour)


def primitive_from(p: world_pb2.Primitive) -> ThingPrimitive:
    """A primitive as it is described. Raises ValueError for what is none."""
    return ThingPrimitive(p.kind, tuple(p.params), vector(p.pose.position), quaternion(p.pose.rotation), p.colour)
