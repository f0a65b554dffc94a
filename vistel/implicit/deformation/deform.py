"""The deformable component of a mesh: every vertex to F = T along its normal (Singh §2.3.2, §2.4;
mathematics M6.5)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32
from vistel.implicit.contacts.contact_set import CONE_SPHERE
from vistel.implicit.deformation import deform_table as table
from vistel.implicit.deformation.deform_blocks import Blocks
from vistel.implicit.deformation.deform_kernels import deform_frame  # pyright: ignore[reportUnknownVariableType]
from vistel.implicit.deformation.deform_normals import NormalUpdate
from vistel.implicit.deformation.displace_kernels import (
    lay_on,  # pyright: ignore[reportUnknownVariableType]
    pressed,  # pyright: ignore[reportUnknownVariableType]
)
from vistel.implicit.deformation.effect_kernels import OWN_EFFECT
from vistel.implicit.deformation.field_kernels import LANES, ROW, WIDTH
from vistel.implicit.deformation.ghost_source import MOST_PRIMITIVES, GhostSource
from vistel.implicit.deformation.pose_kernels import (
    load_source,  # pyright: ignore[reportUnknownVariableType]
    measure_rest,  # pyright: ignore[reportUnknownVariableType]
    pose_ghosts,  # pyright: ignore[reportUnknownVariableType]
)
from vistel.implicit.meshes.embedding import JOINT_REACH, JOINT_WEIGHT, Embedding

_LINE = 64
"""Bytes of a cache line, and of the widest vector."""
_VECTORS = frozenset({table.BLOCK, table.RAYS, table.CALIBRATION, table.OVERLAP, table.WORK, table.RESULT})
_NO_CORNERS = np.zeros((0, 2), np.float32)


@dataclass(frozen=True)
class DeformReport:
    """What one frame did: vertices moved, vertices without a root (penetrated past the skeleton, or not
    finite; left at the limit of their room), blocks solved, evaluations of the whole field per solved block
    and per moved vertex, and the penetration delta of every ghost group in field units (own groups first;
    0 = no contact)."""

    moved: int
    lost: int
    blocks: int
    evaluations: float
    vertex_evaluations: float
    delta: F32


class Deformer:
    """Deforms one embedded mesh, frame after frame, in buffers of its own. Not for two threads at once.

    triangles: (F, 3); embedding: of the mesh at rest.
    """

    def __init__(self, triangles: I32, embedding: Embedding) -> None:
        self.embedding = embedding
        limbs, fit, vertices = embedding.limbs, embedding.fit, len(embedding.group)
        if np.bincount(limbs.group).max() > MOST_PRIMITIVES:
            raise ValueError(f"limbs: expected at most {MOST_PRIMITIVES} primitives in a group; split the group")
        self._normals = NormalUpdate(triangles, vertices)
        self._table = np.zeros(table.TABLE_LENGTH, np.int64)
        self._arrays: dict[int, NDArray[np.generic]] = {}
        self._order = np.argsort(limbs.group, kind="stable").astype(np.int32)
        self._start = np.searchsorted(limbs.group[self._order], np.arange(limbs.groups + 1)).astype(np.int32)
        self._keep_blocks(Blocks.of(embedding))
        reach = np.stack([fit.radius_a * fit.reach, fit.radius_b * fit.reach, fit.weight], axis=1)
        self._keep(table.ORDER, self._order)
        self._keep(table.FIT, reach[self._order].astype(np.float32))
        place = np.argsort(self._order)
        hinges = [(place[h.parent], place[h.child], h.parent_group, h.child_group) for h in limbs.hinges]
        self._keep(table.HINGES, np.array(hinges, np.int32).reshape(-1, 4))
        spheres = np.zeros((len(hinges), ROW), np.float32)
        spheres[:, 7], spheres[:, 9] = fit.joint_radius * JOINT_REACH, JOINT_WEIGHT
        self._keep(table.SPHERE, spheres)
        self._keep(table.BENT, np.zeros(len(hinges), np.uint8))
        self._keep(table.REST_BEND, np.full(len(hinges), -1.0))
        self._keep(table.REST_SHAPE, np.zeros((limbs.groups, limbs.groups, 4)))
        for slot, shape in ((table.WORK, (9, WIDTH)), (table.RESULT, (4, WIDTH))):
            self._keep(slot, np.zeros(shape, np.float32))
        self._moved, self._lost = np.zeros(vertices, np.uint8), np.zeros(vertices, np.uint8)
        self._moved_list = np.zeros(vertices, np.int32)
        self._stats = np.zeros(table.STAT_COUNT, np.int64)
        self._keep(table.MOVED, self._moved)
        self._keep(table.LOST, self._lost)
        self._keep(table.MOVED_LIST, self._moved_list)
        self._keep(table.LOST_LIST, np.zeros(vertices, np.int32))
        self._keep(table.STATS, self._stats)
        for slot, size in (
            (table.OWN_GROUPS, limbs.groups),
            (table.OWN_PRIMITIVES, len(limbs.group)),
            (table.HINGE_COUNT, len(hinges)),
        ):
            self._table[slot] = size
        self._own_primitives, self._own_groups = len(limbs.group), limbs.groups
        self._pressed: tuple[F32, I32] | None = None
        self._reserve(len(limbs.group), limbs.groups, 1, 1)
        self._reserve_pairs(256)
        measure_rest(self._table, np.ascontiguousarray(limbs.a), np.ascontiguousarray(limbs.b))

    def deform(
        self, vertices: F32, normals: F32, a: F64, b: F64, ghosts: Sequence[GhostSource] = (), displacement: F32 | None = None
    ) -> DeformReport:
        """Move the vertices (V, 3), given by the rigid component, to the implicit surface, in place.

        normals: (V, 3) unit, recomputed round what moved. a, b: (P, 3) own posed skeletons in the order of
        `Limbs` [m]. Vertices nothing touches stay exactly where they are. Of vertices or ghosts that are not
        finite nothing moves; `lost` tells. displacement: (V,) along the normal [m], wrinkles: laid on where nothing
        presses, less and less the nearer another body's surface is, not at all in contact.
        """
        self._table[table.FLATTENS] = displacement is not None
        groups = self.solve(vertices, normals, a, b, ghosts)
        if displacement is None:
            self.update_normals(vertices, normals)
        else:
            self._displace(vertices, normals, displacement)
        stats = self._stats
        moved, solved = int(stats[table.MOVED_COUNT]), int(stats[table.SOLVED])
        return DeformReport(
            moved,
            int(stats[table.LOST_COUNT]),
            solved,
            float(stats[table.EVALUATIONS]) / max(1, solved),
            1.0 + float(stats[table.REPEATS]) / moved if moved else 0.0,
            self._delta[:groups].copy(),
        )

    def solve(self, vertices: F32, normals: F32, a: F64, b: F64, ghosts: Sequence[GhostSource] = ()) -> int:
        """The vertices' part of `deform`; returns the number of ghost groups, own ones included."""
        groups = self._load(ghosts)
        while not deform_frame(self._table, a, b, vertices, normals):
            self._reserve_pairs(2 * int(self._stats[table.PAIR_NEED]))
        return groups

    def _displace(self, vertices: F32, normals: F32, displacement: F32) -> None:
        """Lay a displacement on after `solve`, then the normals round everything that moved."""
        if self._pressed is None:
            self._pressed = np.zeros(len(vertices), np.float32), np.zeros(len(vertices), np.int32)
        press, out = self._pressed
        press[:] = 0.0
        pressed(self._table, vertices, normals, press)
        moved = self._moved_list[: int(self._stats[table.MOVED_COUNT])]
        given = np.ascontiguousarray(displacement, np.float32)
        if given.shape != press.shape:
            raise ValueError(f"displacement: expected shape {press.shape}, got {given.shape}")
        count = lay_on(vertices, normals, given, press, self._moved, moved, out)
        if count:
            self._normals.update(vertices, normals, out[:count])

    def update_normals(self, vertices: F32, normals: F32) -> None:
        """The normals' part of `deform`: those round the vertices the last `solve` moved."""
        count = int(self._stats[table.MOVED_COUNT])
        if count:
            self._normals.update(vertices, normals, self._moved_list[:count])

    def ghosts(self, a: F64, b: F64, target: NDArray[np.bool_] | None = None) -> GhostSource:
        """This body, posed, as ghosts for another: a, b as for `deform`; target: (P,) of the other body,
        None all."""
        count, groups = len(a), self.embedding.limbs.groups
        rows, box = np.zeros((count, ROW), np.float32), np.empty((count, 6), np.float32)
        pose_ghosts(self._table, a, b, rows, box)
        return GhostSource(
            rows,
            np.full(count, CONE_SPHERE, np.int32),
            box,
            _NO_CORNERS,
            self._start,
            np.ones(groups, np.float32),
            np.full(groups, -1.0, np.float32),
            target,
        )

    @property
    def calibration(self) -> tuple[I32, F32]:
        """Vertices (NB, LANES) of the blocks, and their calibration (NB, PATCHES, CAL_ROWS, WIDTH) as the kernels read it:
        who moves the skin at rest writes its offsets, so that the moved skin is F = T."""
        return self._arrays[table.INDEX].astype(np.int32), self._arrays[table.CALIBRATION].view(np.float32)

    @property
    def moved(self) -> NDArray[np.uint8]:
        """(V,) 1 where the last frame moved the vertex."""
        return self._moved

    @property
    def lost(self) -> NDArray[np.uint8]:
        """(V,) 1 where the last frame found no root, as `DeformReport.lost` counts them."""
        return self._lost

    def __setstate__(self, state: dict[str, Any]) -> None:
        """After unpickling the arrays lie elsewhere."""
        self.__dict__.update(state)
        for slot, array in list(self._arrays.items()):
            self._keep(slot, array)

    def _keep(self, slot: int, array: NDArray[np.generic]) -> None:
        """Hold an array and note its address."""
        array = _aligned(array) if slot in _VECTORS else np.ascontiguousarray(array)
        self._arrays[slot] = array
        self._table[slot] = array.ctypes.data

    def _keep_blocks(self, blocks: Blocks) -> None:
        count = len(blocks.index)
        contact = blocks.calibration[:, :, table.CONTACT].reshape(count, -1)
        middle = np.argmax(blocks.index == blocks.centre[:, :1], axis=1)
        for slot, array in (
            (table.INDEX, blocks.index),
            (table.CENTRE, blocks.centre),
            (table.SPREAD, blocks.spread),
            (table.COUNT, blocks.count),
            (table.GROUP, blocks.group),
            (table.HINGE, blocks.hinge),
            (table.OTHER, blocks.other),
            (table.CALIBRATION, blocks.calibration),
            (table.MOST_CONTACT, contact.max(axis=1)),
            (table.OVERLAP, blocks.overlap),
            (table.MIDDLE_CONTACT, contact[np.arange(count), middle]),
            (table.OVERLAP_ROW, blocks.overlap_row),
            (table.GROUP_BLOCKS, blocks.group_blocks),
            (table.SELF_RULE, blocks.self_rule),
            (table.LISTED_BLOCKS, np.zeros((count, 3), np.int32)),
            (table.BLOCK, np.zeros((count, 6, LANES), np.float32)),
            (table.GATHERED, np.zeros(count, np.uint8)),
        ):
            self._keep(slot, array)
        self._table[table.BLOCKS] = count

    def _reserve(self, primitives: int, groups: int, corners: int, parameters: int) -> None:
        """Room for this many ghost primitives, groups, polygon corners and effects' parameters, own ones
        included."""
        own = self.embedding.limbs.groups
        self._room = primitives, groups, corners, parameters
        self._delta = np.zeros(groups, np.float32)
        self._effect, self._parameter_start = np.zeros(groups, np.int32), np.zeros(groups + 1, np.int32)
        self._parameters, self._allowed = np.zeros(parameters, np.float32), np.ones((groups, own), np.uint8)
        self._group_box = np.zeros((groups, 6), np.float32)
        members = 3 * self._own_primitives + 8 + primitives
        start = np.zeros(groups + 1, np.int32)
        start[: own + 1] = self._start
        for slot, array in (
            (table.ROWS, np.zeros((primitives, ROW), np.float32)),
            (table.BOX, np.zeros((primitives, 6), np.float32)),
            (table.KIND, np.full(primitives, CONE_SPHERE, np.int32)),
            (table.CORNERS, np.zeros((corners, 2), np.float32)),
            (table.GROUP_START, start),
            (table.GROUP_BOX, self._group_box),
            (table.QUOTIENT, np.ones(groups, np.float32)),
            (table.DEPTH, np.full(groups, -1.0, np.float32)),
            (table.ALLOWED, self._allowed),
            (table.EFFECT, self._effect),
            (table.PARAMETER_START, self._parameter_start),
            (table.PARAMETERS, self._parameters),
            (table.DELTA, self._delta),
            (table.ZONE, np.zeros(groups, np.float32)),
            (table.REACH, np.zeros(groups, np.float32)),
            (table.CANDIDATES, np.zeros((own, groups), np.int32)),
            (table.MEMBERS, np.zeros((members, 2), np.int32)),
            (table.RAYS, np.zeros((members, 6, WIDTH), np.float32)),
            (table.ACTING, np.zeros((groups, table.ACT), np.int64)),
            (table.SHARE, np.zeros((groups, 2), np.float32)),
        ):
            self._keep(slot, array)
        self._table[table.ALL_GROUPS] = groups

    def _reserve_pairs(self, pairs: int) -> None:
        self._keep(table.PAIRS, np.zeros((pairs, table.PAIR), np.int32))
        self._keep(table.MASK, np.zeros(pairs, np.int64))
        self._keep(table.HEIGHT, np.zeros(pairs, np.float32))
        self._keep(table.LOW, np.zeros(pairs, np.float32))
        self._table[table.PAIR_ROOM] = pairs

    def _load(self, ghosts: Sequence[GhostSource]) -> int:
        """Append the ghosts' rows to the body's own; returns how many groups there are now."""
        row, group, corner, parameter = self._own_primitives, self._own_groups, 0, 0
        rows, groups, corners, parameters = row, group, 0, 0
        for source in ghosts:
            rows, groups, corners = rows + len(source.rows), groups + len(source.compliance), corners + len(source.corners)
            parameters += 0 if source.parameters is None else len(source.parameters)
        have = self._room
        if rows > have[0] or groups > have[1] or corners > have[2] or parameters > have[3]:
            self._reserve(2 * rows, 2 * groups, max(1, 2 * corners), max(1, 2 * parameters))
        for source in ghosts:
            load_source(
                self._table,
                row,
                group,
                corner,
                source.rows,
                source.kind,
                source.box,
                source.corners,
                source.group_start,
                source.compliance,
                source.depth,
            )
            end = group + len(source.compliance)
            if source.target is not None:
                limbs = self.embedding.limbs
                self._allowed[group:end] = np.bincount(limbs.group, source.target, limbs.groups) > 0
            if source.effect is not None and source.parameters is not None and source.parameter_start is not None:
                self._set_effects(source.effect, source.parameters, source.parameter_start, group, parameter)
                parameter += len(source.parameters)
            row, group, corner = row + len(source.rows), end, corner + len(source.corners)
        self._table[table.GROUPS] = group
        return group

    def _set_effects(self, effect: I32, parameters: F32, start: I32, group: int, first: int) -> None:
        """Effects of a source's groups, from `group` on; a force field's box is its group's."""
        end = group + len(effect)
        self._effect[group:end] = effect
        self._parameters[first : first + len(parameters)] = parameters
        self._parameter_start[group:end] = start[:-1] + first
        for g in np.flatnonzero(effect >= OWN_EFFECT):
            self._group_box[group + g] = parameters[start[g] : start[g] + 6]


def _aligned(array: NDArray[np.generic]) -> NDArray[np.generic]:
    """`array` itself where it is contiguous and begins at a cache line, else a copy that does: vectors that straddle
    two lines take twice as long to load."""
    if array.flags.c_contiguous and array.ctypes.data % _LINE == 0:
        return array
    room = np.empty(array.nbytes + _LINE, np.uint8)
    first = -room.ctypes.data % _LINE
    out = room[first : first + array.nbytes].view(array.dtype).reshape(array.shape)
    out[...] = array
    return out
