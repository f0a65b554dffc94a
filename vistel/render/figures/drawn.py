"""Figures on the graphics side: textures, and buffers for each level of detail."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import moderngl
import numpy as np

from vistel.arrays import F32, F64, I32, U8
from vistel.figure.avatar.patch import Patch, patch_of
from vistel.implicit.deformation.deform_plan import FramePlan
from vistel.render.figures.gpu_deform import GpuDeformer, GpuSkin, SkinShape
from vistel.render.figures.patches import DrawBatch, Patches
from vistel.render.gl.programs import program, put, vertex_array
from vistel.render.light.shadow import Caster, ShadowMap
from vistel.wrinkle.shown import MOST_SETS

_WRINKLE_UNIT = 4
_WRINKLED = ("WRINKLED", f"SETS {MOST_SETS + 1}")


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
    head (drawn for one's own body, seen through its eyes); texture (h, w, 3) sRGB, first row at the top. casting: fewer
    triangles, which throw its shadow where that must cost little, in place of all that are no sheets; None: all. patches: what
    parts of the texture are like where its file says so. small: it is for pictures in which the figure is small."""

    uv: F32
    material: F32
    triangles: I32
    headless: I32
    texture: U8
    creases: Creases | None = None
    casting: I32 | None = None
    patches: tuple[Patch, ...] = ()
    small: bool = False


@dataclass(frozen=True, eq=False)
class Corners:
    """Drawn vertices of a figure, room frame: rows (n, 6) of a position and a normal."""

    rows: F32

    @property
    def positions(self) -> F32:
        """(n, 3) [m]."""
        return self.rows[:, :3]

    @property
    def normals(self) -> F32:
        """(n, 3), of length 1."""
        return self.rows[:, 3:]


@dataclass(frozen=True, eq=False)
class Planned:
    """A figure that the GPU poses and deforms: what of it never changes, and the frame; offsets: (V, 3) what its face and what
    hangs on it do, in the order of the shape, room frame [m]; None: nothing."""

    shape: SkinShape
    plan: FramePlan
    offsets: F32 | None = None


@dataclass(frozen=True)
class FigureView:
    """A figure in a frame; limbs (P, 8): ends a, radius, b, radius [m]. own: without a head; shown: else only its shadow.
    folds: (S,) how much of each set of wrinkles is there, None for none of them. seen: (Q, 8) the limbs that may be seen, None
    for all."""

    name: str
    model: FigureModel
    skin: Corners | Planned
    limbs: F32
    own: bool = False
    shown: bool = True
    folds: F32 | None = None
    seen: F32 | None = None

    def in_sight(self, clip: F64) -> bool:
        """Whether it may be in the picture of clip space `clip` (4, 4)."""
        return self.shown and in_sight(clip, self.limbs if self.seen is None else self.seen, self.own)


_Parts = tuple[DrawBatch, ...]


@dataclass
class _FigureBuffers:
    """One level of detail of a figure. plain, creased: how it is drawn without wrinkles and with them, whole and without a head;
    each in parts. casters: what throws its shadow."""

    dynamic: moderngl.Buffer
    plain: tuple[_Parts, _Parts]
    creased: tuple[_Parts, _Parts] | None
    casters: tuple[Caster, ...]
    buffers: list[moderngl.Buffer]
    gpu: GpuSkin | None = None

    def release(self) -> None:
        for part in (*sum(self.plain + (self.creased or ()), ()), *self.casters):
            part.vao.release()
        for buffer in (self.dynamic, *self.buffers):
            buffer.release()
        if self.gpu is not None:
            self.gpu.release()


@dataclass
class _Figure:
    """A figure on the graphics side: one texture, the light of its wrinkles, buffers for each level of detail seen so far."""

    painted: U8
    texture: moderngl.Texture
    light: moderngl.Texture | None
    levels: dict[FigureModel, _FigureBuffers] = field(default_factory=dict[FigureModel, _FigureBuffers])

    def release(self) -> None:
        for part in (self.texture, self.light, *self.levels.values()):
            if part is not None:
                part.release()


