"""Files that people show, page by page: a PNG or a JPEG is one page, a PDF as many as it has."""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from PIL import Image, ImageOps

from vistel.space.commands.panel import ASPECTS, MOST_PAGES
from vistel.space.pages.sheet import MOST_SIDE, PageError

MOST_FILE_BYTES = 200 << 20
MOST_PIXELS = 80_000_000
"""Of a picture in a file: larger ones are refused before they are decoded."""
KINDS = ".pdf, .png, .jpg"


def pages_of(path: Path) -> Iterator[Image.Image]:
    """Every page of a file, all as wide by their height as the first one; what is longer than a panel may be has bars beside it.
    Raises PageError."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(1024)
    except OSError as fault:
        raise PageError(f"{path}: {fault.strerror or fault}") from fault
    if size > MOST_FILE_BYTES:
        raise PageError(f"{path.name}: {size / 1e6:.0f} MB; expected at most {MOST_FILE_BYTES / 1e6:.0f} MB")
    pages = _of_pdf(path) if b"%PDF-" in head else _of_picture(path)
    first = next(pages)
    canvas = _canvas(first)
    yield _on(first, canvas)
    for page in pages:
        yield _on(page, canvas)


def _of_picture(path: Path) -> Iterator[Image.Image]:
    too_large = PageError(f"{path.name}: too large a picture; expected at most {MOST_PIXELS // 1_000_000} million pixels")
    try:
        with Image.open(path, formats=("PNG", "JPEG")) as image:
            if image.width * image.height > MOST_PIXELS:
                raise too_large
            image.draft("RGB", (MOST_SIDE, MOST_SIDE))
            yield ImageOps.exif_transpose(image)
    except Image.DecompressionBombError as fault:
        raise too_large from fault
    except (OSError, SyntaxError, ValueError) as fault:
        if isinstance(fault, PageError):
            raise
        raise PageError(f"{path.name}: no picture and no PDF that can be read; expected {KINDS}") from fault


def _of_pdf(path: Path) -> Iterator[Image.Image]:
    try:
        pdfium: Any = import_module("pypdfium2")  # only who shows a PDF needs it
    except ModuleNotFoundError as missing:
        raise PageError("a PDF needs pypdfium2: pip install pypdfium2, or show its pages as pictures") from missing
    try:
        document: Any = pdfium.PdfDocument(path)
    except pdfium.PdfiumError as fault:
        raise PageError(f"{path.name}: a PDF that cannot be read ({fault})") from fault
    try:
        if not 0 < len(document) <= MOST_PAGES:
            raise PageError(f"{path.name}: {len(document)} pages; expected 1 to {MOST_PAGES}")
        for number in range(len(document)):
            page = document[number]
            width, height = page.get_size()
            yield page.render(scale=MOST_SIDE / max(width, height, 1.0)).to_pil().convert("RGB")
            page.close()
    except pdfium.PdfiumError as fault:
        raise PageError(f"{path.name}: a page that cannot be drawn ({fault})") from fault
    finally:
        document.close()


def _canvas(first: Image.Image) -> tuple[int, int]:
    """Size of every page [pixels]."""
    width, height = first.size
    low, high = ASPECTS
    width, height = max(width, round(low * height)), max(height, round(width / high))
    shrink = min(1.0, MOST_SIDE / max(width, height))
    return max(1, round(width * shrink)), max(1, round(height * shrink))


def _on(page: Image.Image, canvas: tuple[int, int]) -> Image.Image:
    """A page in the middle of a white canvas, as large as it fits."""
    if page.size == canvas:
        return page
    return ImageOps.pad(page.convert("RGBA"), canvas, Image.Resampling.LANCZOS, color="white")
