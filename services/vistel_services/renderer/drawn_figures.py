"""Figures on the graphics side: textures, and buffers for each level of detail."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from vistel.implicit.deform_plan import FramePlan
from vistel.wrinkle.shown import MOST_SETS
from vistel_services.renderer.gpu_deform import GpuDeformer, GpuSkin, SkinShape
from vistel_services.renderer.programs import program, put

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
U8 = NDArray[np.uint8]

_WRINKLE_UNIT = 4


@dataclass(frozen=True, eq=False)
class Creases:
    """Wrinkles on a figure's texture (`vistel.wrinkle.shown`). sets: (n, 4) of each channel the set near a vertex, counted from 1,
    0 none; pull: (n, 4) how far its texture coordinate moves up. picture: makes the channels' light, (h, w, 4), first row at
    the top."""

    sets: U8
    pull: F32
    picture: Callable[[], U8]


@dataclass(frozen=True, eq=False)
class FigureModel:
    """What of a figure stays: uv (n, 2), material (n,) 0 cloth, 1 skin, 2 eye; triangles (m, 3) and those without the
    head (drawn for one's own body, seen through its eyes); texture (h, w, 3) sRGB, first row at the top."""

    uv: F32
    material: F32
    triangles: I32
    headless: I32
    texture: U8
    creases: Creases | None = None


@dataclass(frozen=True, eq=False)
class Corners:
    """Drawn vertices of a figure, room frame: positions and normals (n, 3)."""

    positions: F32
    normals: F32


@dataclass(frozen=True, eq=False)
class Planned:
    """A figure that the GPU poses and deforms: what of it never changes, and the frame; offsets: (V, 3) what its face does, in
    the order of the shape, room frame [m]; None: nothing."""

    shape: SkinShape
    plan: FramePlan
    offsets: F32 | None = None


@dataclass(frozen=True)
class FigureView:
    """A figure in a frame; limbs (P, 8): ends a, radius, b, radius [m]. own: without a head; shown: else only its shadow.
    folds: (S,) how much of each set of wrinkles is there, None for none of them."""

    name: str
    model: FigureModel
    skin: Corners | Planned
    limbs: F32
    own: bool = False
    shown: bool = True
    folds: F32 | None = None


_Parts = tuple[moderngl.VertexArray, ...]


@dataclass
class _FigureBuffers:
    """One level of detail of a figure. plain, creased: how it is drawn without wrinkles and with them, whole and without a head;
    each in parts."""

    dynamic: moderngl.Buffer
    plain: tuple[_Parts, _Parts]
    creased: tuple[_Parts, _Parts] | None
    buffers: list[moderngl.Buffer]
    gpu: GpuSkin | None = None

    def release(self) -> None:
        for part in (*sum(self.plain + (self.creased or ()), ()), self.dynamic, *self.buffers):
            part.release()
        if self.gpu is not None:
            self.gpu.release()


@dataclass
class _Figure:
    """A figure on the graphics side: one texture, the light of its wrinkles, buffers for each level of detail seen so far."""

    painted: U8
    texture: moderngl.Texture
    light: moderngl.Texture | None
    levels: dict[FigureModel, _FigureBuffers] = field(default_factory=dict)

    def release(self) -> None:
        for part in (self.texture, self.light, *self.levels.values()):
            if part is not None:
                part.release()


class DrawnFigures:
    """Makes and draws figures. deformer: for those that are `Planned`; light: defines of the shaders; paint: a texture of a
    picture (h, w, 3 or 4), first row at the top."""

    def __init__(
        self, ctx: moderngl.Context, deformer: GpuDeformer | None, light: tuple[str, ...],
        paint: Callable[[U8], moderngl.Texture],
    ) -> None:  # fmt: skip
        self._ctx, self._deformer, self._paint = ctx, deformer, paint
        self._plain = program(ctx, "figure", defines=light)
        self._creased = program(ctx, "figure", defines=(*light, "WRINKLED", f"SETS {MOST_SETS + 1}"))
        self._figures: dict[str, _Figure] = {}

    def put(self, view: FigureView) -> None:
        """The figure's vertices into the buffer that is drawn."""
        buffers, skin = self._figure(view), view.skin
        if isinstance(skin, Corners):
            buffers.dynamic.write(np.hstack((skin.positions, skin.normals)))
            return
        if buffers.gpu is None:
            if self._deformer is None:
                raise ValueError(f"figure {view.name}: planned for the GPU, and this painter has no deformer")
            buffers.gpu = GpuSkin(self._deformer, skin.shape)
        buffers.gpu.run(skin.plan, buffers.dynamic, skin.offsets)

    def draw(self, views: Sequence[FigureView], shared: dict[str, object]) -> None:
        """Draw figures whose vertices were put, with what all shaders share."""
        put(self._plain, albedo=0, **shared)
        put(self._creased, albedo=0, wrinkle_light=_WRINKLE_UNIT, **shared)
        for view in sorted(views, key=lambda v: not v.own):
            self._draw(view)

    def drop(self, name: str) -> None:
        """Forget a figure."""
        if (old := self._figures.pop(name, None)) is not None:
            old.release()

    def _draw(self, view: FigureView) -> None:
        figure = self._figures[view.name]
        buffers = figure.levels[view.model]
        figure.texture.use(0)
        drawn = buffers.plain
        if buffers.creased is not None and figure.light is not None and view.folds is not None and view.folds.any():
            drawn = buffers.creased
            figure.light.use(_WRINKLE_UNIT)
            weights = np.zeros(MOST_SETS + 1, np.float32)
            weights[1 : len(view.folds) + 1] = view.folds[:MOST_SETS]
            put(self._creased, wrinkle=weights.tobytes())
        for part in drawn[int(view.own)]:
            part.render()

    def _figure(self, view: FigureView) -> _FigureBuffers:
        ctx, model = self._ctx, view.model
        figure = self._figures.get(view.name)
        if figure is None or figure.painted is not model.texture:
            self.drop(view.name)
            texture = self._paint(model.texture)
            light = None
            if model.creases is not None:
                light = self._paint(model.creases.picture())
            figure = self._figures[view.name] = _Figure(model.texture, texture, light)
        if model in figure.levels:
            return figure.levels[model]
        dynamic = ctx.buffer(reserve=len(model.uv) * 24, dynamic=True)
        fixed = ctx.buffer(np.column_stack((model.uv, model.material)).astype(np.float32).tobytes())
        layout = [(dynamic, "3f 3f", "position", "normal"), (fixed, "2f 1f", "uv", "material")]
        buffers = [fixed]

        def part(by: moderngl.Program, triangles: I32, layout: Sequence[Any]) -> _Parts:
            if len(triangles) == 0:
                return ()
            index = ctx.buffer(triangles.astype(np.int32).tobytes())
            buffers.append(index)
            return (ctx.vertex_array(by, layout, index),)

        every = (model.triangles, model.headless)
        plain = tuple(part(self._plain, t, layout) for t in every)
        creased = None
        if model.creases is not None:
            sets, pull = (ctx.buffer(np.ascontiguousarray(a).tobytes()) for a in (model.creases.sets, model.creases.pull))
            buffers += [sets, pull]
            more = [*layout, (sets, "4u1", "sets"), (pull, "4f", "pull")]
            # Only triangles that can crease pay for it.
            can = np.asarray(model.creases.sets.any(axis=1))
            whole, headless = (
                part(self._creased, t[c], more) + part(self._plain, t[~c], layout)
                for t, c in ((t, can[t].any(axis=1)) for t in every)
            )
            creased = whole, headless
        figure.levels[model] = _FigureBuffers(dynamic, (plain[0], plain[1]), creased, buffers)
        return figure.levels[model]


def in_sight(clip: F64, limbs: F32) -> bool:
    """Whether any of a figure's limbs (P, 8) may be in the picture of clip space `clip` (4, 4); cautious."""
    ends = np.concatenate((limbs[:, 0:3], limbs[:, 4:7]))
    p = np.column_stack((ends, np.ones(len(ends)))) @ clip.T
    norms = np.linalg.norm(clip[:, :3], axis=1)
    reach = 0.35 * (norms[:3] + norms[3])  # a limb's girth, hair and clothes
    w = p[:, 3]
    outside = [(p[:, k] * sign > w + reach[k]).all() for k in (0, 1) for sign in (-1.0, 1.0)]
    return not (any(outside) or (w < -0.35).all())

