"""Draws one frame: shadow map, figures, things, room, names. Owns everything on the graphics side.

Every call comes from the thread that opened the surface.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import moderngl
import numpy as np

from vistel.arrays import F32, F64, U8
from vistel.render.figures.drawn import DrawnFigures, FigureView
from vistel.render.figures.gpu_deform import GpuDeformer
from vistel.render.gl.canvas import Canvas
from vistel.render.gl.context import GlContext
from vistel.render.gl.programs import as_gl
from vistel.render.gl.textures import texture_of
from vistel.render.light.occlusion import Occlusion
from vistel.render.light.shadow import ShadowMap
from vistel.render.light.surroundings import Reflections, open_air, surroundings
from vistel.render.overlays.gauges import Gauges
from vistel.render.overlays.overlays import LabelView, Names, Projectors, TexturedRectangle
from vistel.render.overlays.subtitles import Subtitles
from vistel.render.room.room import Furniture, ShellPanel
from vistel.render.room.shell import Shell
from vistel.render.stage.captions import Caption
from vistel.render.things.outlines import Outline, SilhouetteDrawer
from vistel.render.things.solid import SolidThings, SurfaceBuffers
from vistel.render.view.screens import Box, Sight
from vistel.space.files.surfaces import SurfacePiece
from vistel.space.things.tessellate import Surface3

_DARK = (0.05, 0.05, 0.06, 1.0)
"""Colour beyond the walls of a room."""
_OPEN = (0.62, 0.68, 0.74, 1.0)
"""Colour behind everything where there are no walls."""


@dataclass(frozen=True)
class DrawnThing:
    """A thing in a frame; matrix: (4, 4) thing to room. bent: its vertices are not where they are at rest."""

    id: str
    matrix: F32
    bent: bool = True


@dataclass(frozen=True)
class Frame:
    """Everything that is seen at one instant, and from where."""

    sights: Sequence[Sight]
    figures: Sequence[FigureView] = ()
    things: Sequence[DrawnThing] = ()
    labels: Sequence[LabelView] = ()
    outlines: Sequence[Outline] = ()
    captions: Sequence[Caption] = ()
    gauges: Sequence[tuple[str, bool]] = ()
    read: Sequence[F64] = ()
    """Corners (4, 3) of boards and panels in the room, from the lower left one round."""


class Painter:
    """Draws frames of `width` x `height` into its own picture. deformer: for figures that are `Planned`. fine: light
    as shaders/fine_light.glsl says; by default where a GPU draws. saves_shadows: they are drawn for every other picture
    only. samples: of each pixel; by default 4, but in fast light that the CPU draws 1."""

    def __init__(
        self,
        surface: GlContext,
        width: int,
        height: int,
        deformer: GpuDeformer | None = None,
        fine: bool | None = None,
        samples: int | None = None,
    ) -> None:
        self.surface = surface
        ctx = self.ctx = surface.ctx
        self.software = surface.capability.software
        self.fine = not self.software if fine is None else fine
        self.saves_shadows = self.software and not self.fine
        light = ("FINE",) if self.fine else ("LIGHT_PER_VERTEX", "ONE_TAP") if self.software else ()
        texels = 2600 if self.software else 8192

        def painted(picture: U8) -> moderngl.Texture:
            return texture_of(ctx, picture, self.software, texels)

        self.shadow = ShadowMap(ctx, 2048 if self.fine else 1024)
        self._samples = min(samples or (1 if self.software and not self.fine else 4), ctx.max_samples)
        self._figures = DrawnFigures(ctx, deformer, light, painted, self.shadow, self.fine, self._samples > 1)
        light = light if self.fine else ("ONE_TAP",) if self.software else ()
        self._shell = Shell(ctx, self.shadow, light, self.software)
        self._mirrors: Reflections | None = None
        self._solids = SolidThings(ctx, self.shadow, painted, light)
        self._things: dict[str, list[SurfaceBuffers]] = {}
        self._resting: dict[str, list[SurfaceBuffers]] = {}
        self._furniture: SurfaceBuffers | None = None
        self._pane = TexturedRectangle(ctx)
        self._outlines = SilhouetteDrawer(ctx)
        self._names = Names(ctx, self._pane)
        self._subtitles = Subtitles(ctx, self._pane)
        self._gauges = Gauges(ctx, self._pane)
        self._projectors = Projectors(ctx)
        self._drawn = 0
        self.seen: frozenset[str] = frozenset()
        """Figures that are, or may be, in the last picture."""
        self._occlusion = Occlusion(ctx) if self.fine else None
        self._canvas = Canvas(ctx, width, height, self._samples, self.fine)
        self._fit()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of its picture in pixels."""
        return self._canvas.size

    def resize(self, width: int, height: int) -> None:
        """Draw pictures of this size from now on."""
        old, self._canvas = self._canvas, Canvas(self.ctx, width, height, self._samples, self.fine)
        self._canvas.target.use()  # before the old one goes: moderngl binds again what was bound
        old.release()
        self._fit()

    def _fit(self) -> None:
        width, height = self.size
        self._whole: Box = (0, 0, width, height)
        self._names.line = max(12, round(height * 0.052))
        self._subtitles.line = max(14, round(height * 0.06))
        self._gauges.line = max(11, round(height * 0.034))

    # -- what is drawn -------------------------------------------------------------------------------------------

    def set_room(self, panels: Sequence[ShellPanel], furniture: Furniture | None) -> None:
        """The room to draw from now on; with no panels it stands in the open."""
        self._shell.build(panels)
        self._furniture = self._solids.plain(furniture.surface, furniture.tint) if furniture else None
        if self.fine:
            self._mirrors = Reflections(self.ctx, surroundings(self._shell.light_seen if self._shell else open_air))

    def set_thing(self, thing_id: str, surface: Surface3 | None, colours: F32, pieces: Sequence[SurfacePiece] = ()) -> None:
        """What a thing looks like. colours: (n, 3) linear, one per vertex of `surface`; pieces: of polymeshes."""
        self.drop_thing(thing_id)
        self._things[thing_id] = self._made(surface, colours, pieces)

    def set_resting(self, thing_id: str, surface: Surface3 | None, colours: F32, pieces: Sequence[SurfacePiece] = ()) -> None:
        """What is drawn in place of what `set_thing` was given while the thing is not bent: fewer triangles."""
        self._resting[thing_id] = self._made(surface, colours, pieces)

    def _made(self, surface: Surface3 | None, colours: F32, pieces: Sequence[SurfacePiece]) -> list[SurfaceBuffers]:
        solids = [self._solids.pictured(piece) for piece in pieces]
        if surface is not None:
            tint = np.column_stack((colours, np.ones(len(colours)))).astype(np.float32)
            solids.insert(0, self._solids.plain(surface, tint))
        return solids

    def reshape_thing(self, thing_id: str, parts: Sequence[tuple[F32, F32]]) -> None:
        """New places and normals (n, 3) of a thing's vertices: of its plain surface if it has one, then of each piece."""
        for solid, (positions, normals) in zip(self._things[thing_id], parts, strict=True):
            solid.buffers[0].write(np.hstack((positions, normals, solid.more)).astype(np.float32, copy=False))

    def repaint_thing(self, thing_id: str, picture: U8 | None) -> None:
        """Show a picture (h, w, 3), first row at the top, in place of what a panel's page shows; None: the page again."""
        for solid in (*self._things.get(thing_id, ()), *self._resting.get(thing_id, ())):
            if solid.glows:
                self._solids.repaint(solid, picture)

    def drop_thing(self, thing_id: str) -> None:
        """Forget a thing."""
        for old in (*self._things.pop(thing_id, ()), *self._resting.pop(thing_id, ())):
            self._solids.release(old)

    def drop_figure(self, name: str) -> None:
        """Forget a figure."""
        self._figures.drop(name)

    # -- drawing -------------------------------------------------------------------------------------------------

    def draw(self, frame: Frame) -> None:
        """Draw into the picture."""
        things = [(t, solid) for t in frame.things for solid in self._drawn_of(t)]
        views: list[tuple[Sight, F64, list[FigureView]]] = []
        for sight in frame.sights:
            _, _, width, height = sight.box or self._whole
            clip = sight.camera.projection(width / height) @ sight.camera.view()
            views.append((sight, clip, [f for f in frame.figures if f.in_sight(clip)]))
        self.seen = frozenset(f.name for _, _, seen in views for f in seen)
        # Where the CPU draws fast, figures out of the picture cast the shadows of their limbs only.
        put = {v.name: v for v in (frame.figures if self.fine else [f for _, _, seen in views for f in seen])}
        for view in put.values():
            self._figures.put(view)
        self._shadows(frame, things, put)
        target = self._canvas.target
        target.use()
        target.color_mask = (True, True, True, True)
        target.viewport = self._whole
        behind = _DARK if self._shell else _OPEN
        alone = len(views) == 1 and views[0][0].box is None and all(views[0][0].colours)
        target.clear(*(behind if alone else (0.0, 0.0, 0.0, 1.0)))
        for sight, clip, seen in views:
            target.viewport = sight.box or self._whole
            target.color_mask = (*sight.colours, True)
            if not alone:
                target.clear(*behind, viewport=sight.box or self._whole)
            self._paint(frame, sight, clip, seen, things)
        target.color_mask = (True, True, True, True)
        target.use()  # only now does the mask hold
        self._projectors.join(target, frame.sights)
        target.viewport = self._whole
        self._canvas.resolve()
        self._drawn += 1

    def _drawn_of(self, thing: DrawnThing) -> Sequence[SurfaceBuffers]:
        whole = self._things.get(thing.id, ())
        return whole if thing.bent else self._resting.get(thing.id, whole)

    def _paint(
        self, frame: Frame, sight: Sight, clip: F64, seen: Sequence[FigureView], things: Sequence[tuple[DrawnThing, SurfaceBuffers]]
    ) -> None:
        """One eye's view, into the part of the picture that is set."""
        self.ctx.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        shared: dict[str, object] = {"clip_from_room": as_gl(clip), "eye": tuple(sight.camera.position)}
        shared |= self.shadow.use(1, 2 if self.fine else None)
        if self._mirrors is not None:
            shared |= self._mirrors.use(3)
        self._shell.draw(shared, tables=True)  # first: what is under them is then not lit
        self._figures.draw(seen, shared)
        marked = {o.thing: o.colours for o in frame.outlines}
        self._solids.draw([(as_gl(thing.matrix), solid) for thing, solid in things if thing.id not in marked], 0.35, shared)
        if self._furniture is not None:
            self._solids.draw([(as_gl(np.eye(4)), self._furniture)], 0.12, shared)
        self._shell.draw(shared, tables=False)
        box = sight.box or self._whole
        # A selected thing comes after its lines, and these after all they may be seen against.
        for name, colours in marked.items():
            solids = [(as_gl(thing.matrix), solid) for thing, solid in things if thing.id == name]
            self._outlines.draw(solids, colours, shared, box[2:])
        self._solids.draw([(as_gl(thing.matrix), solid) for thing, solid in things if thing.id in marked], 0.35, shared)
        if self._occlusion is not None:
            self._occlusion.darken(self._canvas, sight, clip, box)
        size = sight.unsqueezed(*box[2:])  # so that letters are as wide as they should be where two eyes share a screen
        self._names.draw(frame.labels, sight.camera.position, clip, size, frame.read)
        self._subtitles.draw(frame.captions, size)
        self._gauges.draw(frame.gauges, size)

    def read_into(self, out: U8) -> None:
        """The picture as (height, width, 4) RGBA bytes, first row at the *bottom*."""
        self.surface.finish()
        self._canvas.read_into(out)

    def image(self) -> U8:
        """The picture as (height, width, 3) RGB, first row at the top."""
        out = np.empty((self.size[1], self.size[0], 4), np.uint8)
        self.read_into(out)
        return np.ascontiguousarray(out[::-1, :, :3])

    def put_picture(self, picture: U8) -> None:
        """A finished picture of its size (h, w, 3), first row at the top, in place of a drawn one."""
        self._canvas.write(picture)

    def put_back(self, picture: U8) -> None:
        """What `read_into` gave, smoothed, in place of what was drawn."""
        self._canvas.colour.write(picture)

    def show(self, over: Callable[[], None] | None = None) -> bool:
        """Put the picture on the surface's windows, and what `over` draws into the first one; False when it was closed."""
        window = self.surface.window
        return window is None or window.show(self.ctx, self._canvas, over)

    def error(self) -> str:
        """What OpenGL complains about since the last call; "GL_NO_ERROR" when nothing."""
        return self.ctx.error

    # -- parts ---------------------------------------------------------------------------------------------------

    def _shadows(self, frame: Frame, things: Sequence[tuple[DrawnThing, SurfaceBuffers]], put: Mapping[str, FigureView]) -> None:
        # Shadows move slowly: every other frame is enough where the CPU draws.
        if self.saves_shadows and self._drawn % 2 and self._drawn > 1:
            return
        self.shadow.keep([*self._shell.casters, *([self._furniture.shadow] if self._furniture else [])])
        solids = [(thing.matrix, solid.shadow) for thing, solid in things]
        cast = [self._figures.casters(f) if f.name in put else f.limbs for f in frame.figures]
        self.shadow.draw(cast, solids)
