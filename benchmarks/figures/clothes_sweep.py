"""How well clothes hold in recorded postures: triangles that pass through others, and what comes through what covers it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.figures.poking import Covered
from benchmarks.figures.self_intersection import intersecting
from vistel.arrays import F64
from vistel.figure.arm_clearance import clear_of_body
from vistel.figure.avatar.avatar import Avatar, flesh
from vistel.figure.figure import Figure
from vistel.figure.posture.limits import within_limits
from vistel.figure.posture.posture import Posture

DEEP = 0.003
"""By how much triangles pass through each other where that shows [m]: cloth that is pressed on cloth crosses it by less, because
both follow one surface in triangles of their own."""


@dataclass(frozen=True)
class ClothesSweep:
    """Each (postures,). crossing, deep: share of the triangles of skin and clothes that pass through others, besides those that
    do at rest; deep: by DEEP or more. skin, cloth: area that comes through the cloth over it [m^2]."""

    crossing: F64
    deep: F64
    skin: F64
    cloth: F64


def clothes_sweep(avatar: Avatar, postures: Sequence[Posture]) -> ClothesSweep:
    """Of a dressed person. Hair is left out: cards of strands cross each other and the head by design."""
    figure, covered, solid = Figure(avatar), Covered.of(avatar), flesh(avatar)
    triangles = avatar.mesh.triangles[solid[avatar.mesh.triangles].all(axis=1)]
    before = intersecting(avatar.mesh.vertices, triangles)
    rows: list[tuple[float, float, float, float]] = []
    for recorded in postures:
        skin = figure.pose(clear_of_body(avatar.skeleton, avatar.body, within_limits(recorded))).vertices
        crossing, deep = (float(np.mean(intersecting(skin, triangles, least) & ~before)) for least in (0.0, DEEP))
        out = covered.area * (covered.through(skin) > 0.0)
        rows.append((crossing, deep, float(out[covered.skin].sum()), float(out[~covered.skin].sum())))
    return ClothesSweep(*np.array(rows).T)
