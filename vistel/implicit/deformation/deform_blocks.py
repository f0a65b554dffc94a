"""Vertices in blocks of 64 lanes: which stand together, and the calibration the kernels read."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32
from vistel.implicit.deformation.deform_table import COLLIDES, NEIGHBOUR, NO_OVERLAP
from vistel.implicit.deformation.field_kernels import LANES, PATCHES, WIDTH
from vistel.implicit.meshes.embedding import Embedding

_STRETCH = 1.25
"""How much a block may stretch between two of its vertices."""


@dataclass(frozen=True)
class Blocks:
    """NB blocks. index: (NB, LANES) vertices, the last repeated; centre: (NB, 1 + PATCHES) vertices in
    the middle of the block and of its patches; spread: how far the others may be from them in any posture
    [m]; count: (NB,) how many are real; group,
    hinge, other: (NB,); calibration: (NB, PATCHES, 7, WIDTH) rows as named in `deform_table`; self_rule: (G, G) 0
    none, NEIGHBOUR, or COLLIDES like anyone else; overlap: (NO, LANES) shares with which neighbours collide;
    overlap_row: (NB, G), -1 none; group_blocks: (G + 1,) blocks of group g are group_blocks[g] :
    group_blocks[g + 1]."""

    index: I32
    centre: I32
    spread: F32
    count: I32
    group: I32
    hinge: I32
    other: I32
    calibration: F32
    self_rule: I32
    overlap: F32
    overlap_row: I32
    group_blocks: I32

    @staticmethod
    def of(embedding: Embedding) -> "Blocks":
        """Blocks of one group and one side of one hinge each, compact patches of the skin."""
        limbs = embedding.limbs
        order = np.lexsort((embedding.other, embedding.hinge, embedding.group))
        cell = np.stack([embedding.group, embedding.hinge, embedding.other], axis=1)[order]
        cuts = np.flatnonzero(np.any(np.diff(cell, axis=0) != 0, axis=1)) + 1
        pieces = [piece for part in np.split(order, cuts) for piece in _patches(embedding.vertices, part)]
        index = np.array([np.pad(p, (0, LANES - len(p)), mode="edge") for p in pieces], np.int32).reshape(-1, LANES)
        first = index[:, 0]
        calibration = np.stack(
            [
                embedding.weight[index],
                embedding.offset[index],
                embedding.contact[index],
                embedding.mu[index],
                embedding.alpha[index],
                embedding.inward[index],
                embedding.outward[index],
            ],
            axis=1,
        )
        self_rule = np.full((limbs.groups, limbs.groups), COLLIDES, np.int32)
        np.fill_diagonal(self_rule, 0)
        overlap_row = np.full((len(index), limbs.groups), -1, np.int32)
        overlap: list[F64] = [np.zeros(LANES)]
        for (g, k), share in embedding.overlap.items():
            self_rule[g, k] = NEIGHBOUR
            of_vertex = np.zeros(len(embedding.group))
            of_vertex[np.flatnonzero(embedding.group == g)] = share
            for b in np.flatnonzero(embedding.group[first] == g):
                row = of_vertex[index[b]]
                if row.max() > 0.0:
                    overlap_row[b, k] = len(overlap)
                    overlap.append(row)
                else:
                    overlap_row[b, k] = NO_OVERLAP
        centre, spread = _middles(embedding.vertices, index)
        return Blocks(
            index,
            centre,
            spread,
            np.array([len(p) for p in pieces], np.int32),
            embedding.group[first].astype(np.int32),
            embedding.hinge[first].astype(np.int32),
            embedding.other[first].astype(np.int32),
            np.ascontiguousarray(calibration.reshape(-1, calibration.shape[1], PATCHES, WIDTH).transpose(0, 2, 1, 3), np.float32),
            self_rule,
            np.ascontiguousarray(np.array(overlap), np.float32),
            overlap_row,
            np.searchsorted(embedding.group[first], np.arange(limbs.groups + 1)).astype(np.int32),
        )


def _patches(vertices: F64, rows: NDArray[np.intp], size: int = LANES) -> list[NDArray[np.intp]]:
    """`rows` halved across its longest extent until every piece has at most `size`; all but the last are
    full. Blocks are ordered in the same way down to WIDTH."""
    if len(rows) <= WIDTH:
        return [rows] if len(rows) else []
    if len(rows) <= size:
        return [np.concatenate(_patches(vertices, rows, WIDTH))] if size > WIDTH else [rows]
    p = vertices[rows]
    p = p - p.mean(axis=0)
    rows = rows[np.argsort(p @ np.linalg.eigh(p.T @ p)[1][:, 2], kind="stable")]
    half = size * (-(-len(rows) // size) // 2)
    return _patches(vertices, rows[:half], size) + _patches(vertices, rows[half:], size)


def _middles(vertices: F64, index: I32) -> tuple[I32, F32]:
    """(NB, 1 + PATCHES) the vertices nearest to the middle of each block and of each of its patches,
    and the largest distance from them with room for stretching."""
    centres: list[I32] = []
    spreads: list[F32] = []
    for first, last in [(0, LANES)] + [(i, i + WIDTH) for i in range(0, LANES, WIDTH)]:
        lanes = index[:, first:last]
        p = vertices[lanes]
        middle = np.argmin(np.linalg.norm(p - p.mean(axis=1, keepdims=True), axis=2), axis=1)
        rows = np.arange(len(index))
        far = np.linalg.norm(p - p[rows, middle][:, None], axis=2).max(axis=1)
        centres.append(lanes[rows, middle].astype(np.int32))
        spreads.append((_STRETCH * far).astype(np.float32))
    return np.stack(centres, axis=1), np.stack(spreads, axis=1)
