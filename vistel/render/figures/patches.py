"""Patches of figures on the graphics side (`vistel.figure.avatar.patch`): a program, pictures and triangles for each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl

from vistel.arrays import U8
from vistel.figure.avatar.patch import Patch
from vistel.render.gl.programs import program, put
from vistel.render.light.shadow import Holes
from vistel.render.light.surroundings import SMOOTHEST

_DEFINES = {"finish": "FINISH_MAP", "normal": "NORMAL_MAP", "glow_picture": "GLOW_MAP", "opacity": "HOLES"}
_UNIFORMS = {"finish": "finish", "normal": "tangent_normal", "glow_picture": "glow_picture", "opacity": "opacity"}
_UNITS = {"finish": 5, "normal": 6, "glow_picture": 7, "opacity": 8}
_ALPHA_TO_COVERAGE = 0x809E
"""GL_SAMPLE_ALPHA_TO_COVERAGE."""
_ALPHA_TO_ONE = 0x809F
"""GL_SAMPLE_ALPHA_TO_ONE."""

_OVER = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA, moderngl.ZERO, moderngl.ONE
"""What a film shows is added to the share that it lets through of what is behind; the picture stays opaque."""


@dataclass(frozen=True, eq=False)
class DrawBatch:
    """Triangles of a figure that are drawn by one program; patch: what they are like, None for what the limb decides."""

    vao: moderngl.VertexArray
    patch: Patch | None = None


class Patches:
    """Makes and draws them. light: defines of the shaders; paint: a texture of a picture, first row at the top; sampled: whether
    pixels have several samples."""

    def __init__(
        self, ctx: moderngl.Context, light: tuple[str, ...], paint: Callable[[U8], moderngl.Texture], sampled: bool
    ) -> None:
        self._ctx, self._paint, self._sampled = ctx, paint, sampled
        words = f"SMOOTHEST {SMOOTHEST}", *(("SAMPLED",) if sampled else ())
        self._light = (*(d for d in light if d != "LIGHT_PER_VERTEX"), *words)
        self._by_vertex = (*light, "ROUGH", *words) if "LIGHT_PER_VERTEX" in light else None
        self._programs: dict[tuple[str, ...], moderngl.Program] = {}
        self._textures: dict[int, tuple[U8, moderngl.Texture]] = {}

    def program(self, patch: Patch, more: tuple[str, ...] = (), *, small: bool = False) -> moderngl.Program:
        """The one that draws such patches; more: defines; small: where they are small in the picture."""
        of_light = {"GLOW": any(patch.glow), "STRANDS": patch.strands}
        said = of_light | {"BLEND": patch.blend, "FILM": patch.film, "BOTH_SIDES": patch.both_sides}
        words = (*(_DEFINES[name] for name in patch.pictures), *(word for word, there in said.items() if there))
        shader, light = "patch", self._light
        if small and patch.matt and self._by_vertex is not None:
            shader, light = "figure", self._by_vertex
        key = (*light, *more, *words)
        if key not in self._programs:
            self._programs[key] = program(self._ctx, "figure", shader, key)
        return self._programs[key]

    def share(self, **shared: object) -> None:
        """Set the uniforms that all shaders share."""
        for each in self._programs.values():
            put(each, albedo=0, **{_UNIFORMS[name]: unit for name, unit in _UNITS.items()}, **shared)

    def set(self, **uniforms: object) -> None:
        """Set uniforms of all programs for the figure that is drawn next."""
        for each in self._programs.values():
            put(each, **uniforms)

    def draw(self, parts: Sequence[DrawBatch]) -> None:
        """Those of `parts` that are patches: first what is solid, at last what is half transparent."""
        ctx = self._ctx
        for part in sorted((p for p in parts if p.patch is not None), key=_order):
            patch: Any = part.patch
            put(
                part.vao.program,
                box=scale_of(patch),
                rough=patch.roughness,
                metallic=patch.metallic,
                glow=patch.glow,
                cutoff=patch.cutoff,
            )
            for name, picture in patch.pictures.items():
                self._texture(picture).use(_UNITS[name])
            covers = self._sampled and patch.opacity is not None and not patch.film
            if patch.both_sides:
                ctx.disable(moderngl.CULL_FACE)
            if covers:
                ctx.enable_direct(_ALPHA_TO_COVERAGE)
                ctx.enable_direct(_ALPHA_TO_ONE)
            if patch.film:
                ctx.enable(moderngl.BLEND)
                ctx.blend_func = _OVER  # pyright: ignore[reportAttributeAccessIssue]  of moderngl's two forms its types know one
                ctx.fbo.depth_mask = False  # walls behind it are drawn later
            part.vao.render()
            if patch.film:
                ctx.fbo.depth_mask = True
                ctx.disable(moderngl.BLEND)
            if covers:
                ctx.disable_direct(_ALPHA_TO_COVERAGE)
                ctx.disable_direct(_ALPHA_TO_ONE)
            if patch.both_sides:
                ctx.enable(moderngl.CULL_FACE)

    def holes(self, patch: Patch) -> Holes | None:
        """What of it throws no shadow."""
        if patch.opacity is None:
            return None
        return Holes(self._texture(patch.opacity), _UNITS["opacity"], scale_of(patch), patch.cutoff)

    def _texture(self, picture: U8) -> moderngl.Texture:
        """One for all patches and levels that show the same picture."""
        if id(picture) not in self._textures:
            texture = self._paint(picture)
            texture.repeat_x = texture.repeat_y = False
            self._textures[id(picture)] = picture, texture
        return self._textures[id(picture)][1]

    def forget(self, patches: Sequence[Patch], kept: Sequence[Patch]) -> None:
        """Give back the textures of these that none of `kept` shows."""
        shown = {id(picture) for patch in kept for picture in patch.pictures.values()}
        for picture in (p for patch in patches for p in patch.pictures.values()):
            if id(picture) not in shown and (old := self._textures.pop(id(picture), None)) is not None:
                old[1].release()


def scale_of(patch: Patch) -> tuple[float, float, float, float]:
    """Lowest u and v of a patch on the texture, and one over its width and height there."""
    u, v, right, top = patch.box
    return u, v, 1.0 / (right - u), 1.0 / (top - v)


def _order(part: DrawBatch) -> tuple[bool, bool]:
    return part.patch is not None and part.patch.opacity is not None, part.patch is not None and part.patch.blend
