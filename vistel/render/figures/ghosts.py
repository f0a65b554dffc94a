"""The ghosts that deform each figure at an instant: whom they act on says the world, where they are, playout."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vistel.figure.body import Body, PosedBody
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of
from vistel.render.stage.stage import Instant
from vistel.render.stage.world_view import ActingGhost
from vistel.space.things.things import Thing


class Touching(Protocol):
    """A figure, as far as it acts on others."""

    body: Body

    def ghosts(self, posed: PosedBody, target: NDArray[np.bool_] | None) -> GhostSource:
        """This figure as ghosts that act on the primitives `target` (P,) of another one, None for all."""
        ...


class Ghosts:
    """Makes ghost sources from the world's pairs; keeps the primitives of things it has met."""

    def __init__(self) -> None:
        self._solids: dict[str, tuple[Thing, PrimitiveSet]] = {}

    def of(self, instant: Instant, shapes: Mapping[str, Touching], posed: Mapping[str, PosedBody]) -> dict[str, list[GhostSource]]:
        """What acts on each figure. posed: every figure's primitives at this instant.

        Pairs with a body that is not here (just left, or not yet arrived) are passed over.
        """
        out: dict[str, list[GhostSource]] = {}
        for ghost in instant.world.ghosts:
            if ghost.target not in posed or ghost.source == ghost.target:
                continue
            target = _mask(ghost.target_primitives, len(shapes[ghost.target].body))
            if ghost.source in posed:
                source = shapes[ghost.source].ghosts(posed[ghost.source], target)
            elif ghost.source in instant.things and ghost.source in instant.world.poses:
                source = self._of_thing(instant, ghost, target)
            else:
                continue
            out.setdefault(ghost.target, []).append(source)
        return out

    def _of_thing(self, instant: Instant, ghost: ActingGhost, target: np.ndarray | None) -> GhostSource:
        thing = instant.things[ghost.source]
        known = self._solids.get(thing.id)
        if known is None or known[0] is not thing:
            known = self._solids[thing.id] = thing, _solid(thing)
        position, rotation = instant.world.poses[thing.id]
        placed = known[1].moved(matrix_from_quaternion(rotation), position)
        compliance = min(50.0, max(0.0, ghost.compliance_source))
        return ghosts_of(placed, compliance=compliance, target=target)


def _mask(primitives: object, count: int) -> np.ndarray | None:
    """(P,) of the primitives named; None, all, when none is."""
    chosen = [int(i) for i in primitives if int(i) < count]  # type: ignore[attr-defined]
    if not chosen:
        return None
    out = np.zeros(count, np.bool_)
    out[chosen] = True
    return out


def _solid(thing: Thing) -> PrimitiveSet:
    return PrimitiveSet.of_kinds(
        [p.kind for p in thing.primitives],
        [p.params for p in thing.primitives],
        np.array([matrix_from_quaternion(p.rotation) for p in thing.primitives]),
        np.array([p.position for p in thing.primitives]),
    )
