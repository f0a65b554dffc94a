"""Vertices in blocks of 64 lanes: who is with whom, and the calibration the kernels read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.implicit.deform_table import COLLIDES, NEIGHBOUR, NO_OVERLAP
from vistel.implicit.embedding import Embedding
from vistel.implicit.kernels_field import LANES

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]

_MARGIN = 0.1
"""How far beyond its realm, in influence radii, a primitive still counts for its own group's blocks."""
_STRETCH = 1.25
"""How much a block may stretch between two of its vertices."""


@dataclass(frozen=True)
class Blocks:
    """NB blocks. index: (NB, 64) vertices, the last repeated; centre: (NB,) vertex in its middle; spread:
    (NB,) how far the others may be from it in any posture [m]; count: (NB,) how many are real; group,
    hinge, other: (NB,); calibration: (NB, 7, 64) rows as named in `deform_table`; self_rule: (G, G) 0
    none, NEIGHBOUR, or COLLIDES like anyone else; overlap: (NO, 64) shares with which neighbours collide;
    overlap_row: (NB, G), -1 none; group_blocks: (G + 1,) blocks of group g are group_blocks[g] :
    group_blocks[g + 1]."""

    index: I32
    centre: I32
    spread: F32
    count: I32
    group: I32
    hinge: I32
    other: I32
    own_mask: I64
    calibration: F32
    self_rule: I32
    overlap: F32
    overlap_row: I32
    group_blocks: I32

    @staticmethod
    def of(embedding: Embedding) -> Blocks:
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
                embedding.weight[index], embedding.offset[index], embedding.contact[index],
                embedding.mu[index], embedding.alpha[index], embedding.inward[index], embedding.outward[index],
            ],
            axis=1,
        )  # fmt: skip
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
            index, centre, spread, np.array([len(p) for p in pieces], np.int32),
            embedding.group[first].astype(np.int32),
            embedding.hinge[first].astype(np.int32), embedding.other[first].astype(np.int32),
            _own_masks(embedding, index), np.ascontiguousarray(calibration, np.float32), self_rule,
            np.ascontiguousarray(np.array(overlap), np.float32), overlap_row,
            np.searchsorted(embedding.group[first], np.arange(limbs.groups + 1)).astype(np.int32),
        )  # fmt: skip


def _patches(vertices: F64, rows: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """`rows` halved across its longest extent until every piece fits a block; all but the last are full."""
    if len(rows) <= LANES:
        return [rows] if len(rows) else []
    p = vertices[rows]
    p = p - p.mean(axis=0)
    rows = rows[np.argsort(p @ np.linalg.eigh(p.T @ p)[1][:, 2], kind="stable")]
    half = LANES * (-(-len(rows) // LANES) // 2)
    return _patches(vertices, rows[:half]) + _patches(vertices, rows[half:])


def _middles(vertices: F64, index: I32) -> tuple[I32, F32]:
    """The vertex nearest to the middle of each block, and the largest distance from it with room for
    stretching."""
    p = vertices[index]
    middle = np.argmin(np.linalg.norm(p - p.mean(axis=1, keepdims=True), axis=2), axis=1)
    rows = np.arange(len(index))
    far = np.linalg.norm(p - p[rows, middle][:, None], axis=2).max(axis=1)
    return index[rows, middle].astype(np.int32), (_STRETCH * far).astype(np.float32)


def _own_masks(embedding: Embedding, index: I32) -> I64:
    """Bits of the primitives, in the order of their group, whose realm comes near a block at rest."""
    limbs = embedding.limbs
    out = np.zeros(len(index), np.int64)
    for b, rows in enumerate(index):
        members = np.flatnonzero(limbs.group == embedding.group[rows[0]])
        for bit, i in enumerate(members):
            near = embedding.nearness[i][rows].min() < 1.0 + _MARGIN or len(members) == 1
            out[b] |= int(near) << bit
        if out[b] == 0:
            out[b] = 1 << int(np.argmin([embedding.nearness[i][rows].min() for i in members]))
    return out
