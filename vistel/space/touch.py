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
    for n in np.unique(owner[near.b]):
        chosen = (owner[near.b] == n) & (near.depth > LEAST_DEPTH)
        if chosen.any():
            found = _part(near, chosen)
            local = replace(found, b=(found.b - first[n]).astype(np.int32))
            name, compliance = things[int(n)]
            out.append(Touch(posed.name, name, compliance, local, _radius(posed, local)))
    return out


def touch_of_people(a: Posed, b: Posed, near: ContactArray) -> list[Touch]:
    """Overlaps of two figures: one entry, or none."""
    chosen = near.depth > LEAST_DEPTH
    if not chosen.any():
        return []
    found = _part(near, chosen)
    return [Touch(a.name, b.name, FLESH_COMPLIANCE, found, _radius(a, found))]


def contacts_of(touch: Touch) -> list[ContactView]:
    """The deepest contacts, in order of primitives."""
    c = touch.contacts
    # Stable, so that equal depths keep their order.
    deepest = np.sort(np.argsort(-c.depth, kind="stable")[:MOST_PER_PAIR])
    return [
        ContactView(
            touch.body_a, touch.body_b, int(c.a[i]), int(c.b[i]), c.point[i], c.normal[i], float(c.depth[i]),
            _force(float(c.depth[i]), float(c.field_depth[i]), float(touch.radius[i])),
        )
        for i in deepest
    ]  # fmt: skip


def ghosts_of(touch: Touch) -> list[GhostView]:
    """What deforms what: the other body's field the figure, and the figure's the other body unless it is rigid."""
    c = touch.contacts
    depth = float(c.field_depth.max())
    if depth <= 0.0:
        return []
    mine, theirs = tuple(np.unique(c.a).tolist()), tuple(np.unique(c.b).tolist())
    a, b, soft = touch.body_a, touch.body_b, touch.compliance_b
    out = [GhostView(a, b, mine, theirs, FLESH_COMPLIANCE, soft, depth)]
    if soft > 0.0:
        out.append(GhostView(b, a, theirs, mine, soft, FLESH_COMPLIANCE, depth))
    return out


def _part(near: ContactArray, chosen: NDArray[np.bool_]) -> ContactArray:
    return ContactArray(
        near.a[chosen], near.b[chosen], near.point[chosen], near.normal[chosen], near.depth[chosen],
        near.field_depth[chosen],
    )  # fmt: skip


def _radius(posed: Posed, c: ContactArray) -> NDArray[np.float64]:
    return 0.5 * (posed.body.radius_a[c.a] + posed.body.radius_b[c.a])


def _force(depth: float, field_depth: float, radius: float) -> float:
    """Newtons: mean pressure, half the overlap of the fields, on the contact disc (spec_maths §4.2)."""
    return FLESH * 0.5 * max(0.0, field_depth) * math.pi * radius * depth
