"""A small ray caster for the pictures of docs/explanation/implicit.md: one orthographic camera, two lights.

Rays step through the shape's bounds and the crossing of the threshold is refined on its FieldProgram, so that creases
and thin parts come out as they are. Costly shapes (polyblobs of many triangles) are stepped through on a lattice.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import vistel.implicit as vi
from vistel.arrays import F64

PICTURES = Path(__file__).parents[1]
SKY = np.array((1.0, 1.0, 1.0))
CLAY = (0.78, 0.56, 0.44)


def directions(azimuth: float, height: float) -> tuple[F64, F64, F64]:
    """Right, up and away unit vectors of a camera that looks at the origin from an azimuth and height [degrees]."""
    a, h = np.radians((azimuth, height))
    away = -np.array((np.cos(h) * np.cos(a), np.cos(h) * np.sin(a), np.sin(h)))
    right = np.cross(away, (0, 0, 1))
    right /= np.linalg.norm(right)
    return right, np.cross(right, away), away


def render(
    shape: vi.Shape,
    size: tuple[int, int] = (420, 360),
    *,
    centre: Sequence[float] = (0, 0, 0),
    width: float = 3.0,
    threshold: float = 0.5,
    azimuth: float = -60.0,
    height: float = 25.0,
    smooth: int = 2,
    lattice: int = 0,
) -> Image.Image:
    """A picture of the surface F = threshold, `width` metres across, with the shape's `colour` where it has one.

    smooth: pixels along a side that are averaged into one; lattice: points along a side of the lattice to step
    through, 0 for the field itself.
    """
    program = vi.compile(shape)
    columns, rows = size[0] * smooth, size[1] * smooth
    right, up, away = directions(azimuth, height)
    pixel = width / columns
    u = (np.arange(columns) - columns / 2 + 0.5) * pixel
    v = (rows / 2 - np.arange(rows) - 0.5) * pixel
    look = on_lattice(program, lattice) if lattice else program.field
    start = np.asarray(centre, float) + u[None, :, None] * right + v[:, None, None] * up
    low, high = program.bounds
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    depth = (corners - np.asarray(centre, float)) @ away
    near, far = depth.min(), depth.max()
    step = float((high - low).min()) / lattice if lattice else max(pixel * 1.5, (far - near) / 400)
    flat = start.reshape(-1, 3)
    hit = np.full(len(flat), np.nan)
    alive = np.arange(len(flat))
    for t in np.arange(near, far + step, step):
        if not len(alive):
            break
        inside = look(flat[alive] + t * away) >= threshold
        hit[alive[inside]] = t
        alive = alive[~inside]
    seen = np.flatnonzero(~np.isnan(hit))
    before, after = hit[seen] - step, hit[seen].copy()
    for _ in range(14):
        middle = 0.5 * (before + after)
        inside = program.field(flat[seen] + middle[:, None] * away) >= threshold
        after, before = np.where(inside, middle, after), np.where(inside, before, middle)
    points = flat[seen] + after[:, None] * away
    found = program.evaluate(points, gradient=True, attributes=True)
    normal = -np.asarray(found.gradient, float)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    colour = np.asarray(found.attributes["colour"], float) if "colour" in found.attributes else np.array(CLAY)
    key = -away + 0.6 * up - 0.7 * right
    key /= np.linalg.norm(key)
    fill = -away * 0.3 + right + 0.2 * up
    fill /= np.linalg.norm(fill)
    diffuse = 0.72 * np.clip(normal @ key, 0, 1) + 0.22 * np.clip(normal @ fill, 0, 1) + 0.16
    halfway = key - away
    halfway /= np.linalg.norm(halfway)
    shine = 0.25 * np.clip(normal @ halfway, 0, 1) ** 40
    image = np.tile(SKY, (len(flat), 1))
    image[seen] = np.clip(colour * diffuse[:, None] + shine[:, None], 0, 1) ** 0.85
    picture = Image.fromarray((image.reshape(rows, columns, 3) * 255).astype(np.uint8))
    return picture.resize(size, Image.Resampling.LANCZOS)


def on_lattice(program: vi.FieldProgram, n: int) -> Callable[[F64], F64]:
    """The field between the points of an n^3 lattice over the program's bounds, linear in each coordinate."""
    low, high = program.bounds
    values = program.grid(low, high, n)

    def look(points: F64) -> F64:
        found = np.full(len(points), program.far)
        near = np.flatnonzero(((points > low) & (points < high)).all(axis=1))
        place = (points[near] - low) / (high - low) * (n - 1)
        x, y, z = np.minimum(place.astype(int), n - 2).T
        u, v, w = (place - np.stack([x, y, z], axis=1)).T
        lines = [values[x + i, y + j, z] * (1 - w) + values[x + i, y + j, z + 1] * w for i in (0, 1) for j in (0, 1)]
        found[near] = (lines[0] * (1 - v) + lines[1] * v) * (1 - u) + (lines[2] * (1 - v) + lines[3] * v) * u
        return found

    return look


def font(size: int = 17) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """The labels' typeface."""
    return ImageFont.load_default(size)


def label(picture: Image.Image, text: str) -> Image.Image:
    """The picture with a line of text below it."""
    out = Image.new("RGB", (picture.width, picture.height + 30), "white")
    out.paste(picture, (0, 0))
    ImageDraw.Draw(out).text((picture.width / 2, picture.height + 4), text, "#222222", font(), anchor="ma")
    return out


def sheet(pictures: Sequence[Image.Image], columns: int, name: str) -> None:
    """Pictures of one size side by side, saved as a PNG beside this script."""
    wide, high = pictures[0].size
    lines = -(-len(pictures) // columns)
    out = Image.new("RGB", (columns * wide, lines * high), "white")
    for i, picture in enumerate(pictures):
        out.paste(picture, (i % columns * wide, i // columns * high))
    out.save(PICTURES / f"{name}.png", optimize=True)
    print(f"{name}.png")
