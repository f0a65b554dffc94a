"""`polygonise`: the one call that turns a shape into a closed mesh."""

from vistel.arrays import F32
from vistel.implicit.checks import ShapeError, positive, within
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.evaluation.program import FieldProgram, compile
from vistel.implicit.graph.shape import Shape
from vistel.implicit.polygonise.adaptive import adaptive
from vistel.implicit.polygonise.lattice import Lattice, check_object, never_reached, refuse_beyond
from vistel.implicit.polygonise.marching import PER_CELL, Marched, Progress, march
from vistel.implicit.polygonise.mesh import SurfaceMesh, corner_normals
from vistel.implicit.polygonise.retained import Retained

RESIDUAL = 1e-4
"""|F - T| allowed at a vertex."""
RESOLUTION = 128
LOOK = 48
"""Resolution at which the surface's area is found before a costly lattice is started on."""
FREE = 256
"""Resolution up to which no estimate is needed."""


def polygonise(
    shape: Shape | FieldProgram,
    *,
    resolution: int = RESOLUTION,
    tolerance: float | None = None,
    keep_polygons: bool = False,
    threshold: float = THRESHOLD,
    lattice: Lattice | None = None,
    residual: float = RESIDUAL,
    limit: int | None = None,
    progress: Progress | None = None,
) -> SurfaceMesh:
    """The surface F = threshold of a shape as one closed, manifold triangle mesh (Singh §3.3.4).

    resolution: cells along the longest side of the shape's bounds; parts thinner than a cell may be missed. lattice:
    cells given instead. tolerance: instead, how far the mesh may be from the surface [m], about; cells then are small
    where the surface bends and large where it is flat, and no primitive is missed. keep_polygons: where a polyhedral
    primitive acts alone its own polygons are kept, whole or cut; the mesh then has hard edges. residual: the largest
    |F - threshold| at a vertex (where the field jumps across the threshold a vertex lies at the jump). limit: bytes
    that may be used, half of the free memory if None. progress: called now and then with the share done. Raises
    ShapeError for an object without bounds or surface, or cells too small for the memory.
    """
    program = shape if isinstance(shape, FieldProgram) else compile(shape)
    positive("polygonise", "residual", residual)
    check_object(program, threshold)
    if tolerance is not None and keep_polygons:
        raise ShapeError("polygonise: polygons are kept on an even lattice; give a resolution instead of a tolerance")
    if tolerance is not None:
        positive("polygonise", "tolerance", tolerance)
        marched = adaptive(program, tolerance, threshold, residual / 2, limit, progress)
        if not len(marched.triangles):
            raise never_reached(program, threshold)
        return finished(program, marched)
    if lattice is None:
        lattice = Lattice.over(program.bounds, int(within("polygonise", "resolution", resolution, 2, 65536)))
    if keep_polygons:
        made = Retained(program, lattice, threshold, residual / 2, limit)
        if progress is not None:
            progress(0.2)
        mesh = made.mesh()
        if not len(mesh.triangles):
            raise never_reached(program, threshold)
        return mesh
    span = lattice.span(program.bounds)
    if int((span[1] - span[0]).max()) > FREE:
        _check_cost(program, lattice, threshold, limit)
    marched = march(program, lattice, span, threshold, residual / 2, progress=progress, limit=limit)
    if not len(marched.triangles):
        raise never_reached(program, threshold)
    return finished(program, marched)


def finished(program: FieldProgram, marched: Marched) -> SurfaceMesh:
    """The mesh of what was marched, with attributes, and normals also where the field is flat."""
    found = program.attributes(marched.points) if program.layout.channels else {}
    return SurfaceMesh(marched.points, marched.triangles, pointed(marched), attributes=found, residual=marched.residual)


def pointed(marched: Marched) -> F32:
    """Normals (n, 3); where the field is flat those of the triangles."""
    normals = marched.normals
    flat = (normals[:, 0] == 0) & (normals[:, 1] == 0) & (normals[:, 2] == 0)
    if flat.any():
        normals = normals.copy()
        normals[flat] = corner_normals(marched.points, marched.triangles)[flat]
    return normals


def _check_cost(program: FieldProgram, lattice: Lattice, threshold: float, limit: int | None) -> None:
    """ShapeError where the mesh would not fit into memory, from its area on a coarse lattice."""
    coarse = Lattice.over(program.bounds, LOOK)
    seen = march(program, coarse, coarse.span(program.bounds), threshold, 1.0, limit=limit)
    squares = max(len(seen.triangles) / 3, 1.0) * (coarse.cell / lattice.cell) ** 2
    refuse_beyond(limit, PER_CELL * squares, f"a mesh of some {squares * 3:.2g} triangles")


__all__ = ["RESIDUAL", "RESOLUTION", "ShapeError", "finished", "polygonise"]