class DrawnFigures:
    """Makes and draws figures. deformer: for those that are `Planned`; light: defines of the shaders; paint: a texture of a
    picture (h, w, 3 or 4), first row at the top; shadow: the map that their shadows go to, in all their triangles if
    `fine`; sampled: whether pixels have several samples."""

    def __init__(
        self,
        ctx: moderngl.Context,
        deformer: GpuDeformer | None,
        light: tuple[str, ...],
        paint: Callable[[U8], moderngl.Texture],
        shadow: ShadowMap,
        fine: bool,
        sampled: bool,
    ) -> None:
        self._ctx, self._deformer, self._paint = ctx, deformer, paint
        self._shadow, self._fine = shadow, fine
        self._patches = Patches(ctx, light, paint, sampled)
        self._plain = program(ctx, "figure", defines=light)
        self._creased = program(ctx, "figure", defines=(*light, *_WRINKLED))
        self._figures: dict[str, _Figure] = {}

    def put(self, view: FigureView) -> None:
        """The figure's vertices into the buffer that is drawn."""
        buffers, skin = self._figure(view), view.skin
        if isinstance(skin, Corners):
            buffers.dynamic.write(skin.rows)
            return
        if buffers.gpu is None:
            if self._deformer is None:
                raise ValueError(f"figure {view.name}: planned for the GPU, and this painter has no deformer")
            buffers.gpu = GpuSkin(self._deformer, skin.shape)
        buffers.gpu.run(skin.plan, buffers.dynamic, skin.offsets)

    def casters(self, view: FigureView) -> tuple[Caster, ...]:
        """What throws the shadow of a figure whose vertices were put."""
        return self._figures[view.name].levels[view.model].casters

    def draw(self, views: Sequence[FigureView], shared: dict[str, object]) -> None:
        """Draw figures whose vertices were put, with what all shaders share."""
        put(self._plain, albedo=0, **shared)
        put(self._creased, albedo=0, wrinkle_light=_WRINKLE_UNIT, **shared)
        self._patches.share(wrinkle_light=_WRINKLE_UNIT, **shared)
        for view in sorted(views, key=lambda v: not v.own):
            self._draw(view)

    def drop(self, name: str) -> None:
        """Forget a figure."""
        if (old := self._figures.pop(name, None)) is not None:
            old.release()
            kept = [patch for figure in self._figures.values() for model in figure.levels for patch in model.patches]
            self._patches.forget([patch for model in old.levels for patch in model.patches], kept)

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
            self._patches.set(wrinkle=weights.tobytes())
        for part in drawn[int(view.own)]:
            if part.patch is None:
                part.vao.render()
        self._patches.draw(drawn[int(view.own)])

    def _figure(self, view: FigureView) -> _FigureBuffers:
        ctx, model = self._ctx, view.model
        figure = self._figures.get(view.name)
        if figure is None or figure.painted is not model.texture:
            self.drop(view.name)
            texture = self._paint(model.texture)
            light = None
            if model.creases is not None:
                light = self._paint(model.creases.picture())
            if model.uv.min() >= 0.0 and model.uv.max() <= 1.0:  # nothing repeats: cheaper to look up in software
                for picture in (texture, light):
                    if picture is not None:
                        picture.repeat_x = picture.repeat_y = False
            figure = self._figures[view.name] = _Figure(model.texture, texture, light)
        if model in figure.levels:
            return figure.levels[model]
        dynamic = ctx.buffer(reserve=len(model.uv) * 24, dynamic=True)
        fixed = ctx.buffer(np.column_stack((model.uv, model.material)).astype(np.float32).tobytes())
        layout = [(dynamic, "3f 3f", "position", "normal"), (fixed, "2f 1f", "uv", "material")]
        buffers = [fixed]

        def index(triangles: I32) -> moderngl.Buffer:
            buffers.append(ctx.buffer(np.ascontiguousarray(triangles, np.int32).tobytes()))
            return buffers[-1]

        def parts(triangles: I32, layout: Sequence[Any], creased: bool = False) -> _Parts:
            made: list[DrawBatch] = []
            for patch, those in self._split(model, triangles):
                by = self._creased if creased else self._plain
                if patch is not None:
                    by = self._patches.program(patch, _WRINKLED if creased else (), small=model.small)
                made.append(DrawBatch(vertex_array(ctx, by, layout, index(those), skip_errors=patch is not None), patch))
            return tuple(made)

        every = (model.triangles, model.headless)
        plain = tuple(parts(t, layout) for t in every)
        creased = None
        if model.creases is not None:
            sets, pull = (ctx.buffer(np.ascontiguousarray(a).tobytes()) for a in (model.creases.sets, model.creases.pull))
            buffers += [sets, pull]
            more = [*layout, (sets, "4u1", "sets"), (pull, "4f", "pull")]
            # Only triangles that can crease pay for it.
            can = np.asarray(model.creases.sets.any(axis=1))
            whole, headless = (
                parts(t[c], more, creased=True) + parts(t[~c], layout) for t, c in ((t, can[t].any(axis=1)) for t in every)
            )
            creased = whole, headless
        casting = self._split(model, model.triangles)
        if model.casting is not None and not self._fine:
            casting = [(None, model.casting), *((patch, those) for patch, those in casting if patch is not None and patch.sheet)]
        casters = tuple(
            self._shadow.figure(
                dynamic,
                fixed,
                index(those),
                None if patch is None else self._patches.holes(patch),
                patch is not None and patch.both_sides,
            )
            for patch, those in casting
        )
        figure.levels[model] = _FigureBuffers(dynamic, (plain[0], plain[1]), creased, casters, buffers)
        return figure.levels[model]

    def _split(self, model: FigureModel, triangles: I32) -> list[tuple[Patch | None, I32]]:
        """Triangles by the patches that they are on, those that look alike together."""
        on = patch_of(model.patches, model.uv, triangles)
        alike: dict[tuple[Any, ...], list[int]] = {}
        for k, patch in enumerate(model.patches):
            alike.setdefault((*patch.key, k if patch.pictures else -1), []).append(k)
        out: list[tuple[Patch | None, I32]] = [(None, triangles[on < 0])]
        out += [(model.patches[of[0]], triangles[np.isin(on, of)]) for of in alike.values()]
        return [(patch, those) for patch, those in out if len(those)]


def in_sight(clip: F64, limbs: F32, own: bool = False) -> bool:
    """Whether any of a figure's limbs (P, 8) may be in the picture of clip space `clip` (4, 4); cautious. own: seen by its own
    eyes, before which no hair and no skirt hangs."""
    ends = np.concatenate((limbs[:, 0:4], limbs[:, 4:8])).astype(np.float64)
    girth = 1.3 * ends[:, 3] + 0.07 if own else np.full(len(ends), 0.35)  # with hair and clothes
    p = np.column_stack((ends[:, :3], np.ones(len(ends)))) @ clip.T
    norms = np.linalg.norm(clip[:, :3], axis=1)
    w = p[:, 3]
    outside = [(p[:, k] * sign > w + girth * (norms[k] + norms[3])).all() for k in (0, 1) for sign in (-1.0, 1.0)]
    return not (any(outside) or (w < -girth).all())
