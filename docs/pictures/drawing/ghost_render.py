"""Pictures of several bodies under ghosts: in space by `implicit_render`, and cut by the plane z = 0."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from PIL import Image

import vistel.implicit as vi
from docs.pictures.drawing.implicit_render import render

RED, BLUE, GREEN, GOLD = (0.80, 0.36, 0.30), (0.33, 0.50, 0.76), (0.42, 0.66, 0.42), (0.86, 0.68, 0.34)
GREY, SKIN = (0.66, 0.66, 0.68), (0.93, 0.74, 0.62)
UPRIGHT = (0.7071067811865476, 0.0, 0.0, 0.7071067811865476)
"""Turns +Y up (the room's) into +Z up (the camera's)."""


def picture(shapes: Iterable[vi.Shape], size: tuple[int, int], *, up: str = "z", **camera: Any) -> Image.Image:
    """The surfaces of several bodies at once; camera: as for `render`."""
    bodies = vi.union(*shapes)
    return render(bodies if up == "z" else bodies.moved(rotation=UPRIGHT), size, **camera)


def section(
    shapes: Mapping[str, vi.Shape],
    half: float,
    size: tuple[int, int],
    *,
    centre: Sequence[float] = (0.0, 0.0),
    levels: Sequence[str] = (),
) -> Image.Image:
    """Bodies cut by z = 0, each filled with its colour, `half` metres from the middle to the sides of the picture.

    levels: bodies of which to show also where the realm ends and the surface at T = 0.75, dashed.
    """
    smooth = 3
    columns, rows = size[0] * smooth, size[1] * smooth
    x = np.linspace(-half, half, columns) + centre[0]
    y = np.linspace(-half, half, rows) * size[1] / size[0] + centre[1]
    rgb = np.ones((rows, columns, 3))
    dash = (np.add.outer(np.arange(rows), np.arange(columns)) // (6 * smooth)) % 2 == 0
    for name, shape in shapes.items():
        found = vi.compile(shape).lattice(x, y, [0.0], attributes=True)
        field = found.field[:, :, 0].T[::-1].astype(float)
        ink = np.array((0.6, 0.6, 0.6))
        inside = field >= vi.THRESHOLD
        if "colour" in found.attributes and inside.any():
            colour = found.attributes["colour"][:, :, 0].transpose(1, 0, 2)[::-1].astype(float)
            rgb[inside] = 0.35 * colour[inside] + 0.65
            ink = np.median(colour[inside], axis=0)
        rgb[outline(inside, smooth)] = 0.8 * ink
        for level in (0.004, 0.75) if name in levels else ():
            rgb[dash & outline(field >= level, smooth - 1)] = 0.45
    image = Image.fromarray((rgb * 255).astype(np.uint8))
    return image.resize(size, Image.Resampling.LANCZOS)


def outline(inside: np.ndarray, width: int) -> np.ndarray:
    """The pixels of a region that are within `width` of its edge."""
    core = inside.copy()
    for _ in range(width):
        core[1:-1, 1:-1] &= core[:-2, 1:-1] & core[2:, 1:-1] & core[1:-1, :-2] & core[1:-1, 2:]
    return inside & ~core
