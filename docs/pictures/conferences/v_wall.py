"""Draws v-wall.png: a wall of two screens in a V. Above, what is sent to each screen, for one eye; below, the wall
as that eye sees it, both screens where they stand, and the same room without any screen.

    python -m docs.pictures.conferences.v_wall

Needs an OpenGL context (EGL without a display; software is fine).
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from docs.pictures.conferences.scenes import photograph
from docs.pictures.conferences.wall import Stereo, before_the_wall, eyes_of, seen_from, shown, straight_ahead
from docs.pictures.drawing.implicit_render import font

OUT = Path(__file__).parent / "v-wall.png"
SIZE, GAP = (600, 338), 8
PAPER, INK = (250, 250, 248), (40, 44, 50)
FINER = 2


def label(image: Image.Image, text: str) -> Image.Image:
    out = Image.new("RGB", (image.width, image.height + 22), PAPER)
    out.paste(image, (0, 22))
    ImageDraw.Draw(out).text((2, 2), text, font=font(13), fill=INK)
    return out


def fine(picture: np.ndarray, size: tuple[int, int]) -> Image.Image:
    return Image.fromarray(picture).resize(size, Image.Resampling.LANCZOS)


def main() -> None:
    moment = before_the_wall(Stereo.MONO)
    view = moment.view
    moment = replace(moment, view=replace(view, screens=tuple(s.scaled(FINER) for s in view.screens)))
    packed, eye = shown(moment, "fine"), eyes_of(moment).mean(axis=0)
    wide = FINER * SIZE[0], FINER * SIZE[1]
    straight = straight_ahead(eye, moment.view.screens, *wide)
    direct = photograph(replace(moment, view=replace(view, screens=(straight,))), *wide)
    left = label(fine(seen_from(eye, 0, moment, packed, *wide), SIZE), "the wall from the eye it was drawn for")
    right = label(fine(direct, SIZE), "the room itself from that eye")
    width = round(1.25 * SIZE[0])
    top = label(fine(packed, (width, round(width * packed.shape[0] / packed.shape[1]))), "what the two screens show")
    out = Image.new("RGB", (left.width + GAP + right.width, top.height + GAP + left.height), PAPER)
    out.paste(top, ((out.width - top.width) // 2, 0))
    out.paste(left, (0, top.height + GAP))
    out.paste(right, (left.width + GAP, top.height + GAP))
    out.save(OUT, optimize=True)


if __name__ == "__main__":
    main()
