"""Things of files made by others: furniture, movable things, masses, and primitives for contacts."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.making.source import SourceMesh
from vistel.space.files.cells import Cells
from vistel.space.files.faults import RoomFileError
from vistel.space.files.fit import MOST_PARTS, fitted
from vistel.space.files.model import Bulk, Polymesh, bulk_of_cells, bulk_of_mesh
from vistel.space.files.model_of import colour_of, in_metres, model_of
from vistel.space.things.things import Look, Thing

DENSITY = 600.0
"""Density of a thing without one in its file: wood [kg/m^3]."""
_DENSITIES: dict[str, float] = dict.fromkeys(("cup", "mug", "saucer", "plate", "bowl", "teapot", "pot", "lid", "vase"), 2300.0)
"""Density of ceramic things: fired clay [kg/m^3]."""
LOOSE_BELOW = 0.5
"""A thing up to this length that is no furniture can be taken [m]."""
HEAVIEST = 50.0
FURNITURE_PARTS = 24
"""Primitives at most of what stands fixed."""
SHAPES = (
    "table", "desk", "chair", "stool", "sofa", "bench", "shelf", "cabinet", "curtain", "wall", "floor", "ceiling", "window",
    "door", "lamp", "rug", "carpet", "cup", "mug", "saucer", "plate", "bowl", "teapot", "pot", "lid", "bottle", "box", "ball",
    "book", "can", "vase", "tool",
)  # fmt: skip
_FIXED = frozenset(SHAPES[:17])
_FLAT = ("floor", "rug", "carpet")


@dataclass(frozen=True)
class PartProperties:
    """Properties of a part in a file, besides its shape; None: the file gives none."""

    mass: float | None = None
    density: float | None = None
    fixed: bool | None = None


@dataclass(frozen=True, eq=False)
class Made:
    """A thing with its model. notes: remarks for the user; gap: mean distance of its surface from its primitives [m]; group: its
    name among the groups of the file."""

    thing: Thing
    model: Polymesh
    gap: float
    notes: tuple[str, ...] = ()
    group: str = ""


@dataclass(frozen=True)
class ForeignFile:
    """All of a file. notes: of the whole of it."""

    made: tuple[Made, ...]
    notes: tuple[str, ...] = field(default=())


def found(source: SourceMesh, said: Mapping[str, PartProperties] | None = None, *, fixed: bool | None = None) -> ForeignFile:
    """The things of a file, a thing for each name among its groups. fixed: all are, or none is; None: by what they are.

    Raises RoomFileError where there is nothing.
    """
    notes = [note.replace("beside the mesh, or --texture FILE", "beside the mesh") for note in source.notes]
    points = in_metres(source, notes)
    made: list[Made] = []
    ids: set[str] = set()
    for name in dict.fromkeys(source.groups):
        numbers = [k for k, g in enumerate(source.groups) if g == name]
        faces = np.isin(source.group, numbers)
        if faces.any():
            thing = _made(source, points, faces, name, (said or {}).get(name, PartProperties()), fixed, ids)
            if thing is None:
                notes.append(f"{name}: without extent, left out")
            else:
                made.append(thing)
    if not made:
        raise RoomFileError(f"{source.name}: nothing in it that has a surface; export the meshes with it")
    return ForeignFile(tuple(made), tuple(notes))


def shape_word(name: str) -> str:
    """The kind of thing that a name tells; "thing" if it tells none."""
    words = re.split(r"[^a-z]+", name.lower())
    for word in reversed(words):
        for shape in SHAPES:
            if word in (shape, f"{shape}s"):
                return shape
    return next((shape for shape in SHAPES if any(w.startswith(shape) for w in words)), "thing")


def unused(name: str, taken: set[str]) -> str:
    """An id made of a name, none that is `taken`."""
    base = re.sub(r"[^a-z0-9]+", "-", name.rpartition("/")[2].lower()).strip("-")[:40] or "thing"
    out, n = base, 2
    while out in taken:
        out, n = f"{base}-{n}", n + 1
    taken.add(out)
    return out


def _made(
    source: SourceMesh, points: F64, faces: NDArray[np.bool_], name: str, said: PartProperties, fixed: bool | None, ids: set[str]
) -> Made | None:
    notes: list[str] = []
    model = model_of(source, points, faces, notes)
    if not len(model.triangles) or float(np.ptp(model.vertices, axis=0).max()) < 1e-4:
        return None
    leaf = name.rpartition("/")[2] or source.name
    shape = shape_word(leaf)
    extent = np.ptp(model.vertices, axis=0).astype(np.float64)
    if fixed is None:
        fixed = said.fixed
    if fixed is None:
        fixed = shape in _FIXED or float(extent.max()) > LOOSE_BELOW
    vertices = model.vertices.astype(np.float64)
    flat = fixed and shape in _FLAT and extent[1] < 0.1
    fit, cells, axes = fitted(vertices, model.triangles, FURNITURE_PARTS if fixed else MOST_PARTS)
    bulk = _bulk(model, vertices, cells, axes, notes, weighed=not fixed and said.mass is None)
    mass = 0.0 if fixed else said.mass if said.mass is not None else bulk.volume * (said.density or _DENSITIES.get(shape, DENSITY))
    if not fixed and not 0.001 <= mass <= HEAVIEST:
        notes.append(f"{mass:.3g} kg: taken as {min(max(mass, 0.001), HEAVIEST):g} kg")
        mass = min(max(mass, 0.001), HEAVIEST)
    centre = bulk.centre
    moved = model.moved(-centre)
    primitives = () if flat else tuple(replace(p, position=p.position - centre) for p in fit.primitives)
    thing = Thing(
        unused(leaf, ids),
        leaf.replace("_", " ").replace("-", " ").strip().lower(),
        shape,
        primitives,
        mass,
        0.0,
        colour_of(model),
        centre,
        looks=(Look(moved.digest),),
        inertia=None if fixed else bulk.inertia,
    )
    return Made(thing, moved, fit.mean, tuple(notes), name)


def _bulk(model: Polymesh, vertices: F64, cells: Cells, axes: F64, notes: list[str], weighed: bool) -> Bulk:
    """Of a closed mesh what is inside; of an open one, or one without an inside that can be, what its cells fill."""
    if model.closed:
        try:
            exact = bulk_of_mesh(vertices, model.triangles)
        except ValueError:
            exact = None
        if exact is not None and exact.volume > 0.0 and bool((np.linalg.eigvalsh(exact.inertia) > 0.0).all()):
            return exact
    if weighed:
        notes.append("an open mesh: it weighs what the space it fills would")
    inside = cells.middles if not cells.border.all() else cells.points
    rough = bulk_of_cells(inside @ axes.T, cells.size)
    return replace(rough, volume=float(cells.filled.sum()) * cells.size**3)
