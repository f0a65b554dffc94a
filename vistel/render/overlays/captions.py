"""Pictures of captions: what people said to the room and what it answered."""

import numpy as np
from PIL import Image, ImageDraw

from vistel.arrays import U8
from vistel.fonts import japanese_font, length, runs
from vistel.render.stage.captions import Caption
from vistel.speech.kana import to_romaji

_LONGEST = 64


def paint_caption(caption: Caption, line_height: int) -> U8:
    """(h, w, 4) RGBA, first row at the top; one line of `line_height` pixels, or two with a reply."""
    size = max(9, round(0.62 * line_height))
    speaker = f"{caption.speaker}: " if caption.speaker else ""
    mark = f" {caption.mark}" if caption.text else caption.mark
    said = (speaker, (178, 220, 255)), (_short(caption.text, caption.spoken, size), (255, 255, 255)), (mark, caption.colour)
    rows = [list(said)]
    if caption.reply:
        rows.append([(_short(caption.reply, caption.reply, size), caption.colour)])
    widths = [sum(length(text, size) for text, _ in row) for row in rows]
    pad = round(0.5 * line_height)
    image = Image.new("RGBA", (round(max(widths)) + 2 * pad, line_height * len(rows) + 4), (12, 16, 20, 0))
    draw = ImageDraw.Draw(image)
    draw.rounded_rectangle((0, 0, image.width - 1, image.height - 1), radius=round(0.3 * line_height), fill=(12, 16, 20, 185))
    for n, (row, width) in enumerate(zip(rows, widths, strict=True)):
        x = 0.5 * (image.width - width)
        for text, colour in row:
            for part, font in runs(text, size):
                draw.text((x, 2 + (n + 0.5) * line_height), part, font=font, fill=(*colour, 255), anchor="lm")
                x += font.getlength(part)
    return np.asarray(image, np.uint8)


def _short(text: str, spoken: str, size: int) -> str:
    """What can be drawn here of a text, in one line."""
    if not text.isascii() and any("\u3040" <= c <= "\u9fff" for c in text) and japanese_font(size) is None:
        text = to_romaji(spoken)
    text = " ".join(text.split())
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"
