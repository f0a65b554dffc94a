"""The content of a file with a person's shape, before it is interpreted."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32, U8
from vistel.figure.avatar.patch import Patch

USD_ENDINGS = (".usda", ".usdc", ".usd", ".usdz")
"""Endings of USD files."""


class MakingError(ValueError):
    """A mesh or rig that cannot become an avatar: what, where, and how to mend it."""


def beside(name: str, path: Path) -> Path:
    """The file that the file `path` refers to as `name`. Raises MakingError where it is neither in the same folder nor within:
    a file of somebody else must not have a picture of this machine read, which would then go out with what is made of it."""
    found = path.parent / name
    if not found.resolve().is_relative_to(path.resolve().parent):
        raise MakingError(f"{path}: refers to {name!r}, expected a file beside it")
    return found


@dataclass(frozen=True)
class Finish:
    """What a surface is like beside its colour, as UsdPreviewSurface has it. roughness: 0 a mirror .. 1 chalk; metallic: 0 .. 1."""

    roughness: float
    metallic: float

    @staticmethod
    def of(roughness: float, metallic: float) -> "Finish | None":
        """In bounds and rounded to what can be seen; None for what is no number."""
        if not (math.isfinite(roughness) and math.isfinite(metallic)):
            return None
        return Finish(round(min(1.0, max(0.0, roughness)), 3), round(min(1.0, max(0.0, metallic)), 3))


@dataclass(frozen=True)
class SourceMaterial:
    """Colour of some faces: (3,) sRGB 0 to 255, and a picture (H, W, 3) where there is one. finish: None where the file does not
    say; patch: the same texel by texel and more, for figures, its pictures lying as `picture`; wrap: how that goes on beyond its
    edges, along u and v: "repeat", "mirror" or "clamp"."""

    name: str
    colour: tuple[int, int, int] | None = None
    picture: U8 | None = None
    finish: Finish | None = None
    patch: Patch | None = None
    wrap: tuple[str, str] = ("repeat", "repeat")


@dataclass(frozen=True)
class Rig:
    """Joints of a file, in its frame and unit. names, parents (J,) (-1 none), at (J, 3); weight: (V, J) shares of the
    joints in each vertex, None where the file has none; told: the house's joint (or SPINE) of those of which the file
    says what they are, by index."""

    names: tuple[str, ...]
    parents: I32
    at: F64
    weight: F32 | None = None
    told: Mapping[int, str] = field(default_factory=dict[int, str])


@dataclass(frozen=True)
class SourceTarget:
    """A shape of an expression: vertices (N,) and by how much they move at its full (N, 3), in the file's frame and unit."""

    name: str
    vertex: I32
    offset: F64


@dataclass(frozen=True)
class SourceMesh:
    """A mesh as a file holds it. points: (V, 3) in the file's frame and unit; triangles: (F, 3); uv: (T, 2) origin bottom left;
    uv_triangles: (F, 3), -1 where a face has none; group, material: (F,) indices into `groups`, `materials`. unit: metres of one
    unit and up: "Y" or "Z", where the file says so. notes: remarks. targets: shapes of expressions."""

    name: str
    points: F64
    triangles: I32
    uv: F64
    uv_triangles: I32
    group: I32
    groups: tuple[str, ...]
    material: I32
    materials: tuple[SourceMaterial, ...]
    rig: Rig | None = None
    unit: float | None = None
    up: str | None = None
    notes: tuple[str, ...] = field(default=())
    targets: tuple[SourceTarget, ...] = ()

    def of_faces(self, keep: NDArray[np.bool_]) -> "SourceMesh":
        """The part with these faces only; points stay as they are."""
        return SourceMesh(
            self.name,
            self.points,
            self.triangles[keep],
            self.uv,
            self.uv_triangles[keep],
            self.group[keep],
            self.groups,
            self.material[keep],
            self.materials,
            self.rig,
            self.unit,
            self.up,
            self.notes,
            self.targets,
        )
