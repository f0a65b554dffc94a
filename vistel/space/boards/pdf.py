"""A board as a PDF file of one page: each stroke a line with round ends, on a page as large as a board of its first size."""

from collections.abc import Iterable
from importlib import import_module
from io import BytesIO
from typing import Any

from vistel.space.boards.board import WHITE
from vistel.space.boards.stroke import ACROSS, UNIT, UPWARDS, Stroke

_PT = UNIT / 0.0254 * 72.0
"""A unit of the grid in points of the page."""
_ROUND = 1
"""Ends and joins of lines (PDF 32000-1:2008, tables 54 and 55)."""


class MissingError(Exception):
    """What makes a PDF is not installed; the text is one line that says what to install."""


def pdf(strokes: Iterable[Stroke]) -> bytes:
    """The file's bytes; what is drawn later lies over it. Raises MissingError."""
    try:
        pdfium: Any = import_module("pypdfium2")  # only who saves a PDF needs it
    except ImportError as missing:
        raise MissingError("a PDF needs pypdfium2: pip install pypdfium2, or save the board as an SVG file") from missing
    raw, document = pdfium.raw, pdfium.PdfDocument.new()
    page = document.new_page(ACROSS * _PT, UPWARDS * _PT)
    ground = raw.FPDFPageObj_CreateNewRect(0.0, 0.0, ACROSS * _PT, UPWARDS * _PT)
    raw.FPDFPageObj_SetFillColor(ground, *_rgba(WHITE))
    raw.FPDFPath_SetDrawMode(ground, raw.FPDF_FILLMODE_ALTERNATE, False)
    raw.FPDFPage_InsertObject(page, ground)
    for stroke in sorted(strokes, key=lambda s: s.number):
        raw.FPDFPage_InsertObject(page, _line(raw, stroke))
    raw.FPDFPage_GenerateContent(page)
    out = BytesIO()
    document.save(out)
    document.close()
    return out.getvalue()


def _line(raw: Any, stroke: Stroke) -> Any:
    """A path through the stroke's points."""
    (x, y), *others = stroke.points.tolist()
    path = raw.FPDFPageObj_CreateNewPath(x * _PT, y * _PT)
    for to_x, to_y in others or [(x, y)]:  # a dot has a line of no length
        raw.FPDFPath_LineTo(path, to_x * _PT, to_y * _PT)
    raw.FPDFPageObj_SetStrokeColor(path, *_rgba(stroke.colour))
    raw.FPDFPageObj_SetStrokeWidth(path, stroke.width * _PT)
    raw.FPDFPageObj_SetLineCap(path, _ROUND)
    raw.FPDFPageObj_SetLineJoin(path, _ROUND)
    raw.FPDFPath_SetDrawMode(path, raw.FPDF_FILLMODE_NONE, True)
    return path


def _rgba(colour: int) -> tuple[int, ...]:
    """Red, green, blue and alpha of 0xRRGGBBAA, 0 to 255."""
    return tuple(colour >> shift & 0xFF for shift in (24, 16, 8, 0))
