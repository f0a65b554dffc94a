"""Memory of contacts: none (elastic), dents (plastic), a lagging ghost (viscoelastic) (Singh §C.2; mathematics M5.1).

    memory = ContactMemory({"head": Plastic(), "ball": Viscoelastic(0.4)})
    memory = memory.step(bodies, time, dt)
    shapes = deformed(bodies, [*collisions(bodies), *memory.ghosts(time)], time)

Every ghost is kept in the deformed body's own frame, so dents travel with it. Dents and live contacts combine like
bodies do: the deepest counts, their raised rims add up.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import permutations
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from vistel.geometry.pose import Pose
from vistel.geometry.rotation import matrix_from_quaternion, slerp
from vistel.implicit.checks import positive
from vistel.implicit.contacts.penetration import penetration
from vistel.implicit.ghosts.composition import Imprint
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.graph.ghost_terms import decay_exponential, decay_quartic, lag
from vistel.implicit.graph.shape import Shape

FADED = 1e-3
"""A dent with less than this share left is forgotten."""


@dataclass(frozen=True)
class Decay:
    """How dents fade once their maker has left: over `duration` [s], by a quartic (C1 at both ends) or exponentially."""

    duration: float
    law: str = "quartic"
    laws: ClassVar[Mapping[str, Callable[[float, float], float]]] = MappingProxyType(
        {"quartic": decay_quartic, "exponential": decay_exponential}
    )

    def __post_init__(self) -> None:
        positive("Decay", "duration", self.duration)
        if self.law not in self.laws:
            raise ValueError(f"Decay: law is {self.law!r}, expected one of {', '.join(self.laws)}")

    def share(self, age: float) -> float:
        """What is left `age` seconds after the maker left."""
        return self.laws[self.law](max(0.0, age), self.duration)


@dataclass(frozen=True)
class Elastic:
    """Springs back at once."""


@dataclass(frozen=True)
class Plastic:
    """Keeps the deepest imprint of every contact.

    least: penetration below which nothing stays [field]; spacing: an imprint this far from the last one is another dent [m], None:
    a quarter of the maker's surface radius; most: dents kept of one maker, the deepest; decay: None keeps them for ever.
    """

    least: float = 1e-3
    spacing: float | None = None
    most: int = 24
    decay: Decay | None = None


@dataclass(frozen=True)
class Viscoelastic:
    """Its ghost follows the maker with the time constant tau [s] once that draws back, and fades by `decay`, if any."""

    tau: float = 0.3
    decay: Decay | None = None

    def __post_init__(self) -> None:
        positive("Viscoelastic", "tau", self.tau)


Material = Elastic | Plastic | Viscoelastic


@dataclass(frozen=True, eq=False)
class KeptImprint:
    """An imprint: the maker's shape, its pose in the deformed body's frame, the penetration there [field], and when
    the maker left [s]."""

    shape: Shape
    pose: Pose
    depth: float
    left: float | None = None

    @property
    def placed(self) -> Shape:
        """The maker's shape in the body's frame."""
        return self.shape.moved(*self.pose)

    def distance(self, other: "KeptImprint") -> float:
        """How far apart the two poses are [m]."""
        return math.dist(self.pose.position, other.pose.position)


@dataclass(frozen=True)
class ContactMemory:
    """materials: of the bodies that remember, by name; dents: by (maker, body), oldest first."""

    materials: Mapping[str, Material]
    dents: Mapping[tuple[str, str], tuple[KeptImprint, ...]] = field(default_factory=dict[tuple[str, str], tuple[KeptImprint, ...]])

    def step(self, bodies: Sequence[Deformable], time: float, dt: float) -> "ContactMemory":
        """What is remembered at `time`, with the bodies where they are then, dt seconds after the last step."""
        dents = dict(self.dents)
        for maker, body in permutations(bodies, 2):
            material = self.materials.get(body.name, Elastic())
            if body.compliance == 0 or isinstance(material, Elastic):
                continue
            key = (maker.name, body.name)
            now = _now(maker, body)
            old = dents.get(key, ())
            if isinstance(material, Plastic):
                dents[key] = _plastic(material, old, now, time)
            else:
                dents[key] = _viscoelastic(material, old, now, body, time, dt)
        return replace(self, dents={key: found for key, found in dents.items() if found})

    def ghosts(self, time: float) -> list[Imprint]:
        """The imprints as ghosts at `time`."""
        out: list[Imprint] = []
        for (maker, body), dents in self.dents.items():
            decay = getattr(self.materials.get(body), "decay", None)
            for dent in dents:
                share = 1.0 if decay is None or dent.left is None else decay.share(time - dent.left)
                out.append(Imprint(maker, body, dent.placed, share, dent.depth))
        return out

    def depth(self, maker: str, body: str) -> float:
        """Deepest penetration that `body` remembers of `maker` [field]; 0 where there is none."""
        return max((d.depth for d in self.dents.get((maker, body), ())), default=0.0)


def _now(maker: Deformable, body: Deformable) -> KeptImprint:
    """The maker as an imprint where it is."""
    placed = Pose(np.array(maker.position), np.array(maker.rotation))
    pose = placed.relative_to(matrix_from_quaternion(np.array(body.rotation)), np.array(body.position))
    dent = KeptImprint(maker.shape, pose, 0.0)
    return replace(dent, depth=penetration(body.shape, dent.placed).depth)


def _plastic(material: Plastic, old: tuple[KeptImprint, ...], now: KeptImprint, time: float) -> tuple[KeptImprint, ...]:
    kept = [d for d in old if d.left is None or material.decay is None or material.decay.share(time - d.left) > FADED]
    if now.depth <= material.least:
        return tuple(d if d.left is not None else replace(d, left=time) for d in kept)
    spacing = material.spacing
    if spacing is None:
        spacing = 0.07 * float(np.ptp(now.shape.bounds, axis=0).min())
    near = [i for i, d in enumerate(kept) if d.distance(now) <= spacing]
    if not near:
        kept.append(now)
    elif now.depth > kept[near[-1]].depth:
        kept[near[-1]] = now
    if len(kept) > material.most:
        kept.remove(min(kept, key=lambda d: d.depth))
    return tuple(kept)


def _viscoelastic(
    material: Viscoelastic, old: tuple[KeptImprint, ...], now: KeptImprint, body: Deformable, time: float, dt: float
) -> tuple[KeptImprint, ...]:
    if not old or now.depth >= old[0].depth:
        return (now,) if now.depth > 0 else ()
    before = old[0]
    position = lag(before.pose.position, now.pose.position, dt, material.tau)
    rotation = slerp(before.pose.rotation, now.pose.rotation, 1 - math.exp(-dt / material.tau))
    left = before.left if before.left is not None or now.depth > 0 else time
    after = KeptImprint(before.shape, Pose(position, rotation), 0.0, left)
    after = replace(after, depth=penetration(body.shape, after.placed).depth)
    if after.depth <= now.depth:
        return (now,) if now.depth > 0 else ()
    faded = material.decay is not None and left is not None and material.decay.share(time - left) <= FADED
    return () if faded else (after,)
