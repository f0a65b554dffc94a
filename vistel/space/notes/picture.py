"""What stands on a note, as a picture: in the largest letters with which all of it fits."""

import re
from functools import lru_cache

import numpy as np
from PIL import Image, ImageDraw

from vistel.arrays import U8
from vistel.fonts import is_japanese, length, runs

SIDE = 512
"""Width and height of the picture [pixels]."""
_EDGE = 36
"""Beside the text, at least [pixels]."""
_SIZES = (128, 104, 88, 74, 62, 52, 44, 38, 32, 27, 23)
"""Of letters [pixels]."""
_LINE = 1.25
"""From one line to the next, in sizes of the letters."""
_INK = (34, 34, 34)


@lru_cache(maxsize=64)
def picture_of(text: str, paper: tuple[int, int, int]) -> U8:
    """(SIDE, SIDE, 3) sRGB, first row at the top. paper: its colour."""
    image = Image.new("RGB", (SIDE, SIDE), paper)
    draw = ImageDraw.Draw(image)
    room = SIDE - 2 * _EDGE
    fits = (size for size in _SIZES if _LINE * size * len(lines_of(text, size, room)) <= room)
    size = next(fits, _SIZES[-1])
    lines = lines_of(text, size, room)
    top = 0.5 * (SIDE - _LINE * size * len(lines))
    for n, line in enumerate(lines):
        x = 0.5 * (SIDE - length(line, size))
        for part, font in runs(line, size):
            draw.text((x, top + (n + 0.5) * _LINE * size), part, font=font, fill=_INK, anchor="lm")
            x += font.getlength(part)
    return np.asarray(image, np.uint8)


def lines_of(text: str, size: int, room: float) -> list[str]:
    """The text in lines of `room` pixels at most: broken between words, beside Japanese letters, and within a word that is longer
    than a line. size: of its letters [pixels]."""
    lines = [""]
    for word in _words(text):
        if length(lines[-1] + word.rstrip(), size) <= room:
            lines[-1] += word
            continue
        lines.append("")
        for letter in word:
            if lines[-1] and length(lines[-1] + letter.rstrip(), size) > room:
                lines.append("")
            lines[-1] += letter
    return [line.strip() for line in lines if line.strip()]


def _words(text: str) -> list[str]:
    """The text in pieces between which a line may end, each with the space after it."""
    out: list[str] = []
    for piece in re.findall(r"\S+\s*", text):
        begin = 0
        for n, letter in enumerate(piece):
            if n and (is_japanese(letter) or is_japanese(piece[n - 1])) and not letter.isspace():
                out.append(piece[begin:n])
                begin = n
        out.append(piece[begin:])
    return out
