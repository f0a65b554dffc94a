"""A garment on a body: its shells on all levels, its borders finished, its picture, as a part that a person has on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import KDTree

from vistel.arrays import F32, Bool
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.avatar.detail import coarser
from vistel.figure.avatar.patch import Patch
from vistel.figure.clothes.build import Build
from vistel.figure.clothes.cloth import Cloth, mesh_of, sewn
from vistel.figure.clothes.cut import Field
from vistel.figure.clothes.folds import Folds
from vistel.figure.clothes.sheet import Paint, Sheet
from vistel.figure.part import Part
from vistel.geometry.smoothstep import smooth

_GIVES = 0.005
_BEFORE = 0.015
"""How far cloth gives way under other cloth, and how far before its border it begins to [m]."""
_BESIDE = 0.02
"""Small things so little beside the border of what is over them are left out: they would come through it [m]."""
_HIDDEN = 0.010
"""How much farther where it is covered: nobody sees whether skin comes through it there [m]."""


@dataclass(frozen=True, eq=False)
class Worn:
    """cloth: on the finest level. hides, sinks: as `vistel.figure.part.Part` has them. covers: how far inside its
    borders a place of the body lies [m]; what is worn beneath is left out there. paint: its look. triangles: of each coarser level,
    about. hems: what is
    folded in at its rims, which the coarsest level has not; details: small things that are there on the finest level
    alone; folds: how deep they are, 1 as usual; both_sides: whether one sees into it; hangs: how far below the place that holds it
    a place of the cloth hangs free [m], 0 and less where it is held."""

    name: str
    cloth: Cloth
    hides: tuple[Bool, ...]
    sinks: tuple[F32, ...]
    covers: Field
    paint: Paint
    triangles: tuple[int, int]
    roughness: float = 0.85
    hems: tuple[Cloth, ...] = ()
    details: tuple[Cloth, ...] = ()
    folds: float = 1.0
    both_sides: bool = False
    hangs: Field | None = None

    def beneath(self, build: Build, others: Sequence["Worn"], margin: float) -> "Worn":
        """Without what others over it cover by more than `margin` [m]."""
        if not others:
            return self

        near = KDTree(build.levels[0].vertices)

        def left(piece: Cloth) -> Cloth:
            deep = np.max([other.covers(piece.points) for other in others], axis=0)
            # What is left gives way: coarse meshes of both would cross.
            sunk = _GIVES * smooth((deep + _BEFORE) / _BEFORE) + _HIDDEN * smooth(deep / _BEFORE)
            # Towards the skin: hems and collars are folded and face both ways.
            inwards = -build.normals[0][near.query(piece.points)[1]]
            whole = replace(piece, points=piece.points + sunk[:, None] * inwards)
            return whole.without((deep > margin)[piece.triangles].all(axis=1))

        cloth, *hems = (left(piece) for piece in (self.cloth, *self.hems))
        details = tuple(d for d in self.details if not any((other.covers(d.points) > -_BESIDE).all() for other in others))
        share = len(cloth.triangles) / len(self.cloth.triangles)
        few, fewer = (round(share * count) for count in self.triangles)
        kept = tuple(piece for piece in hems if len(piece.triangles))
        return replace(self, cloth=cloth, hems=kept, details=details, triangles=(few, fewer))

    def part(self, folds: Folds) -> Part:
        """Finished."""
        whole, middle = sewn([self.cloth, *self.hems, *self.details]), sewn([self.cloth, *self.hems])
        sheet = Sheet.of(whole)
        colour, normal = sheet.painted(self.paint, replace(folds, strength=self.folds * folds.strength))
        more = sum(len(piece.triangles) for piece in self.hems)
        few, fewer = self.triangles
        levels = (
            mesh_of(whole, sheet.where),
            coarser(mesh_of(middle, sheet.where), few + more, np.where(middle.rim, np.inf, 1.0)),
            coarser(mesh_of(self.cloth, sheet.where), fewer),
        )
        patch = Patch(roughness=self.roughness, normal=normal, both_sides=self.both_sides)
        return Part(self.name, tuple(map(self._hung, levels)), colour, (patch,), self.hides, self.sinks)

    def _hung(self, mesh: Mesh) -> Mesh:
        if self.hangs is None:
            return mesh
        return replace(mesh, hangs=np.maximum(0.0, self.hangs(mesh.vertices.astype(np.float64))).astype(np.float32))
