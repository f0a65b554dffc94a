"""From contacts between primitives to what is told about them: contacts with forces, and ghosts to apply."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.implicit.contact import ContactArray
from vistel.space.people import Posed
from vistel.space.view import ContactView, GhostView

I64 = NDArray[np.int64]

FLESH = 1.5e5
"""Pressure per unit of field overlap [Pa]: makes a fingertip pressed in by 3 mm push with about a newton."""
FLESH_COMPLIANCE = 1.0
LEAST_DEPTH = 2e-4
"""Overlaps shallower than this deform nothing that could be seen [m]."""
MOST_PER_PAIR = 6
"""Contacts told for one pair of bodies; the deepest."""


@dataclass(frozen=True)
class Touch:
    """All overlapping primitives of a figure `a` and one other body, ordered by primitive."""

    body_a: str
    body_b: str
    compliance_b: float
    contacts: ContactArray
    radius: NDArray[np.float64]


def touches_of_things(
    posed: Posed, near: ContactArray, owner: I64, first: I64, things: list[tuple[str, float]]
) -> list[Touch]:
    """Overlaps of a figure with things, one entry per thing; things: (id, compliance) of each."""
    out: list[Touch] = []
    deep = np.flatnonzero(near.depth > LEAST_DEPTH)
    for n, rows in sorted(grouped(owner[near.b[deep]], deep).items()):
        found = _part(near, rows)
        local = replace(found, b=(found.b - first[n]).astype(np.int32))
        name, compliance = things[n]
        out.append(Touch(posed.name, name, compliance, local, _radius(posed, local)))
    return out


def touch_of_people(a: Posed, b: Posed, near: ContactArray) -> list[Touch]:
    """Overlaps of two figures: one entry, or none."""
    deep = np.flatnonzero(near.depth > LEAST_DEPTH)
    if len(deep) == 0:
        return []
    found = _part(near, deep)
    return [Touch(a.name, b.name, FLESH_COMPLIANCE, found, _radius(a, found))]


def contacts_of(touch: Touch) -> list[ContactView]:
    """The deepest contacts, in order of primitives."""
    c = touch.contacts
    deepest = range(len(c))
    if len(c) > MOST_PER_PAIR:  # stable, so that equal depths keep their order
        deepest = np.sort(np.argsort(-c.depth, kind="stable")[:MOST_PER_PAIR]).tolist()
    a, b, depth, field_depth, radius = (x.tolist() for x in (c.a, c.b, c.depth, c.field_depth, touch.radius))
    return [
        ContactView(
            touch.body_a, touch.body_b, a[i], b[i], c.point[i], c.normal[i], depth[i],
            _force(depth[i], field_depth[i], radius[i]),
        )
        for i in deepest
    ]  # fmt: skip


def ghosts_of(touch: Touch) -> list[GhostView]:
    """What deforms what: the other body's field the figure, and the figure's the other body unless it is rigid."""
    c = touch.contacts
    depth = float(c.field_depth.max())
    if depth <= 0.0:
        return []
    reached = c.field_depth > 0.0  # what only lies beyond something thin is not pressed by it
    mine, theirs = tuple(sorted(set(c.a[reached].tolist()))), tuple(sorted(set(c.b[reached].tolist())))
    a, b, soft = touch.body_a, touch.body_b, touch.compliance_b
    out = [GhostView(a, b, mine, theirs, FLESH_COMPLIANCE, soft, depth)]
    if soft > 0.0:
        out.append(GhostView(b, a, theirs, mine, soft, FLESH_COMPLIANCE, depth))
    return out


def grouped(keys: I64, values: I64) -> dict[int, list[int]]:
    """The values of each key, in order."""
    out: dict[int, list[int]] = {}
    for key, value in zip(keys.tolist(), values.tolist(), strict=True):
        out.setdefault(key, []).append(value)
    return out


def _part(near: ContactArray, rows: I64 | list[int]) -> ContactArray:
    return ContactArray(
        near.a[rows], near.b[rows], near.point[rows], near.normal[rows], near.depth[rows], near.field_depth[rows]
    )


def _radius(posed: Posed, c: ContactArray) -> NDArray[np.float64]:
    return 0.5 * (posed.body.radius_a[c.a] + posed.body.radius_b[c.a])


def _force(depth: float, field_depth: float, radius: float) -> float:
    """Newtons: mean pressure, half the overlap of the fields, on the contact disc (spec_maths §4.2)."""
    return FLESH * 0.5 * max(0.0, field_depth) * math.pi * radius * depth
