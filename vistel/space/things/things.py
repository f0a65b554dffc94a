"""Things: everything in the room besides people. A thing is a rigid group of implicit primitives."""

import math
from dataclasses import dataclass, field

import numpy as np

from vistel.arrays import F64
from vistel.implicit.contacts.contact_set import KIND_CODES
from vistel.space.things.arc import Arc

MAX_POLYGON = 16
"""Most vertices a rounded polygon of a thing may have."""

_PARAMS = {"sphere": 1, "cone_sphere": 8, "superellipsoid": 5, "supertoroid": 6}


Z_UP: F64 = np.array([math.sin(-math.pi / 4.0), 0.0, 0.0, math.cos(-math.pi / 4.0)])
"""The quaternion that turns a primitive's Z (the axis of round superquadrics) upwards."""


def identity() -> F64:
    """The quaternion of no rotation, (x, y, z, w)."""
    return np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class ThingPrimitive:
    """One primitive of a thing. All sizes are those of its surface, in metres, in its own frame.

    kind and params:

    =============== =========================================================================================
    sphere          r
    cone_sphere     ax, ay, az, bx, by, bz, ra, rb
    rounded_polygon r, x0, y0, z0, x1, y1, z1, ...   planar and convex
    superellipsoid  a1, a2, a3, e1, e2   half axes; e1: profile along Z, e2: outline in XY (1 round)
    supertoroid     a1, a2, a3, alpha, e1, e2   ring about Z of radius alpha*a1; a1, a3: tube's half sizes
    =============== =========================================================================================

    position: (3,) metres and rotation: (4,) quaternion (x, y, z, w), primitive to thing; colour: 0xRRGGBBAA, 0 for that
    of the thing, a colour with AA = 0 for a primitive that is felt and not drawn: a look is drawn instead.
    Raises ValueError for a kind or numbers that make no primitive.
    """

    kind: str
    params: tuple[float, ...]
    position: F64 = field(default_factory=lambda: np.zeros(3))
    rotation: F64 = field(default_factory=identity)
    colour: int = 0

    def __post_init__(self) -> None:
        if self.kind not in KIND_CODES:
            raise ValueError(f"kind: expected one of {', '.join(KIND_CODES)}, got {self.kind!r}")
        if not all(math.isfinite(p) and abs(p) < 100.0 for p in self.params):
            raise ValueError(f"params of {self.kind}: expected finite metres below 100, got {self.params}")
        if self.kind == "rounded_polygon":
            vertices = (len(self.params) - 1) / 3
            if vertices not in range(3, MAX_POLYGON + 1) or self.params[0] <= 0:
                raise ValueError("params of rounded_polygon: expected r > 0 and 3 to 16 vertices of x, y, z")
            return
        if len(self.params) != _PARAMS[self.kind]:
            want = _PARAMS[self.kind]
            raise ValueError(f"params of {self.kind}: expected {want} numbers, got {len(self.params)}")
        sizes = {
            "sphere": self.params,
            "cone_sphere": self.params[6:],
            "superellipsoid": self.params[:3],
            "supertoroid": self.params[:3],
        }[self.kind]
        if min(sizes) <= 0:
            raise ValueError(f"params of {self.kind}: sizes must be above 0, got {self.params}")
        exponents = {"superellipsoid": self.params[3:], "supertoroid": self.params[4:]}.get(self.kind, (1.0,))
        if min(exponents) < 0.1 or max(exponents) > 1.9:
            raise ValueError(f"params of {self.kind}: exponents must lie in 0.1 to 1.9, got {exponents}")

    @property
    def seen(self) -> bool:
        """Whether the primitive itself is drawn."""
        return self.colour == 0 or self.colour & 0xFF != 0


@dataclass(frozen=True, eq=False)
class Look:
    """A polymesh that is drawn for primitives of a thing that are not seen.

    model: digest of the `vistel.space.files.model.Polymesh`; matrix: (3, 3) and offset: (3,) [m] from its frame to that
    of the thing, of the straight one if it was bent; colour: 0xRRGGBBAA in place of its colours and pictures, 0 for these.
    """

    model: str
    matrix: F64 = field(default_factory=lambda: np.eye(3))
    offset: F64 = field(default_factory=lambda: np.zeros(3))
    colour: int = 0

    def placed(self, matrix: F64, offset: F64) -> "Look":
        """The look carried along by the linear map `matrix` (3, 3), then moved by `offset` (3,) [m]."""
        return Look(self.model, matrix @ self.matrix, matrix @ self.offset + offset, self.colour)


