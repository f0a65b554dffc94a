"""The deformable component of a mesh: every vertex to F = T along its normal (Singh §2.3.2, §2.4;
spec_maths §2.6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.implicit.contact_set import CONE_SPHERE
from vistel.implicit.deform_blocks import Blocks
from vistel.implicit.deform_normals import NormalUpdate
from vistel.implicit.embedding import JOINT_REACH, JOINT_WEIGHT, Embedding
from vistel.implicit.ghost import ALPHA, BETA, GhostSource, T
from vistel.implicit.kernels_deform import (
    bent_hinges,  # pyright: ignore[reportUnknownVariableType]
    deform_blocks,  # pyright: ignore[reportUnknownVariableType]
    meet,  # pyright: ignore[reportUnknownVariableType]
    pose_rows,  # pyright: ignore[reportUnknownVariableType]
    prepare,  # pyright: ignore[reportUnknownVariableType]
    shapes,  # pyright: ignore[reportUnknownVariableType]
)
from vistel.implicit.kernels_field import LANES, ROW

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

LONE_ZONE = 27.0 / 4.0 * ALPHA * T
"""Longest zone of propagation of one body alone, per compliance (`ghost.zone`); the kernel caps sums of
several."""


@dataclass(frozen=True)
class DeformReport:
    """What one frame did: vertices moved, lanes without a root (penetrated past the skeleton; left at the
    limit of their room), blocks solved, evaluations of the whole field per solved block, and the
    penetration delta of every ghost group in field units (own groups first; 0 = no contact)."""

    moved: int
    lost: int
    blocks: int
    evaluations: float
    delta: F32


class Deformer:
    """Deforms one embedded mesh, frame after frame, in buffers of its own. Not for two threads at once.

    triangles: (F, 3); embedding: of the mesh at rest.
    """

    def __init__(self, triangles: I32, embedding: Embedding) -> None:
        self.embedding = embedding
        limbs, fit = embedding.limbs, embedding.fit
        self._order = np.argsort(limbs.group, kind="stable")
        self._start = np.searchsorted(limbs.group[self._order], np.arange(limbs.groups + 1)).astype(np.int32)
        self._fit = (
            fit.radius_a[self._order], fit.radius_b[self._order], fit.reach[self._order], fit.weight[self._order],
        )  # fmt: skip
        self._blocks = Blocks.of(embedding)
        self._normals = NormalUpdate(triangles, len(embedding.group))
        place = np.argsort(self._order)
        self._hinge = np.array([(place[h.parent], place[h.child]) for h in limbs.hinges], np.int32).reshape(-1, 2)
        self._sphere = np.zeros((len(limbs.hinges), ROW), np.float32)
        self._sphere[:, 7], self._sphere[:, 9] = fit.joint_radius * JOINT_REACH, JOINT_WEIGHT
        self._bent = np.zeros(len(limbs.hinges), np.uint8)
        self._flags = np.zeros(len(self._blocks.index), np.uint8)
        self._moved = np.zeros(len(embedding.group), np.uint8)
        self._moved_list, self._moved_count = np.zeros(len(embedding.group), np.int32), 0
        self._work, self._acc = np.zeros((8, 2, LANES), np.float32), np.zeros((6, LANES), np.float32)
        self._state, self._zero = np.zeros((9, LANES), np.float32), np.zeros(LANES, np.float32)
        self._lanes = np.zeros((len(self._blocks.index), 6, LANES), np.float32)
        self._block_box = np.zeros((len(self._blocks.index), 6), np.float32)
        self._group_active = np.zeros(limbs.groups, np.uint8)
        self._rest_shape = np.zeros((limbs.groups, limbs.groups, 4))
        self._heads = self._start[:-1].copy()
        shapes(limbs.a[self._order], limbs.b[self._order], self._heads, self._rest_shape)
        self._rest_bend = np.full(len(limbs.hinges), -1.0)  # the first call measures it
        bent_hinges(limbs.a[self._order], limbs.b[self._order], self._hinge, self._rest_bend, self._sphere, self._bent)
        self._reserve(len(limbs.group), limbs.groups, 0, 256)

    def _reserve(self, primitives: int, groups: int, corners: int, pairs: int) -> None:
        """Room for this many ghost primitives, groups, polygon corners and block-ghost pairs, own ones
        included."""
        self._rows, self._box = np.zeros((primitives, ROW), np.float32), np.zeros((primitives, 6), np.float32)
        self._kind = np.full(primitives, CONE_SPHERE, np.int32)
        self._group_start, self._group_box = np.zeros(groups + 1, np.int32), np.zeros((groups, 6), np.float32)
        self._group_start[: len(self._start)] = self._start
        self._corners = np.zeros((max(1, corners), 2), np.float32)
        self._quotient, self._zones = np.ones(groups, np.float32), np.zeros(groups, np.float32)
        self._delta, self._depth = np.zeros(groups, np.float32), np.full(groups, -1.0, np.float32)
        own = self.embedding.limbs.groups
        self._candidates, self._candidate_count = np.zeros((own, groups), np.int32), np.zeros(own, np.int32)
        self._allowed = np.ones((groups, self.embedding.limbs.groups), np.uint8)
        self._rays = np.zeros((3 * primitives + 8, 6, LANES), np.float32)
        self._pairs, self._height = np.zeros((pairs, 5), np.int64), np.zeros(pairs, np.float32)

    def deform(self, vertices: F32, normals: F32, a: F64, b: F64, ghosts: Sequence[GhostSource] = ()) -> DeformReport:
        """Move the vertices (V, 3), given by the rigid component, to the implicit surface, in place.

        normals: (V, 3) unit, recomputed round what moved. a, b: (P, 3) own posed skeletons in the order of
        `Limbs` [m]. Vertices nothing touches stay exactly where they are.
        """
        groups = self._load(ghosts)
        own = self.embedding.limbs.groups
        a, b = np.ascontiguousarray(a[self._order]), np.ascontiguousarray(b[self._order])
        blocks, group_box = self._blocks, self._group_box[:groups]
        radius_a, radius_b, reach, weight = self._fit
        prepare(
            a, b, radius_a, radius_b, reach, weight, self._rows, self._box, self._group_start, group_box,
            self._hinge, self._rest_bend, self._sphere, self._bent, self._heads, self._rest_shape, blocks.self_rule,
            self._allowed, blocks.hinge_groups, self._candidates, self._candidate_count, self._group_active,
        )  # fmt: skip
        self._moved[self._moved_list[: self._moved_count]] = 0
        self._moved_count = 0
        todo = np.flatnonzero(self._group_active[blocks.group]).astype(np.int32)
        if not len(todo):
            return DeformReport(0, 0, 0, 0.0, np.zeros(groups, np.float32))
        self._delta[:groups] = 0.0
        while True:
            pairs = meet(
                todo, blocks.index, blocks.centre, blocks.spread, vertices, normals, blocks.group,
                blocks.hinge, blocks.other, self._bent, blocks.calibration, own,
                blocks.self_rule, blocks.overlap_row, self._group_start[: groups + 1], self._group_box, self._kind,
                self._rows, self._corners, self._box, self._candidates, self._candidate_count, self._lanes, self._rays,
                self._work[0], self._work[1], self._work[2], self._zero, self._pairs, self._height,
                self._delta, self._block_box,
            )  # fmt: skip
            if pairs <= len(self._pairs):
                break
            self._pairs, self._height = np.zeros((2 * pairs, 5), np.int64), np.zeros(2 * pairs, np.float32)
        self._set_zones(groups)
        stats = np.zeros(4, np.int64)
        deform_blocks(
            pairs, self._pairs, self._height, todo, blocks.index, blocks.count, blocks.group, blocks.hinge,
            blocks.other, blocks.own_mask, self._bent, blocks.calibration, blocks.overlap, self._start,
            self._group_start[: groups + 1], self._kind, self._rows, self._corners, self._sphere, self._quotient,
            self._zones, self._lanes, self._rays, self._work, self._acc, self._state, vertices, self._moved,
            self._moved_list, self._flags, stats,
        )  # fmt: skip
        self._moved_count = int(stats[1])
        if self._moved_count:
            self._normals.update(vertices, normals, self._moved_list[: self._moved_count])
        evaluations = float(stats[0]) / max(1, int(stats[3]))
        return DeformReport(int(stats[1]), int(stats[2]), int(stats[3]), evaluations, self._delta[:groups].copy())

    def ghosts(self, a: F64, b: F64, target: NDArray[np.bool_] | None = None) -> GhostSource:
        """This body, posed, as ghosts for another: a, b as for `deform`; target: (P,) of the other body,
        None all."""
        count, groups = len(a), self.embedding.limbs.groups
        rows, box = np.zeros((count, ROW), np.float32), np.zeros((count, 6), np.float32)
        self._pose_rows(a[self._order], b[self._order], rows, box)
        return GhostSource(
            rows, np.full(count, CONE_SPHERE, np.int32), box, np.zeros((0, 2), np.float32), self._start,
            np.ones(groups, np.float32), np.full(groups, -1.0, np.float32), target,
        )  # fmt: skip

    def _pose_rows(self, a: F64, b: F64, rows: F32, box: F32) -> None:
        radius_a, radius_b, reach, weight = self._fit
        pose_rows(
            np.ascontiguousarray(a), np.ascontiguousarray(b), radius_a, radius_b, reach, weight, rows, box
        )  # fmt: skip

    @property
    def moved(self) -> NDArray[np.uint8]:
        """(V,) 1 where the last frame moved the vertex."""
        return self._moved

    def _load(self, ghosts: Sequence[GhostSource]) -> int:
        """Append the ghosts' rows to the body's own; returns how many groups there are now."""
        limbs = self.embedding.limbs
        primitives = len(limbs.group) + sum(len(g.rows) for g in ghosts)
        groups = limbs.groups + sum(len(g.compliance) for g in ghosts)
        corners = sum(len(g.corners) for g in ghosts)
        if primitives > len(self._rows) or groups > len(self._quotient) or corners > len(self._corners):
            self._reserve(2 * primitives, 2 * groups, 2 * corners, len(self._pairs))
        row, group, corner = len(limbs.group), limbs.groups, 0
        for source in ghosts:
            n, m = len(source.rows), len(source.compliance)
            self._rows[row : row + n], self._box[row : row + n] = source.rows, source.box
            self._kind[row : row + n] = source.kind
            if len(source.corners):
                self._corners[corner : corner + len(source.corners)] = source.corners
                self._rows[row : row + n, 14] += np.where(source.kind == 2, corner, 0)
                corner += len(source.corners)
            self._group_start[group + 1 : group + m + 1] = source.group_start[1:] + row
            soft = source.compliance > 0.0
            self._quotient[group : group + m] = np.where(soft, 1.0 / np.where(soft, source.compliance, 1.0), -1.0)
            self._depth[group : group + m] = source.depth
            self._allowed[group : group + m] = self._targets(source.target)
            row, group = row + n, group + m
        return groups

    def _targets(self, target: NDArray[np.bool_] | None) -> NDArray[np.uint8]:
        limbs = self.embedding.limbs
        if target is None:
            return np.ones(limbs.groups, np.uint8)
        return (np.bincount(limbs.group, weights=target, minlength=limbs.groups) > 0).astype(np.uint8)

    def _set_zones(self, groups: int) -> None:
        """Zones of propagation in deficit units, from measured or given penetrations (E7)."""
        given, measured, quotient = self._depth[:groups], self._delta[:groups], self._quotient[:groups]
        delta = np.where(given >= 0.0, given, measured)
        cap = np.where(quotient > 0.0, 1.0 / np.where(quotient > 0.0, quotient, 1.0), 1.0) * LONE_ZONE
        self._zones[:groups] = np.minimum(np.minimum(T, cap), BETA * np.maximum(0.0, delta))
