"""Turns contacts between primitives into the published contacts with forces, and into ghosts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

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


@dataclass(frozen=True)
class _Overlaps:
    """Contacts of a person with another, or with things. a, b: primitives of the two bodies; radius: of a's limbs [m]."""

    contacts: ContactArray
    a: list[int]
    b: list[int]
    depth: list[float]
    field_depth: list[float]
    radius: list[float]

    def view(self, name: str, other: str, k: int) -> ContactView:
        """Contact k as it is published."""
        # On a disc of the limb's size times the depth it presses (mathematics M7.4).
        force = FLESH * 0.5 * max(0.0, self.field_depth[k]) * math.pi * self.radius[self.a[k]] * self.depth[k]
        point, normal = self.contacts.point[k], self.contacts.normal[k]
        return ContactView(name, other, self.a[k], self.b[k], point, normal, self.depth[k], force)


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
        same = self._kept if self._solids is s else {}
        kept: dict[str, tuple[ContactArray, _Views]] = {}
        contacts: list[ContactView] = []
        ghosts: list[GhostView] = []
        met: dict[str, list[str]] = {}
        for name, other in sorted(skin):
            met.setdefault(name, []).append(other)
        for name in sorted(posed):
            p, fixed, old = posed[name], rest[name], same.get(name)
            views = [_with_person(p, other, skin[name, other]) for other in met.get(name, ())]
            kept[name] = old if old is not None and old[0] is fixed else (fixed, _with_things(p, fixed, s.fixed_places, s))
            views += [kept[name][1], _with_things(p, near[name], s.places, s)]
            for of_bodies in views:
                contacts += of_bodies[0]
                ghosts += of_bodies[1]
        self._solids, self._kept = s, kept
        return tuple(contacts[:most]), tuple(ghosts)


def _with_person(p: Posed, other: str, c: ContactArray) -> _Views:
    o = _Overlaps(c, c.a.tolist(), c.b.tolist(), c.depth.tolist(), c.field_depth.tolist(), p.build.radius)
    return _views(p.name, other, FLESH_COMPLIANCE, o, [k for k, depth in enumerate(o.depth) if depth > LEAST_DEPTH])


def _with_things(p: Posed, c: ContactArray, places: list[tuple[int, int]], s: Solids) -> _Views:
    """Contacts and ghosts with things, in their order. places: thing, and its primitive, for each b of `c`."""
    contacts: list[ContactView] = []
    ghosts: list[GhostView] = []
    b: list[int] = c.b.tolist()
    theirs = [places[k] for k in b]
    o = _Overlaps(c, c.a.tolist(), [k for _, k in theirs], c.depth.tolist(), c.field_depth.tolist(), p.build.radius)
    met: dict[int, list[int]] = {}
    for k, ((n, _), depth) in enumerate(zip(theirs, o.depth, strict=True)):
        if depth > LEAST_DEPTH:
            met.setdefault(n, []).append(k)
    for n in sorted(met):
        views = _views(p.name, s.things[n].id, s.things[n].compliance, o, met[n])
        contacts += views[0]
        ghosts += views[1]
    return contacts, ghosts


def _views(name: str, other: str, soft: float, o: _Overlaps, rows: list[int]) -> _Views:
    """The deepest contacts of two bodies, and their ghosts."""
    return [o.view(name, other, k) for k in _deepest(o.depth, rows)], _ghosts(name, other, soft, o, rows)


def _deepest(depth: list[float], rows: list[int]) -> list[int]:
    """The deepest of some contacts, in order of primitives; of equal depths the first."""
    if len(rows) <= MOST_PER_PAIR:
        return rows
    return sorted(sorted(rows, key=lambda k: -depth[k])[:MOST_PER_PAIR])


def _ghosts(a: str, b: str, soft: float, o: _Overlaps, rows: list[int]) -> list[GhostView]:
    """The ghosts of two bodies: the other body deforms the figure, and the figure deforms the other body unless that is rigid."""
    reached = [k for k in rows if o.field_depth[k] > 0.0]  # a primitive behind a thin body is not pressed
    if not reached:
        return []
    depth = max(o.field_depth[k] for k in reached)
    mine, theirs = tuple(sorted({o.a[k] for k in reached})), tuple(sorted({o.b[k] for k in reached}))
    out = [GhostView(a, b, mine, theirs, FLESH_COMPLIANCE, soft, depth)]
    if soft > 0.0:
        out.append(GhostView(b, a, theirs, mine, soft, FLESH_COMPLIANCE, depth))
    return out
