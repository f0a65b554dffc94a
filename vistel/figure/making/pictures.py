"""Pictures of textures: read, and kept to a sensible size."""

import io
import threading
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image

from vistel.arrays import U8
from vistel.figure.making.source import MakingError

LARGEST = 2048
"""Texels along a side of one picture at most."""
MOST_TEXELS = 16384 * 16384
"""Of a picture that is read at all."""
_STRIP = 256
_LIMIT = threading.Lock()


def read_picture(path: Path, notes: list[str]) -> U8 | None:
    """(H, W, 3) sRGB of a picture file; None and a note where it is missing or no picture."""
    try:
        data = path.read_bytes()
    except OSError:
        data = None
    return decoded(data, notes, f"texture {path.name}")


def decoded(data: bytes | None, notes: list[str], name: str) -> U8 | None:
    """`decode`, or None and a note where there is nothing or no picture."""
    if data is None:
        notes.append(f"{name} is not there; a plain colour instead (put it beside the mesh, or --texture FILE)")
        return None
    try:
        return decode(data, notes=notes, name=name)
    except MakingError as fault:
        notes.append(f"{name}: {fault}; a plain colour instead")
        return None


def alpha_of(data: bytes, largest: int = LARGEST) -> U8 | None:
    """(H, W) opacity of an encoded picture, in the size that `decode` gives; None where it has none or cannot be read, which
    `decode` reports."""
    try:
        with _opened(data) as picture:
            if not _transparent(picture) or picture.width * picture.height > MOST_TEXELS:
                return None
            return np.asarray(_reduced(picture, largest, "L"), np.uint8)
    except Exception:  # decoders of damaged pictures raise nearly anything
        return None


def decode(data: bytes, largest: int = LARGEST, *, notes: list[str] | None = None, name: str = "picture") -> U8:
    """(H, W, 3) sRGB of an encoded picture, at most `largest` texels along a side: a larger one is made smaller, which `notes`
    tell by its `name`. Raises MakingError."""
    try:
        with _opened(data) as picture:
            width, height = picture.size
            if width * height > MOST_TEXELS:
                raise MakingError(f"{width} by {height}, expected at most {MOST_TEXELS:,} texels; make it smaller")
            if max(width, height) > 2 * largest:
                picture.draft("RGB", (2 * largest, 2 * largest))  # what can be read coarsely need not be read finely first
            out = _reduced(picture, largest, "RGB")
    except MakingError:
        raise
    except MemoryError as fault:
        raise MakingError("too large for this machine's memory; make it smaller") from fault
    except Exception as fault:  # decoders of damaged pictures raise nearly anything
        raise MakingError(f"not a picture that can be read ({fault})") from fault
    if notes is not None and out.size != (width, height):
        notes.append(f"{name}: {width} by {height}, made {out.width} by {out.height}")
    return np.asarray(out, np.uint8)


def _opened(data: bytes) -> Image.Image:
    """The picture, not read yet. Pillow's own limit is below what we take: ours stands in for it meanwhile."""
    with _LIMIT:
        before, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            return Image.open(io.BytesIO(data))
        finally:
            Image.MAX_IMAGE_PIXELS = before


def _reduced(picture: Image.Image, largest: int, mode: Literal["RGB", "L"]) -> Image.Image:
    """Its colours ("RGB") or its opacity ("L"), at most `largest` texels along a side; by strips and with texels put together
    where it is more than twice as large as needed: so a huge one is in memory only once, and as it was stored."""
    picture.load()
    width, height = picture.size
    step = max(1, max(width, height) // (2 * largest))
    out = Image.new(mode, (-(-width // step), -(-height // step)))
    for top in range(0, height, step * _STRIP):
        strip = picture.crop((0, top, width, min(height, top + step * _STRIP)))
        strip = _rgb(strip) if mode == "RGB" else strip.convert("RGBA").getchannel("A")
        out.paste(strip if step == 1 else strip.reduce(step), (0, top // step))
    out.thumbnail((largest, largest), Image.Resampling.LANCZOS)
    return out


def _transparent(picture: Image.Image) -> bool:
    """Whether it says how opaque it is."""
    return picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info


def _rgb(picture: Image.Image) -> Image.Image:
    """In RGB with eight bits. What is transparent shows nothing: the colour there only bleeds in at edges."""
    if _transparent(picture):
        return picture.convert("RGBA").convert("RGB")
    if picture.mode.startswith("I"):  # sixteen bits of grey, which Pillow would cut off at 255
        return Image.fromarray((np.clip(np.asarray(picture, np.int64), 0, 65535) >> 8).astype(np.uint8)).convert("RGB")
    if picture.mode == "F":
        values = np.clip(np.nan_to_num(np.asarray(picture)), 0.0, 1.0)
        return Image.fromarray(np.round(255.0 * values).astype(np.uint8)).convert("RGB")
    return picture.convert("RGB")
