"""The deformation on the GPU: transform feedback that walks the same rows as the CPU kernels, into the buffer drawn.

Three passes, GL 3.3: bones move the vertices, blocks that act solve theirs, and every drawn corner takes its place
and normal. What goes to the GPU in a frame is one table of some tens of kilobytes; nothing comes back.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import cache

import moderngl
import numpy as np

from vistel.arrays import F32, I32
from vistel.figure.figure import vertex_normals
from vistel.figure.figure_plan import FigurePlanner
from vistel.figure.layers.skin import LayerTerms
from vistel.figure.rigid.bulge import BulgeShapes
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINT_INDEX, JOINTS
from vistel.implicit import constants as implicit_constants
from vistel.implicit.contacts import contact_set
from vistel.implicit.deformation import (
    deform_table,
    displace_kernels,
    effect_kernels,
    field_kernels,
    min_rule_kernels,
    solve_kernels,
)
from vistel.implicit.deformation.deform_plan import BONE, FramePlan, MeshLayout
from vistel.implicit.deformation.normals_kernels import GAP
from vistel.render.gl.context import Capability, GlContext
from vistel.render.gl.programs import feedback, vertex_array

log = logging.getLogger("vistel.renderer")


TABLE_WIDTH = 1024
"""Texels in a row of every table."""
# Texture units.
PLAN = 0
OVERLAP = 1
PLACED = 2
NORMALS = 3
FANS = 4
TERMS = 5
CHANNELS = 6
ENGINES = ("auto", "cpu", "gpu")
_NO_BLOCK = (-1, 0)


@cache
def constants() -> str:
    """The kernels' numbers, as GLSL."""
    whole = {
        "LANES": field_kernels.LANES,
        "MAX_EVALUATIONS": solve_kernels.MAX_EVALUATIONS,
        "GAP": GAP,
        "TABLE_WIDTH": TABLE_WIDTH,
        "BONE_TEXELS": BONE // 4,
        "BONES": len(JOINTS) + len(TWIST_BONES),
        **{k: getattr(contact_set, k) for k in ("CONE_SPHERE", "ROUNDED_POLYGON", "SUPERELLIPSOID")},
        **{k: getattr(deform_table, k) for k in ("NEIGHBOUR", "COLLIDES", "FORCE")},
        **{k: getattr(effect_kernels, k) for k in ("FADING", "PULLED", "DIRECTIONAL", "SHEAR", "RADIAL")},
    }
    real = {
        **{k: getattr(field_kernels, k) for k in ("T", "TINY", "SMALL", "HUGE")},
        **{k: getattr(min_rule_kernels, k) for k in ("CAP", "SOFT2")},
        **{k: getattr(solve_kernels, k) for k in ("TOLERANCE", "NEAR", "SHORT")},
        "FLATTEN": displace_kernels.FLATTEN,
        **{k: getattr(implicit_constants, k) for k in ("MOST_CHANGE", "LEAST_DIVISOR", "LEAST_SQUARE")},
    }
    lines = [f"const int {k} = {int(v)};" for k, v in whole.items()]
    lines += [f"const float {k} = {float(np.float32(v)):.9g};" for k, v in real.items()]
    return "".join(line + "\n" for line in lines)


def choose_engine(asked: str, capability: Capability) -> str:
    """ "cpu" or "gpu": what deforms where `asked` is "auto". Software GL takes many times as long as the CPU kernels.

    Raises ValueError for an engine that is none.
    """
    if asked not in ENGINES:
        raise ValueError(f"engine: expected one of {', '.join(ENGINES)}, got {asked!r}")
    if asked != "auto":
        return asked
    return "cpu" if capability.software else "gpu"


def open_deformer(surface: GlContext, asked: str) -> GpuDeformer | None:
    """The GPU's deformation where it is chosen and the driver takes it, None for the CPU's; says which."""
    engine, renderer = choose_engine(asked, surface.capability), surface.capability.renderer
    made: GpuDeformer | None = None
    if engine == "gpu":
        try:
            made = GpuDeformer(surface.ctx)
        except moderngl.Error as e:
            log.warning("event=deforming_with engine=cpu renderer=%r reason=%r", renderer, str(e))
            return None
    log.info("event=deforming_with engine=%s asked=%s renderer=%r", engine, asked, renderer)
    return made


