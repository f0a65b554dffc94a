"""The tables of a scene file as checked data (pydantic), one model for each kind of shape, solid, light and texture."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal, cast

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, model_validator

from vistel.implicit.blend import Blend

Number = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Vec = tuple[Number, Number, Number]
Unit = Annotated[float, Field(ge=0, le=1)]
Colour = tuple[Unit, Unit, Unit]
Part = Annotated[float, Field(ge=0, le=10)]


class Entry(BaseModel):
    """A table of the file: no key it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class CameraEntry(Entry):
    """field_of_view in degrees across the width, or height in metres for an orthographic view."""

    position: Vec
    target: Vec = (0.0, 0.0, 0.0)
    up: Vec = (0.0, 1.0, 0.0)
    field_of_view: Annotated[float, Field(gt=0, lt=180)] = 40.0
    height: Positive | None = None


class LightEntry(Entry):
    """A lamp at `position` or parallel light from `towards`."""

    position: Vec | None = None
    towards: Vec | None = None
    colour: tuple[Part, Part, Part] = (1.0, 1.0, 1.0)
    shadows: bool = True


class CheckerEntry(Entry):
    """Colours of a chequered solid; size of its cubes [m]."""

    checker: tuple[Colour, Colour]
    size: Positive = 0.1


class ImageEntry(Entry):
    """Colours of a picture; scale: metres that it covers."""

    image: Path
    projection: Literal["planar", "cylindrical", "spherical"] = "planar"
    scale: Positive = 1.0


class WavesEntry(Entry):
    """Straight waves on a surface; length [m]."""

    waves: Number
    length: Positive
    direction: Vec = (0.0, 1.0, 0.0)


class RipplesEntry(Entry):
    """Round waves on a surface; length [m]."""

    ripples: Number
    length: Positive


class ImageHeightEntry(ImageEntry):
    """Bumps by the brightness of a picture; height [m]."""

    height: Number


def _by_key(*keys: str) -> Discriminator:
    """Picks the table's kind by the first of these keys it has."""

    def pick(value: Any) -> str | None:
        return next((key for key in keys if isinstance(value, dict) and key in value), None)

    return Discriminator(pick, "no_key", f"expected a table with one of the keys {', '.join(keys)}")


TextureEntry = Annotated[Annotated[CheckerEntry, Tag("checker")] | Annotated[ImageEntry, Tag("image")], _by_key("checker", "image")]
BumpEntry = Annotated[
    Annotated[WavesEntry, Tag("waves")] | Annotated[RipplesEntry, Tag("ripples")] | Annotated[ImageHeightEntry, Tag("image")],
    _by_key("waves", "ripples", "image"),
]


class MaterialEntry(Entry):
    """A colour and what the surface does with light."""

    colour: Colour = (0.8, 0.5, 0.4)
    ambient: Part = 0.1
    diffuse: Part = 0.8
    specular: Part = 0.2
    shininess: Positive = 40.0
    reflection: Unit = 0.0
    texture: TextureEntry | None = None
    bump: BumpEntry | None = None


class TurnEntry(Entry):
    """angle in degrees about axis."""

    axis: Vec = (0.0, 1.0, 0.0)
    angle: Number


class Placing(Entry):
    """Where something is put: scaled about its origin, turned, then moved."""

    scale: Positive | tuple[Positive, Positive, Positive] = 1.0
    rotate: TurnEntry | None = None
    translate: Vec = (0.0, 0.0, 0.0)

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """(x, y, z, w)."""
        if self.rotate is None:
            return (0.0, 0.0, 0.0, 1.0)
        length = math.hypot(*self.rotate.axis)
        half = math.radians(self.rotate.angle) / 2
        s = math.sin(half) / length
        x, y, z = self.rotate.axis
        return (x * s, y * s, z * s, math.cos(half))

    @model_validator(mode="after")
    def _turns(self) -> Placing:
        if self.rotate is not None and math.hypot(*self.rotate.axis) == 0:
            raise ValueError("rotate.axis is (0, 0, 0), expected a direction")
        return self


class PolyhedronEntry(Placing):
    """A polyhedron: exactly one of file, box, sphere, torus, prism; or vertices with faces."""

    file: Path | None = None
    box: Vec | None = None
    """Half extents."""
    sphere: Positive | None = None
    torus: tuple[Positive, Positive] | None = None
    """Radius of the ring and of the tube, about z."""
    prism: list[tuple[Number, Number]] | None = None
    depth: tuple[Number, Number] = (0.0, 1.0)
    """From and to where along z the prism reaches."""
    divisions: tuple[Annotated[int, Field(ge=3, le=2000)], Annotated[int, Field(ge=3, le=2000)]] = (12, 24)
    """Of a sphere: rings, sectors; of a torus: around, across."""
    vertices: list[Vec] | None = None
    faces: list[list[int]] | None = None

    @model_validator(mode="after")
    def _one(self) -> PolyhedronEntry:
        given = [n for n in ("file", "box", "sphere", "torus", "prism", "vertices") if getattr(self, n) is not None]
        if len(given) != 1:
            raise ValueError(f"has {' and '.join(given) or 'none'}, expected one of file, box, sphere, torus, prism, vertices")
        if (self.vertices is None) != (self.faces is None):
            raise ValueError("vertices and faces go together")
        return self


class MeshEntry(Placing):
    """A polygon object: `solid`, or a square floor at height `ground` reaching `extent` metres each way."""

    solid: PolyhedronEntry | None = None
    ground: Number | None = None
    extent: Positive = 100.0
    material: str | None = None
    smooth: bool = False

    @model_validator(mode="after")
    def _one(self) -> MeshEntry:
        if (self.solid is None) == (self.ground is None):
            raise ValueError("expected either solid or ground")
        return self


