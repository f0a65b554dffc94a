"""Which contacts are published: a new one at once, one that has ended a little later.

A ghost that is listed longer than it acts deforms nothing, because its field no longer reaches the other body. So a contact that
comes and goes at its edge is not published again and again."""

from collections.abc import Container
from dataclasses import dataclass, field

from vistel.space.view import WorldView
from vistel.wire.world.codec.touches import TouchCode, level_of

LINGER_STEPS = 30
"""How long a limb that no longer touches stays listed."""
FORCE_STEPS = 12
"""A force is published at most five times a second."""

FADING = 0.9
"""Factor per step by which the published force falls after the real one has ended, so that the strongest of some steps is
published."""

_Names = tuple[str, str]


@dataclass
class _Pair:
    last: dict[int, int] = field(default_factory=dict[int, int])
    force: float = 0.0
    level: int = -1
    told: int = 0


class Touching:
    """The pairs of one world, by who is deformed and by whom; things that are deformed follow from these."""

    def __init__(self) -> None:
        self._pairs: dict[_Names, _Pair] = {}
        self._step = 0

    def begin(self, view: WorldView) -> None:
        """Drop all pairs and begin with this step."""
        self._pairs = {}
        self.step(view)

    def step(self, view: WorldView) -> None:
        """Take in the contacts of a step."""
        self._step = view.step
        people = frozenset(view.participants)
        for g in view.ghosts:
            if g.target in people:
                pair = self._pairs.get((g.target, g.source))
                if pair is None:
                    pair = self._pairs[g.target, g.source] = _Pair()
                pair.last.update(dict.fromkeys(g.target_primitives, view.step))
        force: dict[_Names, float] = {}
        for c in view.contacts:
            names = c.body_a, c.body_b
            force[names] = force.get(names, 0.0) + c.force
        for (a, b), pair in self._pairs.items():
            newtons = force.get((a, b)) or force.get((b, a), 0.0)
            pair.force = max(newtons, FADING * pair.force)

    def now(self, bodies: Container[str]) -> dict[_Names, TouchCode]:
        """The contacts to publish now. bodies: who and what is in the room."""
        out: dict[_Names, TouchCode] = {}
        for names, pair in list(self._pairs.items()):
            least = self._step - LINGER_STEPS
            limbs = sum([1 << i for i, step in pair.last.items() if step > least])
            if not limbs or names[0] not in bodies or names[1] not in bodies:
                del self._pairs[names]
                continue
            level = level_of(pair.force)
            if pair.level < 0 or (abs(level - pair.level) > 1 and self._step - pair.told >= FORCE_STEPS):
                pair.level, pair.told = level, self._step
            out[names] = TouchCode(limbs, pair.level)
        return out
