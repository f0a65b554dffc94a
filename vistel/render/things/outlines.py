"""Lines round things that people have selected, each in the colour of its person."""

import colorsys
import hashlib
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import moderngl

from vistel.render.gl.programs import program, put, vertex_array
from vistel.render.things.solid import SurfaceBuffers

AROUND = tuple((math.cos(k * math.pi / 4), math.sin(k * math.pi / 4)) for k in range(8))
"""Ways in which a silhouette is moved; what then looks out from behind the thing is its line."""
WIDTH = 0.0045
"""Of a line, as a share of the picture's height; of at least two pixels."""
NEARER = 0.03
"""[m]"""

HUES = 9
"""Colours that nobody takes for another."""

Colour = tuple[int, int, int]


@dataclass(frozen=True)
class Outline:
    """colours: sRGB bytes of those who have selected a thing, the innermost line first."""

    thing: str
    colours: tuple[Colour, ...]


def colours_of(people: Iterable[str]) -> dict[str, Colour]:
    """The colour that stands for each of the people in a room, the same at every site: one of their name, or, where somebody
    before them in the alphabet has that one, the next."""
    out: dict[str, Colour] = {}
    taken: set[int] = set()
    for name in sorted(set(people)):
        k = hashlib.sha256(name.encode()).digest()[0] % HUES
        while k in taken and len(taken) < HUES:
            k = (k + 1) % HUES
        taken.add(k)
        r, g, b = colorsys.hls_to_rgb(k / HUES, 0.62, 0.95)
        out[name] = round(255 * r), round(255 * g), round(255 * b)
    return out


class SilhouetteDrawer:
    """Draws silhouettes, moved a little aside each way. The thing itself is drawn over them afterwards."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._program = program(ctx, "outline")

    def draw(
        self,
        solids: Sequence[tuple[bytes, SurfaceBuffers]],
        colours: Sequence[Colour],
        shared: dict[str, object],
        size: tuple[int, int],
    ) -> None:
        """The lines round one thing; solids: with their matrices, as OpenGL reads them; size: of the picture [pixels]."""
        width, height = size
        line = max(2.0, WIDTH * height)
        put(self._program, nearer=NEARER, **shared)
        self._ctx.disable(moderngl.CULL_FACE)
        self._ctx.fbo.depth_mask = False
        for n, colour in reversed(list(enumerate(colours, 1))):
            put(self._program, ink=tuple(c / 255.0 for c in colour))
            for x, y in AROUND:
                put(self._program, aside=(2.0 * n * line * x / width, 2.0 * n * line * y / height))
                for matrix, solid in solids:
                    put(self._program, room_from_thing=matrix)
                    self._silhouette(solid).render()
        self._ctx.fbo.depth_mask = True
        self._ctx.enable(moderngl.CULL_FACE)

    def _silhouette(self, solid: SurfaceBuffers) -> moderngl.VertexArray:
        if solid.silhouette is None:
            vbo, ibo = solid.buffers
            rest = "20x" if solid.picture is not None else "28x"
            solid.silhouette = vertex_array(self._ctx, self._program, [(vbo, f"3f {rest}", "position")], ibo)
        return solid.silhouette
