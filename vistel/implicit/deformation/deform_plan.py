"""One frame of the deformation as a flat table of integers and float32 bits, for an engine that walks it elsewhere.

The same rows, pairs and shares that the CPU kernels walk; which blocks act and how deep bodies touch is found
here, from the few vertices it takes. A table is an array of *texels*, four 32-bit words each:

| from (texel 0, 1) | texels each | holds |
|---|---|---|
| texel 2 | 1 | 1 where any block acts |
| bones | 5 | 3x4 matrix of rest to room, dual quaternion; after the last bone what the skin's rest pose takes |
| blocks | 2 | pairs from, to; own members from, to; across the hinge from, to; joint sphere or -1; 1 where it acts |
| rows | 6 | primitives, own ones first |
| spheres | 6 | joints |
| pairs | 2 | rule, overlap row, members from, to; effect, first parameter, quotient, zone |
| members | 1 | row, kind |
| corners | 1 | x, y |
| parameters | 1/4 | of effects |
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32
from vistel.implicit.deformation import deform_table as table
from vistel.implicit.deformation.deform import Deformer
from vistel.implicit.deformation.field_kernels import LANES
from vistel.implicit.deformation.ghost_source import GhostSource
from vistel.implicit.deformation.normals_kernels import build_fans  # pyright: ignore[reportUnknownVariableType]
from vistel.implicit.deformation.plan_kernels import (
    BLOCK_WORDS,
    PAIR_WORDS,
    begin_frame,  # pyright: ignore[reportUnknownVariableType]
    judge_frame,  # pyright: ignore[reportUnknownVariableType]
    measure_touch,  # pyright: ignore[reportUnknownVariableType]
    near_blocks,  # pyright: ignore[reportUnknownVariableType]
    write_frame,  # pyright: ignore[reportUnknownVariableType]
)
from vistel.implicit.meshes.embedding import Embedding

BONE = 20
"""Numbers per bone."""
HEADER_TEXELS = 3


@dataclass(frozen=True)
class FramePlan:
    """words: (texels, 4) int32, the planner's own memory, valid until its next frame; acts: whether anything can
    move; displacement: (V,) along the normals, in the order of `MeshLayout.vertex` [m], None: none."""

    words: I32
    acts: bool
    displacement: F32 | None = None


@dataclass(frozen=True)
class MeshLayout:
    """What of a mesh never changes. vertex: (V,) the vertices in the order of blocks; block, lane: (V,) where each
    of those is, -1 none; calibration: (V, 7) rows as named in `deform_table`; overlap: (NO, LANES); fan_start
    (V + 1,) and fan of `vertex`'s neighbours, by places in that order, GAP between chains."""

    vertex: I32
    block: I32
    lane: I32
    calibration: F32
    overlap: F32
    fan_start: I32
    fan: I32