@dataclass(frozen=True, eq=False)
class GraspAxis:
    """An axis a hand can close around (mathematics M8.8).

    point (3,) [m] and unit direction (3,) in the thing's frame; radius: from the axis to the surface [m].
    """

    point: F64
    direction: F64
    radius: float


BEARS = 0.5
"""Default force that one place of a sticky thing bears [N]: about that of peeling off sticky tape as wide as a finger."""
ELASTICITIES = ("elastic", "plastic", "viscoelastic")


@dataclass(frozen=True)
class PhysicsMaterial:
    """What a thing is made of.

    elasticity: "elastic" springs back at once, "plastic" keeps its dents, "viscoelastic" recovers slowly; recovery: time
    constant of that, or in which a plastic thing's dents fade, 0 never [s]; sticky: length to which a bond is
    drawn out before it tears [m], 0: nothing sticks; bears: force at which each bond tears [N].
    """

    elasticity: str = "elastic"
    recovery: float = 0.0
    sticky: float = 0.0
    bears: float = BEARS

    def __post_init__(self) -> None:
        if self.elasticity not in ELASTICITIES:
            raise ValueError(f"elasticity: expected one of {', '.join(ELASTICITIES)}, got {self.elasticity!r}")
        if not (0.0 <= self.recovery < 1e4 and 0.0 <= self.sticky <= 0.2):
            raise ValueError("expected recovery of 0 to 10,000 s and sticky of 0 to 0.2 m")
        if not 0.01 <= self.bears <= 200.0:
            raise ValueError("bears: expected 0.01 to 200 N, which a place that sticks bears before it tears")
        if self.elasticity == "viscoelastic" and self.recovery <= 0.0:
            raise ValueError("recovery: a viscoelastic thing needs a time constant above 0 s")

    @property
    def remembers(self) -> bool:
        """Whether touches leave dents or bonds on it."""
        return self.elasticity != "elastic" or self.sticky > 0.0


@dataclass(frozen=True, eq=False)
class Part:
    """A thing that is part of another one: position (3,) and rotation (4,) in the frame of the whole."""

    thing: "Thing"
    position: F64
    rotation: F64


@dataclass(frozen=True)
class Pages:
    """What a panel can show. models: digests of the polymeshes, in order; shown: which of them is among the thing's looks, from 0;
    by: the participant who has put them up; live: while they show their screen, it is seen in place of the page."""

    models: tuple[str, ...]
    shown: int
    by: str
    live: bool = False


@dataclass(frozen=True, eq=False)
class Curve:
    """The straight thing that a bent thing was made from, and its arc."""

    straight: "Thing"
    arc: Arc


@dataclass(frozen=True, eq=False)
class Thing:
    """The description of a thing and its first pose. Its frame's origin is its centre of mass.

    id: unique in the room; name: for people; shape: "ball", "box", ... for lists and speech; mass: kg, 0 =
    fixed to the room; compliance: 0 rigid .. 1 as soft as flesh (mathematics M3.5); colour: 0xRRGGBBAA;
    position (3,) [m] and rotation (4,) quaternion (x, y, z, w), thing to room; axes: axes for grasps;
    parts: the things it was joined from; curve: how it was bent; looks: polymeshes drawn for
    primitives that are not seen; inertia: (3, 3) per kilogram about its centre [m^2], None: that of its primitives;
    hidden: it is felt but not drawn; pages: of a panel.
    """

    id: str
    name: str
    shape: str
    primitives: tuple[ThingPrimitive, ...]
    mass: float
    compliance: float
    colour: int
    position: F64
    rotation: F64 = field(default_factory=identity)
    axes: tuple[GraspAxis, ...] = ()
    material: PhysicsMaterial = field(default_factory=PhysicsMaterial)
    parts: tuple[Part, ...] = ()
    curve: Curve | None = None
    looks: tuple[Look, ...] = ()
    inertia: F64 | None = None
    hidden: bool = False
    pages: Pages | None = None

    @property
    def fixed(self) -> bool:
        """Part of the room: nothing moves it."""
        return self.mass == 0.0