@dataclass(frozen=True, eq=False)
class SkinShape:
    """What of a deforming skin never changes. rest, rest_normal: (V, 3); bone, weight: (V, 4); place: (V, 2) block and
    lane; calibration: (V, 7); overlap: (NO, LANES); corner: (C, 3) of every drawn corner its vertex and fan from,
    to; fan; bulge: (V, 6) of `BulgeShapes` out, along and hinge, -1 none; layers: (V, 2) of `LayerTerms` from, to, fall: (V,),
    channel: (N,), term: (N, 4)."""

    rest: F32
    rest_normal: F32
    bone: I32
    weight: F32
    place: I32
    calibration: F32
    overlap: F32
    corner: I32
    fan: I32
    bulge: F32
    layers: I32
    fall: F32
    channel: I32
    term: F32

    @staticmethod
    def of(planner: FigurePlanner) -> SkinShape:
        """A figure with its eyeballs; corners in the order of `avatar_model`."""
        figure, avatar = planner.figure, planner.figure.avatar
        places, skin = planner.planner.places(), figure.skin
        rest, rest_normal = skin.rest
        shape = SkinShape.of_places(
            places,
            rest,
            rest_normal,
            skin.influences.bone,
            skin.influences.weight,
            avatar.mesh.corner_vertex,
            skin.shapes,
            None if figure.layers is None else figure.layers.terms(),
        )
        for ball, joint in zip(avatar.eyeballs, (JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]), strict=False):
            shape = shape.with_stiff(ball.vertices, vertex_normals(ball), joint, ball.corner_vertex)
        return shape

    @staticmethod
    def of_places(
        places: MeshLayout,
        rest: F32,
        rest_normal: F32,
        bone: I32,
        weight: F32,
        corner_vertex: I32,
        shapes: BulgeShapes | None = None,
        layers: LayerTerms | None = None,
    ) -> SkinShape:
        """A mesh. rest .. weight: (V, ...) and corner_vertex: (C,), in the mesh's own order; shapes: what bulges; layers: what
        lies under it."""
        order = places.vertex
        back = np.empty(len(rest), np.int32)
        back[order] = np.arange(len(order), dtype=np.int32)
        of_corner = back[corner_vertex]
        bulge = _no_bulge(len(rest))
        if shapes is not None:
            bulge = np.hstack([shapes.out, shapes.along, shapes.hinge[:, None]]).astype(np.float32)
        corner = np.stack([of_corner, places.fan_start[of_corner], places.fan_start[of_corner + 1]], axis=1)
        return SkinShape(
            rest[order],
            rest_normal[order],
            bone[order],
            weight[order],
            np.stack([places.block, places.lane], axis=1),
            places.calibration,
            places.overlap,
            corner.astype(np.int32),
            places.fan,
            bulge[order],
            *_layers(layers or LayerTerms.none(len(rest)), order),
        )

    def with_stiff(self, rest: F32, rest_normal: F32, joint: int, corner_vertex: I32) -> SkinShape:
        """The same with vertices (n, 3) that follow one joint and touch nothing."""
        n, corners = len(rest), np.zeros((len(corner_vertex), 3), np.int32)
        corners[:, 0] = corner_vertex + len(self.rest)
        return SkinShape(
            np.concatenate([self.rest, rest.astype(np.float32)]),
            np.concatenate([self.rest_normal, rest_normal.astype(np.float32)]),
            np.concatenate([self.bone, np.full((n, 4), joint, np.int32)]),
            np.concatenate([self.weight, np.tile(np.array((1, 0, 0, 0), np.float32), (n, 1))]),
            np.concatenate([self.place, np.tile(np.array(_NO_BLOCK, np.int32), (n, 1))]),
            np.concatenate([self.calibration, np.zeros((n, 7), np.float32)]),
            self.overlap,
            np.concatenate([self.corner, corners]),
            self.fan,
            np.concatenate([self.bulge, _no_bulge(n)]),
            np.concatenate([self.layers, np.zeros((n, 2), np.int32)]),
            np.concatenate([self.fall, np.zeros(n, np.float32)]),
            self.channel,
            self.term,
        )


def _layers(terms: LayerTerms, order: I32) -> tuple[I32, F32, I32, F32]:
    start = terms.start
    return np.stack([start[:-1], start[1:]], axis=1)[order], terms.fall[order], terms.channel, terms.term


