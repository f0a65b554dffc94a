"""Polygonisation on an even lattice by the marching kernel."""

# Numba is only loaded when something is polygonised

from collections.abc import Callable
from dataclasses import dataclass
from threading import Event, Thread
from typing import Any, cast

import numpy as np

from vistel.arrays import F32, F64, I32, I64
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.polygonise.lattice import Lattice, refuse_beyond
from vistel.implicit.polygonise.tables import kernel_table

Progress = Callable[[float], None]

BITS = 20
OFFSET = 1 << (BITS - 1)
"""Added to the indices in the numbers of edges and cells, so that they may be negative."""
PER_CELL = 300
"""Bytes of a square cell of the surface, with the growth of arrays."""
SLAB = 16


@dataclass(frozen=True, eq=False)
class Marched:
    """points: (n, 3) [m]; normals (n, 3); edge: (n,) lattice edge of each, or none; triangles (m, 3); cell:
    (m,) of each, or none; residual: the largest |F - T|; blocks: how many blocks of points were evaluated."""

    points: F64
    normals: F32
    edge: I64
    triangles: I32
    cell: I64
    residual: float
    blocks: int


def march(
    program: FieldProgram,
    lattice: Lattice,
    span: I64,
    threshold: float,
    residual: float,
    *,
    cells: bool = False,
    progress: Progress | None = None,
    limit: int | None = None,
) -> Marched:
    """The surface in the span (2, 3) of a lattice, at whose rims the field must be far.

    residual: the largest |F - threshold| allowed. progress is called now and then with the share done; what it raises
    stops the work. limit: bytes that may be used.
    """
    from vistel.implicit.polygonise import marching_kernels

    kernel = cast(Any, marching_kernels).march
    # Out of the primitives' reach the points that fill up the last blocks cost nothing.
    counts = -(-(span[1] - span[0]) // np.array([8, 4, 64])) * np.array([8, 4, 64])
    refuse_beyond(limit, 30.0 * SLAB * counts[1] * counts[2] + 8.0 * counts.sum(), f"a lattice of {_times(counts)} points")
    padded = np.stack([span[0], span[0] + counts])
    axes = [(a - o).astype(np.float32) for a, o in zip(lattice.axes(padded), program.origin, strict=True)]
    table, many = kernel_table()
    _, arrays = program._machine  # pyright: ignore[reportPrivateUsage]
    done = np.zeros(2, np.int64)

    def run() -> Any:
        return kernel(arrays, *axes, np.float32(threshold), np.float32(residual), table.ravel(), many, cells, done)

    found = run() if progress is None else _watched(run, done, int(counts[0]), progress)
    points, normals, edge, worst, triangles, cell, blocks = found
    shift = np.int64(0)
    for k in range(3):
        shift = (shift << BITS) + int(span[0, k]) + OFFSET
    edge, cell = (edge + (shift << 2), cell + shift) if cells else (edge[:0], cell[:0])
    return Marched(points + program.origin, normals, edge, triangles, cell, float(worst), int(blocks))


def cell_indices(cell: I64) -> I64:
    """(n, 3) lattice indices of the lowest point of cells."""
    mask = (1 << BITS) - 1
    return np.stack([cell >> (2 * BITS), (cell >> BITS) & mask, cell & mask], axis=1) - OFFSET


def _watched(run: Callable[[], Any], done: I64, planes: int, progress: Progress) -> Any:
    """`run` on a thread of its own, so that it can be watched and stopped."""
    result: list[Any] = []
    faults: list[BaseException] = []
    ended = Event()

    def work() -> None:
        try:
            result.append(run())
        except BaseException as fault:
            faults.append(fault)
        finally:
            ended.set()

    thread = Thread(target=work)
    thread.start()
    try:
        while not ended.wait(0.1):
            progress(min(float(done[0]) / planes, 1.0))
    except BaseException:
        done[1] = 1
        raise
    finally:
        thread.join()
    if faults:
        raise faults[0]
    progress(1.0)
    return result[0]


def _times(counts: I64) -> str:
    return " x ".join(str(int(n)) for n in counts)
