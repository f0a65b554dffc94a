"""Draws registration.png: a picture put on one island of a person's texture, then moved, turned and scaled.

    python -m docs.pictures.people.registration [--out FILE]

Needs an OpenGL context (EGL without a display; software is fine).
"""

import argparse
import math
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from vistel.figure.avatar.avatar import Avatar, Registration
from vistel.figure.avatar.texture import islands, registered, with_picture
from vistel.figure.figure import Figure
from vistel.figure.making.uv_sheet import uv_sheet
from vistel.figure.people.builtin import builtin_avatar
from vistel.figure.posture.posture import standing
from vistel.render.figures.portrait import Portraits

CELL = (260, 330)
TURN, SCALE, SHIFT = 10.0, 0.72, (16, 10)
"""How askew the photograph is: degrees counter-clockwise, size, and texels right and down."""


def photograph(avatar: Avatar, box: tuple[float, float, float, float]) -> np.ndarray:
    """What the texture has in a box of coordinates, as a photograph might show it: turned, smaller, off the middle."""
    high, wide = avatar.albedo.shape[:2]
    u0, v0, u1, v1 = box
    part = Image.fromarray(avatar.albedo).crop((round(u0 * wide), round((1 - v1) * high), round(u1 * wide), round((1 - v0) * high)))
    middle = (0.5 * part.width, 0.5 * part.height)
    c, s = math.cos(math.radians(TURN)) / SCALE, math.sin(math.radians(TURN)) / SCALE
    x, y = middle[0] + SHIFT[0], middle[1] + SHIFT[1]
    # Where each texel of the photograph comes from.
    matrix = (c, -s, middle[0] - c * x + s * y, s, c, middle[1] - s * x - c * y)
    fill = tuple(int(n) for n in np.median(np.asarray(part).reshape(-1, 3), axis=0))
    return np.asarray(part.transform(part.size, Image.Transform.AFFINE, matrix, Image.Resampling.BICUBIC, fillcolor=fill))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "registration.png")
    arguments = parser.parse_args()
    eva = builtin_avatar("builtin:person=carla", name="eva", height=1.75)
    face = max((i for i in islands(eva) if i.part == "face"), key=lambda i: i.area)
    photo = photograph(eva, face.box)
    put = with_picture(eva, face.number, photo)
    high, wide = put.albedo.shape[:2]
    move = (-SHIFT[0] / wide, SHIFT[1] / high)
    turn = math.radians(-TURN)
    n = face.number
    views: list[tuple[str, Avatar]] = [
        ("a photograph on the face", put),
        (f"--move {move[0]:.3f},{move[1]:.3f}", registered(put, Registration(n, move))),
        (f"--turn {-TURN:g}", registered(put, Registration(n, move, turn))),
        (f"--scale {1.0 / SCALE:.2f}", registered(put, Registration(n, move, turn, 1.0 / SCALE))),
    ]
    out = Image.new("RGB", (CELL[0] * (len(views) + 2), CELL[1] + 20), "white")
    ink = ImageDraw.Draw(out)
    flat = ((f"islands; the face is {n}", uv_sheet(eva)), ("the photograph", Image.fromarray(photo)))
    for k, (label, picture) in enumerate(flat):
        picture.thumbnail((CELL[0] - 8, CELL[1]))
        ink.text((k * CELL[0] + 6, 4), label, fill=(40, 44, 50))
        out.paste(picture, (k * CELL[0], 20 + (CELL[1] - picture.height) // 2))
    portraits = Portraits()
    for k, (label, avatar) in enumerate(views, 2):
        ink.text((k * CELL[0] + 6, 4), label, fill=(40, 44, 50))
        seen = portraits.picture(Figure(avatar), standing(), (0.22, 1.64, 0.72), (0.0, 1.62, 0.0), CELL, 0.46)
        out.paste(seen, (k * CELL[0], 20))
    portraits.close()
    out.save(arguments.out, optimize=True)


if __name__ == "__main__":
    main()