def _blend(value: Any) -> Any:
    if isinstance(value, str):
        return Blend(value)
    if isinstance(value, dict):
        try:
            return Blend(**cast("dict[str, Any]", value))
        except TypeError as e:
            raise ValueError("expected a table with family and warp") from e
    return value


BlendEntry = Annotated[Blend, BeforeValidator(_blend)]


class ShapeEntry(Placing):
    """What every shape may have."""

    material: str | None = None


class PrimitiveEntry(ShapeEntry):
    """weight and blend as in <V, S, f>; sizes: whether radii are those of the surface F = T or of the influence V."""

    weight: Number = 1.0
    blend: BlendEntry = Blend("quartic")
    sizes: Literal["surface", "influence"] = "surface"


class SphereEntry(PrimitiveEntry):
    """A sphere; lengths [m]."""

    kind: Literal["sphere"]
    centre: Vec = (0.0, 0.0, 0.0)
    radius: Positive


class SphylinderEntry(PrimitiveEntry):
    """A sphylinder; lengths [m]."""

    kind: Literal["sphylinder"]
    start: Vec
    end: Vec
    radius: Positive


class ConeSphereEntry(PrimitiveEntry):
    """A cone-sphere; lengths [m]."""

    kind: Literal["cone_sphere"]
    start: Vec
    end: Vec
    radii: tuple[Positive, Positive]
    printed: bool = False


class RoundedPolygonEntry(PrimitiveEntry):
    """A flat polygon with a radius; lengths [m]."""

    kind: Literal["rounded_polygon"]
    vertices: list[Vec]
    radius: Positive


class SuperellipsoidEntry(PrimitiveEntry):
    """A superellipsoid; lengths [m]."""

    kind: Literal["superellipsoid"]
    centre: Vec = (0.0, 0.0, 0.0)
    half_axes: Vec
    e1: Positive = 1.0
    e2: Positive = 1.0


class SupertoroidEntry(PrimitiveEntry):
    """A supertoroid; lengths [m]."""

    kind: Literal["supertoroid"]
    centre: Vec = (0.0, 0.0, 0.0)
    half_axes: Vec
    alpha: Positive
    e1: Positive = 1.0
    e2: Positive = 1.0


class PointblobEntry(PrimitiveEntry):
    """volume: a solid, or the name of a primitive; its surface is that of the blob (or V where sizes = "influence")."""

    kind: Literal["pointblob"]
    volume: PolyhedronEntry | str
    centre: Vec = (0.0, 0.0, 0.0)
    relaxed: bool = False


class PointSetblobEntry(PrimitiveEntry):
    """A point-setblob."""

    kind: Literal["point_setblob"]
    volume: PolyhedronEntry | str
    centres: list[Vec]
    blends: list[BlendEntry] = []
    smoothing: Annotated[float, Field(ge=0)] = 0.0
    printed: bool = False
    relaxed: bool = False


class PolyblobEntry(PrimitiveEntry):
    """The core lies at T = 1, the hull at T = 0."""

    kind: Literal["polyblob"]
    hull: PolyhedronEntry
    core: PolyhedronEntry


class CombinationEntry(ShapeEntry):
    """of: names of shapes, or shapes written in place."""

    of: Annotated[list[str | AnyShape], Field(min_length=1)]


class SumEntry(CombinationEntry):
    """A weighted sum of shapes."""

    kind: Literal["sum"]
    weights: list[Number] | None = None


class UnionEntry(CombinationEntry):
    """power: at least 1, smooth; without it the sharp union or intersection."""

    kind: Literal["union", "intersection"]
    power: Annotated[float, Field(ge=1)] = math.inf


class DifferenceEntry(CombinationEntry):
    """The first without the others."""

    kind: Literal["difference"]
    power: Annotated[float, Field(ge=1)] = math.inf


class SubtractEntry(CombinationEntry):
    """The first field minus the others, which push its surface away."""

    kind: Literal["subtract"]


class ComplementEntry(CombinationEntry):
    """The complement of a shape."""

    kind: Literal["complement"]


class DiffEntry(CombinationEntry):
    """|a^n - b^n|^(1/n), the crease of a joint."""

    kind: Literal["diff"]
    power: Positive = 2.0
    eps: Annotated[float, Field(ge=0)] = 0.05


class SelectiveEntry(CombinationEntry):
    """blends: pairs of indices into `of` that blend; other pairs do not."""

    kind: Literal["selective"]
    blends: list[tuple[int, int]]


AnyShape = Annotated[
    SphereEntry | SphylinderEntry | ConeSphereEntry | RoundedPolygonEntry | SuperellipsoidEntry | SupertoroidEntry
    | PointblobEntry | PointSetblobEntry | PolyblobEntry | SumEntry | UnionEntry | DifferenceEntry | SubtractEntry
    | ComplementEntry | DiffEntry | SelectiveEntry,
    Field(discriminator="kind"),
]  # fmt: skip


class SceneEntry(Entry):
    """The whole file. show: names of the shapes that are seen; by default those of which no other is made."""

    size: tuple[Annotated[int, Field(ge=1, le=16384)], Annotated[int, Field(ge=1, le=16384)]] = (400, 400)
    background: Colour = (0.1, 0.1, 0.15)
    threshold: Annotated[float, Field(gt=0, lt=1)] = 0.5
    camera: CameraEntry
    lights: list[LightEntry] = []
    materials: dict[str, MaterialEntry] = {}
    shapes: dict[str, AnyShape] = {}
    show: list[str] | None = None
    meshes: list[MeshEntry] = []


for _entry in (SumEntry, UnionEntry, DifferenceEntry, SubtractEntry, ComplementEntry, DiffEntry, SelectiveEntry, SceneEntry):
    _entry.model_rebuild()
