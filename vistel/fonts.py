"""Fonts for text that is drawn into pictures: DejaVu Sans, and beside it one of the Japanese fonts that systems have."""

import logging
from functools import cache, lru_cache

from PIL import ImageFont

log = logging.getLogger("vistel.renderer")

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont

JAPANESE = (
    "NotoSansCJK-Regular.ttc",
    "NotoSansCJKjp-Regular.otf",
    "ipagp.ttf",
    "ipag.ttf",
    "ipaexg.ttf",
    "TakaoPGothic.ttf",
    "VL-PGothic-Regular.ttf",
    "DroidSansFallbackFull.ttf",
    "Hiragino Sans GB.ttc",
    "YuGothM.ttc",
    "msgothic.ttc",
)
"""Files of fonts with Japanese letters, the best first."""


@lru_cache(maxsize=16)
def latin_font(size: int) -> Font:
    """DejaVu Sans where the system has it (it knows more scripts), else the font that comes with Pillow. size: [pixels]."""
    try:
        return ImageFont.truetype("DejaVuSans.ttf", size)
    except OSError:
        return ImageFont.load_default(size)


@lru_cache
def japanese_font(size: int) -> ImageFont.FreeTypeFont | None:
    """The first of `JAPANESE` that the system has; None: it has none. size: [pixels]."""
    name = _japanese_file()
    return ImageFont.truetype(name, size) if name else None


@cache
def _japanese_file() -> str | None:
    for name in JAPANESE:
        try:
            ImageFont.truetype(name, 12)
        except OSError:
            continue
        return name
    log.warning("event=no_japanese_font shown=romaji reason='install one, such as fonts-ipafont-gothic'")
    return None


def runs(text: str, size: int) -> list[tuple[str, Font]]:
    """Pieces of a text, each with a font that has its letters. size: [pixels]."""
    japanese = japanese_font(size) if any(is_japanese(c) for c in text) else None
    out: list[tuple[str, Font]] = []
    for c in text:
        font = japanese if japanese is not None and is_japanese(c) else latin_font(size)
        if out and out[-1][1] is font:
            out[-1] = out[-1][0] + c, font
        else:
            out.append((c, font))
    return out


def is_japanese(letter: str) -> bool:
    """Whether it is drawn with a Japanese font."""
    return "\u3000" <= letter <= "\uffef"


def length(text: str, size: int) -> float:
    """Width of a text in one line [pixels]. size: of the font [pixels]."""
    return sum(font.getlength(part) for part, font in runs(text, size))