class Planner(Deformer):
    """Plans the frames of one embedded mesh. Not for two threads at once.

    Of each frame first `begin`, then `touch`, then `end`; the first two tell blocks whose rigid vertices are read
    from then on.
    """

    def __init__(self, triangles: I32, embedding: Embedding) -> None:
        super().__init__(triangles, embedding)
        self._index: I32 = self._arrays[table.INDEX].astype(np.int32)
        self._count: I32 = self._arrays[table.COUNT].astype(np.int32)
        self._middles = np.unique(self._arrays[table.CENTRE]).astype(np.int32)
        self._triangles, self._size = triangles, len(embedding.group)
        self._vertex: I32 = self._index[np.arange(LANES)[None] < self._count[:, None]]
        self._given: F32 | None = None
        self._blocks = np.zeros((len(self._index), BLOCK_WORDS), np.int32)
        self._seen = np.zeros(max(1, len(self._index)), np.int32)
        self._pair_words = np.zeros((256, PAIR_WORDS), np.int32)
        self._members = np.zeros((1024, 2), np.int32)
        self._words = np.zeros((4096, 4), np.int32)
        self._looked, self._parameter_count, self._corner_count = 0, 0, 0

    @property
    def middles(self) -> I32:
        """(M,) vertices that `begin` reads."""
        return self._middles

    @property
    def order(self) -> I32:
        """(V,) the vertices in the order of `places`."""
        return self._vertex

    @property
    def index(self) -> I32:
        """(NB, LANES) vertices of each block, the last repeated."""
        return self._index

    def places(self) -> MeshLayout:
        """Made anew on each call."""
        real = np.arange(LANES)[None] < self._count[:, None]
        vertex = self._index[real]
        block, lane = np.nonzero(real)
        calibration = self._arrays[table.CALIBRATION].transpose(0, 1, 3, 2).reshape(*real.shape, -1)[real]
        start, fan = build_fans(np.ascontiguousarray(self._triangles, np.int32).reshape(-1, 3), self._size)
        place = np.zeros(self._size + 1, np.int32)
        place[vertex] = np.arange(len(vertex), dtype=np.int32)
        place[-1] = -1  # a gap stays one
        spans = [fan[start[v] : start[v + 1]] for v in vertex]
        return MeshLayout(
            vertex,
            block.astype(np.int32),
            lane.astype(np.int32),
            np.ascontiguousarray(calibration, np.float32),
            self._arrays[table.OVERLAP].astype(np.float32),
            np.cumsum([0] + [len(s) for s in spans]).astype(np.int32),
            place[np.concatenate(spans)] if spans else np.zeros(0, np.int32),
        )

    def begin(self, vertices: F32, a: F64, b: F64, ghosts: Sequence[GhostSource] = (), displacement: F32 | None = None) -> I32:
        """List what may meet; a, b, ghosts as for `deform`. vertices: (V, 3) rigid, of which only `middles` need be
        right; displacement: as for `deform`.
        Returns the blocks (N,) that may be touched, whose vertices and normals `touch` reads."""
        self._load(ghosts)
        self._table[table.FLATTENS] = displacement is not None
        self._given = None if displacement is None else np.ascontiguousarray(displacement, np.float32)[self._vertex]
        self._corner_count = sum(len(g.corners) for g in ghosts)
        self._parameter_count = sum(0 if g.parameters is None else len(g.parameters) for g in ghosts)
        while True:
            self._looked, pairs = begin_frame(self._table, a, b, vertices)
            if pairs <= self._table[table.PAIR_ROOM]:
                break
            self._reserve_pairs(2 * pairs)
        if pairs > len(self._pair_words):
            self._pair_words = np.zeros((2 * pairs, PAIR_WORDS), np.int32)
        return self._seen[: near_blocks(self._table, self._looked, self._seen)]

    def touch(self, vertices: F32, normals: F32) -> I32:
        """Measure how deep bodies touch. Returns more blocks (N,), whose vertices and normals `end` reads as well."""
        return self._seen[: measure_touch(self._table, self._looked, vertices, normals, self._seen)]

    def end(self, vertices: F32, normals: F32, bones: F32) -> FramePlan:
        """The frame as a table. vertices, normals: (V, 3) rigid, right in the blocks that `begin` and `touch` found; bones: (B,
        BONE)."""
        judge_frame(self._table, self._looked, vertices, normals)
        acting, pairs, members = self._write(vertices)
        if members > len(self._members):
            self._members = np.zeros((2 * members, 2), np.int32)
            acting, pairs, members = self._write(vertices)
        rows = int(self._arrays[table.GROUP_START][self._table[table.GROUPS]])
        sections = [bones, self._blocks]
        if acting:
            sections += [
                self._arrays[table.ROWS][:rows],
                self._arrays[table.SPHERE],
                self._pair_words[:pairs],
                self._members[:members],
                self._arrays[table.CORNERS][: self._corner_count],
                self._arrays[table.PARAMETERS][: self._parameter_count],
            ]
        acts = acting > 0 or self._given is not None
        return FramePlan(self._pack(acts, sections), acts, self._given)

    def _write(self, vertices: F32) -> tuple[int, int, int]:
        words = self._pair_words
        return write_frame(self._table, self._looked, vertices, self._blocks, words, words.view(np.float32), self._members)

    def _pack(self, acts: bool, sections: Sequence[NDArray[np.generic]]) -> I32:
        """The sections one after the other, where each begins in the header."""
        begin, starts = HEADER_TEXELS, np.zeros(8, np.int32)
        texels = [_texels(s) for s in sections]
        if begin + sum(texels) > len(self._words):
            self._words = np.zeros((2 * (begin + sum(texels)), 4), np.int32)
        for k, (section, count) in enumerate(zip(sections, texels, strict=True)):
            starts[k] = begin
            _lay(section, self._words[begin : begin + count])
            begin += count
        self._words[:2] = starts.reshape(2, 4)
        self._words[2] = int(acts)
        return self._words[:begin]


def _texels(section: NDArray[np.generic]) -> int:
    """How many texels an array takes: rows of 2 words one each, others packed."""
    return len(section) if section.ndim == 2 and section.shape[1] == 2 else -(-section.size // 4)


def _lay(section: NDArray[np.generic], out: I32) -> None:
    words = section.view(np.int32)
    if section.ndim == 2 and section.shape[1] == 2:
        out[:, :2] = words
    else:
        out.reshape(-1)[: words.size] = words.reshape(-1)
