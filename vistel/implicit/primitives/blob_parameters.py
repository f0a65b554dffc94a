"""Pointblobs as the flat numbers that `vistel.implicit.primitives.blob_kernels` reads.

header: centres n; smoothing; 1 for printed weights; n starts of the blobs' records
record: centre (3); blend family, warp; reach; 1 for vertex blends; form of the volume (0 polyhedron, 1 analytic)
    polyhedron: cells R on the side of the direction cube; start of its 6 R R + 1 list bounds; start of the lists;
        start of the triangles, each nine of M and, with vertex blends, three of (family, warp, reach)
    analytic: kind; start of its parameters; farthest distance; frame, nine of the map into it, and origin
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.implicit.blend import Blend
from vistel.implicit.checks import Vec3
from vistel.implicit.primitives.kinds import KIND_INDEX
from vistel.implicit.primitives.polyhedron import Polyhedron
from vistel.implicit.primitives.volume import Fan, Volume, farthest


class Blob(Protocol):
    """What is packed of a `pointblob.Pointblob`."""

    @property
    def volume(self) -> Volume:
        """The star-shaped volume."""
        ...

    @property
    def centre(self) -> Vec3:
        """(3,) the point S."""
        ...

    @property
    def blend(self) -> Blend:
        """The blend of all of it."""
        ...

    @property
    def reach(self) -> float:
        """The ratio to the volume is multiplied by it."""
        ...

    @property
    def vertex_blends(self) -> tuple[Blend, ...] | None:
        """A blend for each vertex."""
        ...

    @property
    def vertex_reaches(self) -> tuple[float, ...]:
        """Each vertex' reach."""
        ...

    @property
    def fan(self) -> Fan:
        """The polyhedron's cones about the centre."""
        ...


def packed(blobs: Sequence[Blob], smoothing: float, printed: bool) -> F64:
    """All numbers of a pointblob (one) or a point-setblob (several)."""
    header = 3 + len(blobs)
    records: list[F64] = []
    starts: list[int] = []
    at = header
    for blob in blobs:
        starts.append(at)
        records.append(_record(blob, at))
        at += len(records[-1])
    return np.concatenate([[len(blobs), smoothing, float(printed)], starts, *records]).astype(np.float64)


def _record(blob: Blob, at: int) -> F64:
    head = [*blob.centre, blob.blend.code, blob.blend.warp, blob.reach, float(blob.vertex_blends is not None)]
    if not isinstance(blob.volume, Polyhedron):
        volume = blob.volume
        frame = np.eye(3, 4) if volume.frame is None else volume.frame
        start = at + len(head) + 16
        form = [1.0, KIND_INDEX[volume.kind], start, farthest(volume, blob.centre)]
        return np.concatenate([head, form, np.linalg.inv(frame[:, :3]).ravel(), frame[:, 3], volume.parameters])
    inverse = blob.fan.inverse
    side = int(np.clip(np.sqrt(len(inverse) / 3), 1, 40))
    bounds, lists = direction_cube(inverse, side)
    rows = inverse.reshape(-1, 9)
    if blob.vertex_blends is not None:
        table = np.array([(b.code, b.warp, x) for b, x in zip(blob.vertex_blends, blob.vertex_reaches, strict=True)])
        rows = np.concatenate([rows, table[blob.volume.triangles].reshape(-1, 9)], axis=1)
    first = at + len(head) + 5
    starts = [first, first + len(bounds), first + len(bounds) + len(lists)]
    return np.concatenate([[*head, 0.0, side], starts, bounds, lists, rows.ravel()])


def direction_cube(inverse: F64, side: int) -> tuple[F64, F64]:
    """For each cell of the six faces of a cube the triangles whose cones reach into it: list bounds, lists.

    Cell (f, i, j) of face f = 2 * axis + (0 for +, 1 for -) spans the directions with that dominant axis and the
    next two coordinates, over the dominant one's size, in [-1 + 2i/R, -1 + 2(i+1)/R] x the same of j.
    """
    edges = np.linspace(-1, 1, side + 1)
    lists: list[NDArray[np.int64]] = []
    usable = np.abs(inverse).sum(axis=(1, 2)) > 0
    corner = np.linalg.inv(np.where(usable[:, None, None], inverse, np.eye(3))).transpose(0, 2, 1)
    corner /= np.linalg.norm(corner, axis=2, keepdims=True)
    axis_of = corner.sum(axis=1)
    axis_of /= np.linalg.norm(axis_of, axis=1, keepdims=True)
    spread = np.arccos(np.clip(np.einsum("mkc,mc->mk", corner, axis_of).min(axis=1), -1, 1))
    cos_spread, sin_spread = np.cos(spread), np.sin(spread)
    for axis in range(3):
        for sign in (1.0, -1.0):
            for i in range(side):
                # All cells of a column at once: four corners each, (side, 4, 3).
                d = np.zeros((side, 4, 3))
                d[:, :, axis] = sign
                d[:, :, (axis + 1) % 3] = edges[[i, i, i + 1, i + 1]]
                d[:, :, (axis + 2) % 3] = np.stack([edges[:-1], edges[1:], edges[:-1], edges[1:]], axis=1)
                unit = d / np.linalg.norm(d, axis=2, keepdims=True)
                middle = unit.sum(axis=1)
                middle /= np.linalg.norm(middle, axis=1, keepdims=True)
                own = np.arccos(np.clip(np.einsum("jdc,jc->jd", unit, middle).min(axis=1), -1, 1)) + 1e-6
                # Cones farther apart than their half angles; those as wide as a half space are apart from none.
                limit = np.cos(own)[:, None] * cos_spread - np.sin(own)[:, None] * sin_spread
                near = (middle @ axis_of.T >= limit - 1e-12) | (own[:, None] + spread >= np.pi)
                cell, triangle = np.nonzero(near & usable)
                inside = (np.einsum("nkc,ndc->nkd", inverse[triangle], d[cell]) >= 0).any(axis=2).all(axis=1)
                found = np.split(triangle[inside], np.searchsorted(cell[inside], np.arange(1, side)))
                lists.extend(found)
    bounds = np.concatenate([[0], np.cumsum([len(x) for x in lists])])
    return bounds.astype(np.float64), np.concatenate(lists).astype(np.float64)
