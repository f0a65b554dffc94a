"""Names over heads: small pictures of text."""

from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from vistel.arrays import U8
from vistel.fonts import Font, latin_font

_MAX_CHARACTERS = 28
_Ink = tuple[int, int, int, int]
_TALKING = (140, 245, 165, 255)
_SIGN = (255, 214, 92, 255)


@dataclass(frozen=True)
class Label:
    """A name, marked while they talk, and, when there is something to say, a second line in small ("holds the red baton",
    "no signal")."""

    name: str
    remark: str = ""
    warning: bool = False
    talking: bool = False
    sign: str = ""
    """What they say without words, over the name: that their hand is up, how they react."""
    frame: tuple[int, int, int] | None = None
    """Of the colour of somebody who has selected a thing: then smaller, over the thing."""


def _short(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= _MAX_CHARACTERS else text[: _MAX_CHARACTERS - 1] + "…"


def paint_label(label: Label, line_height: int) -> U8:
    """(h, w, 4) RGBA, first row at the top; the name's line is `line_height` pixels high."""
    line_height = round(0.72 * line_height) if label.frame else line_height
    frame: _Ink | None = (*label.frame, 255) if label.frame else _TALKING if label.talking else None
    ink = _TALKING if label.talking else (255, 255, 255, 255)
    large = latin_font(max(8, round(0.66 * line_height)))
    lines: list[tuple[str, Font, _Ink, int]] = [(label.sign, large, _SIGN, line_height)] if label.sign else []
    lines.append((_short(label.name), large, ink, line_height))
    if label.remark:
        colour = (255, 196, 120, 255) if label.warning else (178, 220, 255, 255)
        small = round(0.78 * line_height)
        lines.append((_short(label.remark), latin_font(max(7, round(0.50 * line_height))), colour, small))
    pad = round(0.40 * line_height)
    width = max(round(font.getlength(text)) for text, font, _, _ in lines) + 2 * pad
    height = sum(h for _, _, _, h in lines) + 2
    image = Image.new("RGBA", (width, height), (12, 16, 20, 0))
    draw = ImageDraw.Draw(image)
    draw.rounded_rectangle(
        (0, 0, width - 1, height - 1),
        radius=round(0.4 * line_height),
        fill=(12, 16, 20, 190 if label.talking else 150),
        outline=frame,
        width=max(1, round(0.07 * line_height)),
    )
    y = 1.0
    for text, font, colour, h in lines:
        draw.text((0.5 * width, y + 0.5 * h), text, font=font, fill=colour, anchor="mm")
        y += h
    return np.asarray(image, np.uint8)
