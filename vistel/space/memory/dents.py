"""Dents: imprints of primitives in a thing's own frame (Singh §C.2).

The laws are those of `vistel.implicit.ghosts.temporal`, for the primitives that the world's contacts are made of: a plastic thing
keeps the deepest imprint of every contact, several side by side where the maker slides; the ghost of a viscoelastic one follows its
maker with a time constant once that draws back. Each dent has a number, and only changed dents are published.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vistel.geometry.rotation import matrix_from_quaternion, slerp
from vistel.implicit.contacts.contact import find_contacts
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.ghosts.temporal import FADED
from vistel.implicit.graph.ghost_terms import decay_quartic
from vistel.space.things.things import PhysicsMaterial, ThingPrimitive

LEAST = 0.01
"""Overlap below which no dent stays [field]."""
DEEPER = 0.008
"""An imprint is published again when it is deeper by so much [field]: about a tenth of a millimetre under a finger."""
SPACING = 0.5
"""A maker that has slid by so much of its radius makes another dent."""
MOST = 48
"""Dents one thing keeps, the deepest."""
MOST_IN_ROOM = 240
"""Dents all things keep together, so that a state stays a message."""


@dataclass(frozen=True, eq=False)
class Press:
    """Primitive `primitive` of `maker` overlaps a thing: its shape in the thing's frame, the overlap [field]."""

    maker: str
    primitive: int
    shape: ThingPrimitive
    depth: float


@dataclass(frozen=True, eq=False)
class DentRecord:
    """An imprint in `thing`: the shape that made it, in its frame; depth [field]; left_ns: when the maker left, 0 while it
    is there; fade_ns: how long it takes to fade then, 0: it stays."""

    number: int
    thing: str
    maker: str
    primitive: int
    shape: ThingPrimitive
    depth: float
    left_ns: int = 0
    fade_ns: int = 0

    def share(self, t_ns: int) -> float:
        """Share of the dent that is left at `t_ns`, 0 to 1."""
        if self.left_ns == 0 or self.fade_ns == 0:
            return 1.0
        return decay_quartic(max(0, t_ns - self.left_ns) * 1e-9, self.fade_ns * 1e-9)


def remember(
    old: Sequence[DentRecord],
    thing: str,
    material: PhysicsMaterial,
    body: PrimitiveSet,
    presses: Iterable[Press],
    next_number: int,
    t_ns: int,
    dt: float,
) -> tuple[tuple[DentRecord, ...], int]:
    """The dents of one thing at `t_ns`, dt seconds after `old`, and the next free number. body: the thing's primitives in
    its own frame; presses: what overlaps it now, in order."""
    now = {(p.maker, p.primitive): p for p in presses}
    fade_ns = round(material.recovery * 1e9)
    kept = [d for d in old if d.share(t_ns) > FADED]
    if material.elasticity == "plastic":
        kept = [_left(d, t_ns, fade_ns) if (d.maker, d.primitive) not in now else _again(d) for d in kept]
        for key, press in now.items():
            if press.depth <= LEAST:
                continue
            near = [i for i, d in enumerate(kept) if (d.maker, d.primitive) == key and _apart(d.shape, press.shape) < 1.0]
            if near:
                i = max(near, key=lambda i: kept[i].depth)
                if press.depth > kept[i].depth + DEEPER:
                    kept[i] = replace(kept[i], shape=press.shape, depth=press.depth)
            else:
                kept.append(DentRecord(next_number, thing, *key, press.shape, press.depth))
                next_number += 1
        return deepest(kept, MOST), next_number
    out: list[DentRecord] = []
    for d in kept:
        press = now.pop((d.maker, d.primitive), None)
        after = _lagging(d, press, material.recovery, body, t_ns, dt)
        if after is not None:
            out.append(after)
    for key, press in now.items():
        if press.depth > LEAST:
            out.append(DentRecord(next_number, thing, *key, press.shape, press.depth))
            next_number += 1
    return deepest(out, MOST), next_number


def deepest(dents: Sequence[DentRecord], most: int) -> tuple[DentRecord, ...]:
    """No more than `most` of the dents, in their order; the shallowest go first, of equals the younger."""
    if len(dents) <= most:
        return tuple(dents)
    kept = {d.number for d in sorted(dents, key=lambda d: (-d.depth, d.number))[:most]}
    return tuple(d for d in dents if d.number in kept)


def imprints(shapes: Sequence[ThingPrimitive]) -> PrimitiveSet:
    """Shapes as a set, in the frame they are given in."""
    return PrimitiveSet.of_kinds(
        [p.kind for p in shapes],
        [p.params for p in shapes],
        np.array([matrix_from_quaternion(p.rotation) for p in shapes]).reshape(-1, 3, 3),
        np.array([p.position for p in shapes]).reshape(-1, 3),
    )


def _left(d: DentRecord, t_ns: int, fade_ns: int) -> DentRecord:
    return d if d.left_ns else replace(d, left_ns=t_ns, fade_ns=fade_ns)


def _again(d: DentRecord) -> DentRecord:
    """Its maker is back: it does not fade while it is there."""
    return replace(d, left_ns=0, fade_ns=0) if d.left_ns and d.fade_ns else d


def _lagging(d: DentRecord, press: Press | None, tau: float, body: PrimitiveSet, t_ns: int, dt: float) -> DentRecord | None:
    """A viscoelastic dent one step on: deeper at once, back with the time constant; None when it has gone."""
    if press is None:  # its maker is off the thing: no pose to follow, so what is left fades
        return _left(d, t_ns, round(tau * 1e9))
    d = _again(d)
    if press.depth >= d.depth:
        return replace(d, shape=press.shape, depth=press.depth) if press.depth > d.depth + 1e-4 else d
    shape = _towards(d.shape, press.shape, 1.0 - math.exp(-dt / tau))
    found = find_contacts(imprints([shape]), body)
    depth = float(found.field_depth.max(initial=0.0))
    return replace(d, shape=shape, depth=depth) if depth > press.depth else replace(d, shape=press.shape, depth=press.depth)


def _towards(a: ThingPrimitive, b: ThingPrimitive, share: float) -> ThingPrimitive:
    params = tuple(x + share * (y - x) for x, y in zip(a.params, b.params, strict=True))
    rotation = slerp(np.ascontiguousarray(a.rotation), np.ascontiguousarray(b.rotation), share)
    return ThingPrimitive(a.kind, params, a.position + share * (b.position - a.position), rotation)


def _apart(a: ThingPrimitive, b: ThingPrimitive) -> float:
    """How far two poses of one shape are apart, 1 = enough for another dent."""
    if a.kind == "cone_sphere":
        p, q = np.array(a.params), np.array(b.params)
        ends = max(float(np.sqrt(((p[k : k + 3] - q[k : k + 3]) ** 2).sum())) for k in (0, 3))
        return (ends + float(np.sqrt(((a.position - b.position) ** 2).sum()))) / (SPACING * max(p[6], p[7]))
    size = min(a.params[:3]) if a.kind.startswith("super") else a.params[0]
    return float(np.sqrt(((a.position - b.position) ** 2).sum())) / (SPACING * size)
