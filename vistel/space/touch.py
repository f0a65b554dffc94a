"""Turns contacts between primitives into the published contacts with forces, and into ghosts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.implicit.contacts.contact import ContactArray
from vistel.space.dynamics.solids import Solids
from vistel.space.people import Posed
from vistel.space.view import ContactView, GhostView

FLESH = 1.5e5
"""Pressure per unit of field overlap [Pa]: makes a fingertip pressed in by 3 mm push with about a newton."""
FLESH_COMPLIANCE = 1.0
LEAST_DEPTH = 2e-4
"""Overlaps shallower than this deform nothing that could be seen [m]."""
MOST_PER_PAIR = 6
"""Most published contacts of one pair of bodies; the deepest ones."""

_PERSON = 0
_FIXED = 1
"""A thing that nothing moves."""
_LOOSE = 2
"""A thing that may move."""


@dataclass(frozen=True)
class _Part:
    """Contacts of one person with another, or with all things that are fixed or loose."""

    who: int
    kind: int
    other: str
    contacts: ContactArray


@dataclass(frozen=True)
class _Overlaps:
    """All overlaps of a step, those of two bodies side by side: first[g] : first[g + 1], by primitive. part, thing: (G,)
    index of their part, and of the thing if the other body is one; a, b: primitives of the two bodies; force [N]."""

    first: list[int]
    part: list[int]
    thing: list[int]
    a: list[int]
    b: list[int]
    point: F64
    normal: F64
    depth: list[float]
    field_depth: list[float]
    force: list[float]


_Views = tuple[list[ContactView], list[GhostView]]


class Touches:
    """What is published of the bodies that touch. What fixed things and somebody who has not moved give is kept."""

    def __init__(self) -> None:
        self._solids: Solids | None = None
        self._kept: dict[str, tuple[ContactArray, _Views]] = {}  # with fixed things; saves time, is no state

    def step(
        self,
        posed: Mapping[str, Posed],
        skin: Mapping[tuple[str, str], ContactArray],
        rest: Mapping[str, ContactArray],
        near: Mapping[str, ContactArray],
        s: Solids,
        most: int,
    ) -> tuple[tuple[ContactView, ...], tuple[GhostView, ...]]:
        """The published contacts of all people, at most `most`, and the ghosts that deform people and things.

        skin: contacts of every two people who touch, by their names in order; rest: with fixed things, by their primitive
        among those, the same object as in the step before where nothing moved; near: with loose things.
        """
        people = [posed[name] for name in sorted(posed)]
        same = self._kept if self._solids is s else {}
        kept = {p.name: same[p.name] for p in people if p.name in same and same[p.name][0] is rest[p.name]}
        parts = _parts(people, skin, rest, near)
        new = [part for part in parts if part.kind != _FIXED or people[part.who].name not in kept]
        of_new = iter(_views(people, new, s))
        contacts: list[ContactView] = []
        ghosts: list[GhostView] = []
        for part in parts:
            name = people[part.who].name
            views = kept[name][1] if part.kind == _FIXED and name in kept else next(of_new)
            if part.kind == _FIXED:
                kept[name] = rest[name], views
            contacts += views[0]
            ghosts += views[1]
        self._solids, self._kept = s, kept
        return tuple(contacts[:most]), tuple(ghosts)


def _views(people: list[Posed], parts: list[_Part], s: Solids) -> list[_Views]:
    """Contacts and ghosts of each part."""
    out: list[_Views] = [([], []) for _ in parts]
    if not parts:
        return out
    o = _overlaps(people, parts, s)
    for g, (i, j) in enumerate(zip(o.first[:-1], o.first[1:], strict=True)):
        part, (contacts, ghosts) = parts[o.part[g]], out[o.part[g]]
        name, other, soft = people[part.who].name, part.other, FLESH_COMPLIANCE
        if part.kind != _PERSON:
            thing = s.things[o.thing[g]]
            other, soft = thing.id, thing.compliance
        contacts += [
            ContactView(name, other, o.a[k], o.b[k], o.point[k], o.normal[k], o.depth[k], o.force[k])
            for k in _deepest(o.depth, i, j)
        ]
        ghosts += _ghosts(name, other, soft, o, i, j)
    return out


def _parts(
    people: list[Posed],
    skin: Mapping[tuple[str, str], ContactArray],
    rest: Mapping[str, ContactArray],
    near: Mapping[str, ContactArray],
) -> list[_Part]:
    """The contacts by person and other body, in the order of publication."""
    met: dict[str, list[str]] = {}
    for name, other in sorted(skin):
        met.setdefault(name, []).append(other)
    out: list[_Part] = []
    for who, p in enumerate(people):
        name = p.name
        out += [_Part(who, _PERSON, other, skin[name, other]) for other in met.get(name, ()) if len(skin[name, other])]
        out += [_Part(who, kind, "", c) for kind, c in ((_FIXED, rest[name]), (_LOOSE, near[name])) if len(c)]
    return out


def _overlaps(people: list[Posed], parts: list[_Part], s: Solids) -> _Overlaps:
    part = np.repeat(np.arange(len(parts)), [len(p.contacts) for p in parts])
    depth = np.concatenate([p.contacts.depth for p in parts])
    deep = np.flatnonzero(depth > LEAST_DEPTH)
    part, depth = part[deep], depth[deep]
    a = np.concatenate([p.contacts.a for p in parts])[deep]
    b = np.concatenate([p.contacts.b for p in parts])[deep].astype(np.int64)
    kind = np.array([p.kind for p in parts])[part]
    b[kind == _FIXED] = s.fixed_rows[b[kind == _FIXED]]
    thing = np.zeros(len(deep), np.int64)
    on_thing = kind != _PERSON
    thing[on_thing] = s.owner[b[on_thing]]
    b[on_thing] -= s.first[thing[on_thing]]
    key = part * len(s.things) + thing
    order = np.argsort(key, kind="stable")
    first = np.concatenate([[0], np.flatnonzero(np.diff(key[order])) + 1]) if len(order) else np.zeros(0, np.int64)
    # The mean radius of each limb: on a disc of that size times the depth it presses (mathematics M7.4).
    limbs = np.cumsum([0, *(len(p.primitives) for p in people)])[np.array([p.who for p in parts])][part] + a
    radius = 0.5 * (np.concatenate([p.body.radius_a for p in people]) + np.concatenate([p.body.radius_b for p in people]))
    field_depth = np.concatenate([p.contacts.field_depth for p in parts])[deep]
    force = FLESH * 0.5 * np.maximum(0.0, field_depth) * math.pi * radius[limbs] * depth
    rows = deep[order]
    return _Overlaps(
        [*first.tolist(), len(order)],
        part[order[first]].tolist(),
        thing[order[first]].tolist(),
        a[order].tolist(),
        b[order].tolist(),
        np.concatenate([p.contacts.point for p in parts])[rows],
        np.concatenate([p.contacts.normal for p in parts])[rows],
        depth[order].tolist(),
        field_depth[order].tolist(),
        force[order].tolist(),
    )


def _deepest(depth: list[float], i: int, j: int) -> list[int] | range:
    """The deepest of the contacts i to j, in order of primitives; of equal depths the first."""
    if j - i <= MOST_PER_PAIR:
        return range(i, j)
    return sorted(sorted(range(i, j), key=lambda k: -depth[k])[:MOST_PER_PAIR])


def _ghosts(a: str, b: str, soft: float, o: _Overlaps, i: int, j: int) -> list[GhostView]:
    """The ghosts of two bodies: the other body deforms the figure, and the figure deforms the other body unless that is rigid."""
    depth = max(o.field_depth[i:j])
    if depth <= 0.0:
        return []
    reached = [k for k in range(i, j) if o.field_depth[k] > 0.0]  # a primitive behind a thin body is not pressed
    mine, theirs = tuple(sorted({o.a[k] for k in reached})), tuple(sorted({o.b[k] for k in reached}))
    out = [GhostView(a, b, mine, theirs, FLESH_COMPLIANCE, soft, depth)]
    if soft > 0.0:
        out.append(GhostView(b, a, theirs, mine, soft, FLESH_COMPLIANCE, depth))
    return out