def _no_bulge(count: int) -> F32:
    return np.tile(np.array((0, 0, 0, 0, 0, -1), np.float32), (count, 1))


class GpuDeformer:
    """The three programs. Every call comes from the thread of the context.

    Raises moderngl.Error where the driver does not take the shaders.
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        head = constants()
        self.skin = feedback(ctx, "deform/skin", ("position", "normal"), head)
        self.solve = feedback(ctx, "deform/solve", ("placed",), head)
        self.corner = feedback(ctx, "deform/corner", ("position", "normal"), head, interleaved=True)
        self._displaced: moderngl.Program | None = None
        for program in (self.skin, self.solve, self.corner):
            self._bind(program)
        # Without a framebuffer (surfaceless EGL has none) transform feedback silently does nothing.
        self._target = ctx.simple_framebuffer((4, 4))

    @property
    def displaced(self) -> moderngl.Program:
        """The solve for skins with a displacement; made when the first one comes."""
        if self._displaced is None:
            self._displaced = feedback(self.ctx, "deform/solve", ("placed",), "#define DISPLACED\n" + constants())
            self._bind(self._displaced)
        return self._displaced

    def _bind(self, program: moderngl.Program) -> None:
        for name, unit in (
            ("plan", PLAN),
            ("overlap", OVERLAP),
            ("placed", PLACED),
            ("rigid_normals", NORMALS),
            ("fans", FANS),
            ("terms", TERMS),
            ("channels", CHANNELS),
        ):
            if name in program and isinstance(program[name], moderngl.Uniform):
                program[name].value = unit  # type: ignore[union-attr]

    def use(self) -> None:
        """Make ready for passes; whoever draws next binds their own target."""
        self._target.use()

    def release(self) -> None:
        """Give everything back."""
        for part in (self.skin, self.solve, self.corner, self._target, self._displaced):
            if part is not None:
                part.release()


class GpuSkin:
    """One skin on the GPU."""

    def __init__(self, engine: GpuDeformer, shape: SkinShape) -> None:
        self.engine, self.shape = engine, shape
        ctx = engine.ctx
        self._count, self._corners = len(shape.rest), len(shape.corner)
        fixed = ctx.buffer(np.hstack((shape.rest, shape.rest_normal, shape.weight)).astype(np.float32).tobytes())
        bones = ctx.buffer(shape.bone.astype(np.int32).tobytes())
        places = ctx.buffer(shape.place.astype(np.int32).tobytes())
        calibration = ctx.buffer(shape.calibration.astype(np.float32).tobytes())
        corner = ctx.buffer(shape.corner.astype(np.int32).tobytes())
        bulge = ctx.buffer(np.ascontiguousarray(shape.bulge, np.float32).tobytes())
        layers = ctx.buffer(np.ascontiguousarray(shape.layers, np.int32).tobytes())
        fall = ctx.buffer(shape.fall.astype(np.float32).tobytes())
        # Whole rows of a texture each, which are copied from them.
        size = 16 * TABLE_WIDTH * _rows(self._count)
        self._rigid, self._normal, self._placed = (ctx.buffer(reserve=size) for _ in range(3))
        self._skin = vertex_array(
            ctx,
            engine.skin,
            [
                (fixed, "3f 3f 4f", "rest", "rest_normal", "weight"),
                (bones, "4i", "bone"),
                (bulge, "3f 3f", "bulge", "bulging"),
                (layers, "2i", "layers"),
                (fall, "1f", "fall"),
            ],
        )
        self._inputs = [
            (self._rigid, "4f", "position"),
            (self._normal, "4f", "normal"),
            (places, "2i", "place"),
            (calibration, "4f 3f", "calibration_a", "calibration_b"),
        ]
        self._solve = vertex_array(ctx, engine.solve, self._inputs)
        self._displacement: tuple[moderngl.Buffer, moderngl.Buffer, moderngl.VertexArray] | None = None
        self._offset_before = False
        self._corner = vertex_array(ctx, engine.corner, [(corner, "3i", "fan")])
        self._plan = ctx.texture((TABLE_WIDTH, 1), 4, dtype="i4")
        self._overlap = _table(ctx, shape.overlap.reshape(-1), "f4")
        self._fans = _table(ctx, shape.fan, "i4")
        self._terms, self._channels = _table(ctx, shape.term, "f4"), _table(ctx, shape.channel, "i4")
        self._at, self._normals = (ctx.texture((TABLE_WIDTH, _rows(self._count)), 4, dtype="f4") for _ in range(2))
        self._parts = [
            fixed,
            bones,
            places,
            calibration,
            corner,
            bulge,
            layers,
            fall,
            self._rigid,
            self._normal,
            self._placed,
            self._skin,
            self._solve,
            self._corner,
            self._overlap,
            self._fans,
            self._terms,
            self._channels,
            self._at,
            self._normals,
        ]

    def run(self, plan: FramePlan, out: moderngl.Buffer, offsets: F32 | None = None) -> None:
        """Write position and normal (3f 3f) of every drawn corner to `out`. offsets: (V, 3) by which vertices move after all else,
        room frame [m]; only with a plan that has a displacement."""
        engine = self.engine
        engine.use()
        self._upload(plan)
        for unit, texture in (
            (PLAN, self._plan),
            (OVERLAP, self._overlap),
            (FANS, self._fans),
            (TERMS, self._terms),
            (CHANNELS, self._channels),
        ):
            texture.use(unit)
        self._skin.transform([self._rigid, self._normal], moderngl.POINTS, self._count)
        placed = self._rigid
        if plan.acts:
            placed = self._placed
            solve = self._solve if plan.displacement is None else self._displaced(plan.displacement, offsets)
            solve.transform(placed, moderngl.POINTS, self._count)
        self._at.write(placed)
        self._normals.write(self._normal)
        self._at.use(PLACED)
        self._normals.use(NORMALS)
        self._corner.transform(out, moderngl.POINTS, self._corners)

    def _displaced(self, displacement: F32, offsets: F32 | None) -> moderngl.VertexArray:
        """The solve with a displacement per vertex; vertices that follow one joint have none."""
        ctx = self.engine.ctx
        if self._displacement is None:
            buffer, laid = ctx.buffer(bytes(4 * self._count)), ctx.buffer(bytes(12 * self._count))
            inputs = [*self._inputs, (buffer, "1f", "displacement"), (laid, "3f", "laid")]
            self._displacement = buffer, laid, vertex_array(ctx, self.engine.displaced, inputs)
        self._displacement[0].write(np.ascontiguousarray(displacement, np.float32))
        if offsets is not None:
            self._displacement[1].write(np.ascontiguousarray(offsets, np.float32))
        elif self._offset_before:
            self._displacement[1].clear()
        self._offset_before = offsets is not None
        return self._displacement[2]

    def placed(self, plan: FramePlan) -> tuple[F32, I32]:
        """For measuring: positions (V, 3) [m] after `run`, in the order of the shape, and flags (V,): 1 moved + 2 no
        root."""
        buffer = self._placed if plan.acts else self._rigid
        rows = np.frombuffer(buffer.read(16 * self._count), np.float32).reshape(-1, 4)
        return rows[:, :3].copy(), rows[:, 3].astype(np.int32)

    def release(self) -> None:
        """Give everything back."""
        for part in (*self._parts, self._plan, *(self._displacement or ())):
            part.release()

    def _upload(self, plan: FramePlan) -> None:
        rows = _rows(len(plan.words))
        if rows > self._plan.height:
            self._plan.release()
            self._plan = self.engine.ctx.texture((TABLE_WIDTH, 2 * rows), 4, dtype="i4")
        full = len(plan.words) // TABLE_WIDTH
        if full:
            self._plan.write(plan.words[: full * TABLE_WIDTH], viewport=(0, 0, TABLE_WIDTH, full))
        rest = len(plan.words) - full * TABLE_WIDTH
        if rest:
            self._plan.write(plan.words[full * TABLE_WIDTH :], viewport=(0, full, rest, 1))


def _rows(texels: int) -> int:
    return max(1, -(-texels // TABLE_WIDTH))


def _table(ctx: moderngl.Context, values: F32 | I32, dtype: str) -> moderngl.Texture:
    """One number per texel, or one row of them."""
    padded = np.zeros((TABLE_WIDTH * _rows(len(values)), *values.shape[1:]), values.dtype)
    padded[: len(values)] = values
    return ctx.texture((TABLE_WIDTH, _rows(len(values))), padded[0].size, padded.tobytes(), alignment=4, dtype=dtype)
