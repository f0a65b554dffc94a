"""A page as everybody draws it: a picture on both sides of a sheet. It travels as a PNG; whoever has it makes the same polymesh."""

import io
from collections.abc import Generator
from contextlib import contextmanager

import numpy as np
from PIL import Image

from vistel.arrays import U8
from vistel.figure.making.source import Finish, SourceMaterial
from vistel.space.commands.panel import ASIDE
from vistel.space.files.model import Polymesh

MOST_SIDE = 1600
"""Width and height of a page, at most [pixels]."""
MOST_BYTES = 3 << 20
"""Of a page as it travels."""
_MATTE = Finish(0.9, 0.0)
_FRONT = ((-0.5, -0.5, ASIDE), (0.5, -0.5, ASIDE), (0.5, 0.5, ASIDE), (-0.5, 0.5, ASIDE))
_BACK = ((0.5, -0.5, -ASIDE), (-0.5, -0.5, -ASIDE), (-0.5, 0.5, -ASIDE), (0.5, 0.5, -ASIDE))


class PageError(ValueError):
    """What is no page; the text is one line for the person who shows it."""


def sheet_of(picture: U8) -> Polymesh:
    """The polymesh that shows a picture (H, W, 3), first row at the top: a square of one metre that faces +Z, upright, and the
    same from behind; a panel's look makes it as wide as its board."""
    corners = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    return Polymesh(
        np.array(_FRONT + _BACK, np.float32),
        np.concatenate((corners, corners + 4)),
        uv,
        np.concatenate((corners, corners)),
        np.zeros(4, np.int32),
        (SourceMaterial("page", None, np.ascontiguousarray(picture), _MATTE),),
    )


def packed_page(image: Image.Image) -> tuple[bytes, U8]:
    """A picture as it travels, and as everybody will see it, (H, W, 3): made smaller until it is within `MOST_SIDE` and
    `MOST_BYTES`, on white where it is transparent."""
    if image.has_transparency_data:
        clear = image.convert("RGBA")
        image = Image.new("RGBA", clear.size, "white")
        image.alpha_composite(clear)
    image = image.convert("RGB")
    image.thumbnail((MOST_SIDE, MOST_SIDE), Image.Resampling.LANCZOS)
    while True:
        out = io.BytesIO()
        image.save(out, "PNG", compress_level=6)
        if out.tell() <= MOST_BYTES:
            return out.getvalue(), np.asarray(image, np.uint8)
        image = image.resize((image.width * 4 // 5, image.height * 4 // 5), Image.Resampling.LANCZOS)


def unpacked_page(data: bytes) -> U8:
    """The picture (H, W, 3) of a page that somebody sent; its size is known before it is decoded. Raises PageError."""
    if len(data) > MOST_BYTES:
        raise PageError(f"a page of {len(data) / 1e6:.1f} MB; expected at most {MOST_BYTES / 1e6:.1f} MB")
    with picture_in(data, "PNG") as image:
        if image.mode != "RGB":
            raise PageError(f"a page of the mode {image.mode}; expected RGB")
        return np.asarray(image, np.uint8)


@contextmanager
def picture_in(data: bytes, *formats: str) -> Generator[Image.Image]:
    """A picture that somebody sent, of at most `MOST_SIDE` each way; its size is known before it is decoded, in the block. Raises
    PageError, also for what cannot be decoded there."""
    try:
        with Image.open(io.BytesIO(data), formats=formats) as image:
            if max(image.size) > MOST_SIDE:
                raise PageError(f"a picture of {image.width} x {image.height}; expected {MOST_SIDE} pixels at most")
            yield image
    except PageError:
        raise
    except (OSError, SyntaxError, EOFError, ValueError, Image.DecompressionBombError) as fault:
        raise PageError(f"no picture that can be read; expected {' or '.join(formats)}") from fault
