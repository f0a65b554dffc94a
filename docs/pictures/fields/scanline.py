"""Make the pictures of scanline drawing: python -m docs.pictures.fields.scanline

scanline-table-2.png: the five scenes of docs/performance.md, by scanlines above, ray cast below.
scanline-edit.png: a picture, the same with one sphere moved, and what was drawn again for it.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from docs.pictures.drawing.implicit_render import label

HERE = Path(__file__).parent

import vistel.implicit as vi
from benchmarks.fields.scanline_scenes import CLAY, ScanlineCase, table2
from vistel.implicit.scanline import Scanline, render
from vistel.implicit.scene import Scene, encoded
from vistel.implicit.trace import render as trace

EDGE = 400
SMOOTH = 3


def smoothed(light: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Linear light (SMOOTH h, SMOOTH w, 3) averaged to bytes (h, w, 3)."""
    h, w = light.shape[0] // SMOOTH, light.shape[1] // SMOOTH
    return encoded(np.clip(light, 0, 1).reshape(h, SMOOTH, w, SMOOTH, 3).mean(axis=(1, 3)))


def cropped(picture: NDArray[np.uint8]) -> Image.Image:
    """The middle of a square picture."""
    return Image.fromarray(picture[20:-30, 50:-50])


def beside(rows: list[list[Image.Image]]) -> Image.Image:
    """Pictures of one size in rows."""
    width, height = rows[0][0].size
    sheet = Image.new("RGB", (width * len(rows[0]), height * len(rows)))
    for y, row in enumerate(rows):
        for x, picture in enumerate(row):
            sheet.paste(picture, (x * width, y * height))
    return sheet


def table_2() -> None:
    """The scenes of Table 2's make-up."""
    above: list[Image.Image] = []
    below: list[Image.Image] = []
    for row in table2():
        scene = row.scene
        large = (SMOOTH * EDGE, SMOOTH * EDGE)
        above.append(label(cropped(smoothed(render(scene, large).light)), f"{row.figure}: {_counts(row)}"))
        cast = trace(scene, size=large, depth=0, shadows=False).light
        below.append(label(cropped(smoothed(cast)), "ray cast"))
    beside([above, below]).save(HERE / "scanline-table-2.png", optimize=True)


def _counts(row: ScanlineCase) -> str:
    return " + ".join(str(n) for n in row.counts if n)


def edit() -> None:
    """One of 106 spheres moved."""
    row = table2()[1]
    large = Scene(row.scene.camera, row.scene.shape, lights=row.scene.lights, size=(SMOOTH * EDGE, SMOOTH * EDGE))
    line = Scanline(large)
    before = line.draw()
    place = int(np.argmax([p.centre[0] + p.centre[1] + p.centre[2] for p in row.primitives if isinstance(p, vi.Sphere)]))
    old = row.primitives[place]
    assert isinstance(old, vi.Sphere)
    x, y, z = old.centre
    parts = [vi.Sphere((1.25 * x, 1.25 * y, 1.25 * z), old.radius) if i == place else p for i, p in enumerate(row.primitives)]
    after = line.edit(CLAY.on(vi.total(*parts)))
    surface = line.surface
    assert surface is not None
    drawn = np.repeat(surface.drawn != 0, 16, axis=1)[:, : large.size[0]]
    marked = np.where(drawn[..., None], after.light, 0.25 * after.light)
    pictures = [(before, "before"), (after, "after"), (None, f"drawn again: {after.redrawn:.0%}")]
    shown = [label(cropped(smoothed(p.light if p else marked)), text) for p, text in pictures]
    beside([shown]).save(HERE / "scanline-edit.png", optimize=True)


if __name__ == "__main__":
    table_2()
    edit()
