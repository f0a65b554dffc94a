"""A garment on a body: its shells on all levels, its borders finished, its picture, as a part that a person has on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import Bool
from vistel.figure.avatar.avatar import Mesh
from vistel.figure.avatar.detail import coarser
from vistel.figure.avatar.patch import Patch
from vistel.figure.body_model.part import Part
from vistel.figure.clothes.cloth import Cloth, mesh_of
from vistel.figure.clothes.cut import Field
from vistel.figure.clothes.sheet import Paint, Sheet


@dataclass(frozen=True, eq=False)
class Worn:
    """cloth: on the finest level. hides: for each level (F,) triangles of the body. covers: how far inside its borders a place of the
    body lies [m]; what is worn beneath is left out there. paint: its look. triangles: of each level, about."""

    name: str
    cloth: Cloth
    hides: tuple[Bool, ...]
    covers: Field
    paint: Paint
    triangles: tuple[int, int, int]
    roughness: float = 0.85

    def beneath(self, others: Sequence["Worn"], margin: float) -> "Worn":
        """Without what others over it cover by more than `margin` [m]."""
        under = np.zeros(len(self.cloth.triangles), np.bool_)
        for other in others:
            under |= (other.covers(self.cloth.points) > margin)[self.cloth.triangles].all(axis=1)
        if not under.any():
            return self
        kept = self.cloth.without(under)
        share = len(kept.triangles) / len(self.cloth.triangles)
        few, fewer, fewest = (round(share * count) for count in self.triangles)
        return replace(self, cloth=kept, triangles=(few, fewer, fewest))

    def part(self, levels: int = 3) -> Part:
        """Finished."""
        sheet = Sheet.of(self.cloth)
        colour, normal = sheet.painted(self.paint)
        mesh, made = mesh_of(self.cloth, sheet.where), list[Mesh]()
        for count in self.triangles[:levels]:
            mesh = coarser(mesh, count)
            made.append(mesh)
        return Part(self.name, tuple(made), colour, (Patch(roughness=self.roughness, normal=normal),), self.hides)
