"""Bodies under ghosts: any number of ghosts of any kind compose into one field per body (Singh §2.1, App. C; mathematics M3).

    a = Deformable("a", vi.Sphere((0, 0, 0), 1.0))
    b = Deformable("b", vi.Sphere((0, 0, 0), 1.0), position=(0.9, 0, 0))
    shapes = deformed([a, b], [*collisions([a, b]), Force("wind", "a", Directional((1, 0, 0), 0.3))])
    program = vi.compile(shapes["a"])

Ghosts act in ascending priority. Ghosts of one priority see the fields that the lower ones have left: force fields
(priority 0) first, then contacts (10), so that a body blown against a wall is stopped by the wall (Figure 72).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import permutations

import numpy as np

from vistel.implicit.checks import ShapeError, finite, within
from vistel.implicit.constants import BETA, LONGEST_ZONE
from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.contacts.penetration import penetration
from vistel.implicit.ghosts.constraint import KAPPA, Constraint, ConstraintGhost, strongest
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.ghosts.force_field import Force, force_ghost
from vistel.implicit.ghosts.ghost_kind import CONTACT, Ghost
from vistel.implicit.graph.combine import Extremum, Sum
from vistel.implicit.graph.ghost_nodes import Deficit, Ghosted, Raised
from vistel.implicit.graph.shape import Shape


@dataclass(frozen=True)
class Collision(Ghost):
    """The owner's field pushes the target's surface in where both overlap, and raises it round there (Gascuel 1993).

    zone: ye of the propagation [field]; None: three times the measured penetration, so that nothing pops (mathematics M3.4).
    """

    zone: float | None = None
    priority: int = field(default=CONTACT, kw_only=True)


@dataclass(frozen=True, eq=False)
class Imprint(Ghost):
    """What the owner leaves behind: its field where it once was, in the target's frame (Singh §C.2).

    share: 1 for all of the dent, less for one that fades; depth: penetration it was made with [field].
    """

    shape: Shape
    share: float = 1.0
    depth: float = 0.0
    priority: int = field(default=CONTACT, kw_only=True)

    def __post_init__(self) -> None:
        within("Imprint", "share", self.share, 0.0, 1.0)
        finite("Imprint", "depth", self.depth)


def collisions(bodies: Iterable[Deformable]) -> list[Collision]:
    """Every body against every other, where their realms meet and one of the two can give way."""
    return [Collision(a.name, b.name) for a, b in permutations(bodies, 2) if b.compliance > 0 and _overlap(a.placed, b.placed)]


def deformed(bodies: Sequence[Deformable], ghosts: Iterable[Ghost | Constraint], time: float = 0.0) -> dict[str, Shape]:
    """The field of every body under all ghosts that act at `time` [s]; bodies no ghost reaches keep theirs.

    Raises ShapeError for names that are no body's, and for two bodies of one name.
    """
    by_name = {body.name: body for body in bodies}
    if len(by_name) != len(bodies):
        raise ShapeError("deformed: two bodies have one name, expected a name for each")
    acting: list[Ghost] = []
    for ghost in ghosts:
        if isinstance(ghost, Constraint):
            _known(by_name, ghost.a, ghost.b)
            parts: Sequence[Ghost] = ghost.pulls(by_name[ghost.a], by_name[ghost.b], time)
        else:
            _known(by_name, ghost.target)
            parts = (ghost,)
        acting += [part for part in parts if part.acts(time)]
    fields: dict[str, Shape] = {name: body.placed for name, body in by_name.items()}
    for priority in sorted({ghost.priority for ghost in acting}):
        depths: dict[frozenset[str], float] = {}
        level = [ghost for ghost in acting if ghost.priority == priority]
        fields = {
            name: _under(body, by_name, fields, [g for g in level if g.target == name], depths) for name, body in by_name.items()
        }
    return fields


def _known(bodies: Mapping[str, Deformable], *names: str) -> None:
    for name in names:
        if name not in bodies:
            raise ShapeError(f"deformed: a ghost names {name!r}, expected one of {sorted(bodies)}")


def _under(
    body: Deformable,
    bodies: Mapping[str, Deformable],
    fields: Mapping[str, Shape],
    ghosts: Sequence[Ghost],
    depths: dict[frozenset[str], float],
) -> Shape:
    """The field of one body under ghosts of one priority."""
    own = fields[body.name]
    if body.compliance == 0 or not ghosts:
        return own
    forces = [g for g in ghosts if isinstance(g, Force)]
    parts: list[tuple[float, Shape]] = [(1.0, f) for f in ([force_ghost(body.placed, own, forces)] if forces else [])]
    touching = _Contacts(body, bodies, fields, depths)
    for owner in dict.fromkeys(g.owner for g in ghosts if isinstance(g, Collision | ConstraintGhost)):
        _known(bodies, owner)
        touching.add_body(owner, [g for g in ghosts if g.owner == owner])
    for g in ghosts:
        if isinstance(g, Imprint):
            touching.add_imprint(g, _compliance(bodies, g.owner))
    contact = touching.ghost()
    if contact is not None:
        parts.append((1.0, contact))
    if not parts:
        return own if not touching.cuts else Ghosted((own, 0.0 * own, *touching.cuts))
    ghost = parts[0][1] if len(parts) == 1 else Sum(tuple(s for _, s in parts))
    return Ghosted((own, ghost, *touching.cuts))


def _compliance(bodies: Mapping[str, Deformable], name: str) -> float:
    """Of a body that may have left: then as soft as flesh."""
    return bodies[name].compliance if name in bodies else 1.0


class _Contacts:
    """Everything that presses on or pulls at one body, combined by the rule for any number of bodies (mathematics M3.5)."""

    def __init__(
        self, body: Deformable, bodies: Mapping[str, Deformable], fields: Mapping[str, Shape], depths: dict[frozenset[str], float]
    ) -> None:
        self.body, self.bodies, self.fields, self.depths = body, bodies, fields, depths
        self.cuts: list[Shape] = []
        self._others: list[tuple[float, Shape, Shape | None, float, float, float]] = []

    def add_body(self, name: str, ghosts: Sequence[Ghost]) -> None:
        """Collision with another body, and the pulls of its constraints, as one ghost (mathematics M4.6)."""
        other, mine = self.fields[name], self.fields[self.body.name]
        if not _overlap(other, mine):
            return
        pulls = [g for g in ghosts if isinstance(g, ConstraintGhost) and g.strength > 0]
        reach = strongest(pulls, self.body.placed) if pulls else None
        hold = max((g.hold for g in pulls), default=0.0)
        rigid = self.bodies[name].compliance == 0
        if rigid:
            self.cuts.append(other)
            if reach is None:
                return
        quotient = self.body.compliance / self.bodies[name].compliance if not rigid else KAPPA[1]
        quotient = min(max(quotient, KAPPA[0]), KAPPA[1])
        zones = [g.zone for g in ghosts if isinstance(g, Collision) and g.zone is not None]
        # A soft body rises steeply round a stiff one: less far, so that it stays as high as beside an equal.
        zone = 0.0 if rigid else zones[0] if zones else BETA * self._depth(name, mine, other) / max(1.0, quotient)
        self._others.append((quotient, other, reach, zone, hold, 1.0))

    def add_imprint(self, imprint: Imprint, compliance: float) -> None:
        """A dent, held in the target's frame."""
        if imprint.share <= 0:
            return
        shape = imprint.shape.moved(self.body.position, self.body.rotation)
        quotient = min(max(self.body.compliance / max(compliance, 1e-9), KAPPA[0]), KAPPA[1])
        zone = BETA * imprint.depth / max(1.0, quotient) if compliance > 0 else 0.0  # rigid ones raise no rim
        self._others.append((quotient, shape, None, zone, 0.0, imprint.share))

    def ghost(self) -> Shape | None:
        """min(sum of raised skins, every deficit), None where nothing acts."""
        if not self._others:
            return None
        n = len(self._others)
        raised: list[Shape] = []
        weights: list[float] = []
        deficits: list[Shape] = []
        for quotient, other, reach, zone, hold, share in self._others:
            rim = max(0.0, min(zone, T, LONGEST_ZONE / (quotient * n)))
            if rim > 0 or reach is not None:
                raised.append(Raised((other,) if reach is None else (other, reach), rim, hold))
                weights.append(quotient * share)
            deficits.append(Sum((Deficit((other,), share),), (quotient,)))
        if not raised:
            raised, weights = [0.0 * self.fields[self.body.name]], [1.0]
        return Extremum((Sum(tuple(raised), tuple(weights)), *deficits), largest=False)

    def _depth(self, name: str, mine: Shape, other: Shape) -> float:
        pair = frozenset((self.body.name, name))
        if pair not in self.depths:
            self.depths[pair] = penetration(mine, other).depth
        return self.depths[pair]


def _overlap(a: Shape, b: Shape) -> bool:
    p, q = a.bounds, b.bounds
    return bool(np.all(p[0] < q[1]) and np.all(q[0] < p[1]))
