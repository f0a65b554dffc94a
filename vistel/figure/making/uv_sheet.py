"""A picture of an avatar's texture with the islands of its coordinates drawn over it, numbered."""

import colorsys

import numpy as np
from PIL import Image, ImageDraw

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.avatar.texture import island_of, islands

_NUMBERED = 40


def uv_sheet(avatar: Avatar, size: int = 1024) -> Image.Image:
    """`size` texels along the longer side; each island's triangles in a colour of its own, the largest with numbers."""
    picture = Image.fromarray(avatar.albedo)
    scale = size / max(picture.size)
    picture = picture.resize((max(1, round(picture.width * scale)), max(1, round(picture.height * scale))))
    extent = np.array(picture.size, np.float64) - 1.0
    ink = ImageDraw.Draw(picture, "RGBA")
    of = island_of(avatar)
    for k, mesh in enumerate((avatar.mesh, *avatar.eyeballs)):
        at = np.column_stack([mesh.uv[:, 0], 1.0 - mesh.uv[:, 1]]) * extent
        for triangle in mesh.corner_triangles:
            corner = [(float(x), float(y)) for x, y in at[triangle]]
            ink.line([*corner, corner[0]], fill=(*_colour(int(of[k][triangle[0]])), 110))
    for island in islands(avatar)[:_NUMBERED]:
        u0, v0, u1, v1 = island.box
        x, y = 0.5 * (u0 + u1) * extent[0], (1.0 - 0.5 * (v0 + v1)) * extent[1]
        ink.text((x, y), str(island.number), anchor="mm", fill="white", stroke_width=3, stroke_fill="black", font_size=20)
    return picture


def _colour(number: int) -> tuple[int, int, int]:
    r, g, b = colorsys.hsv_to_rgb((0.61803 * number) % 1.0, 0.85, 1.0)
    return round(255 * r), round(255 * g), round(255 * b)
