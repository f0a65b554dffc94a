"""What is written on boards reaches pages stroke by stroke, and whole for who comes later; and SVG and PDF files."""

from __future__ import annotations

import json
import re

import pytest

from vistel.messages.boards import stroke_message
from vistel.session.written import WrittenWords, face_rows
from vistel.space.boards.board import board
from vistel.space.boards.stroke import Stroke, packed
from vistel.space.boards.svg import svg
from vistel.space.commands.panel import panel
from vistel.space.room import meeting_room
from vistel.space.things.things import Pages
from vistel.v1.world_pb2 import Stroke as StrokeMessage

RED = 0xC23B32FF


def stroke(number: int, *points: tuple[int, int]) -> Stroke:
    return Stroke(number, "board", "ann", f"s{number}", RED, 12, packed(points))


def told(words: WrittenWords, *strokes: Stroke) -> dict[str, dict[str, object]]:
    messages: dict[int, StrokeMessage] = {s.number: stroke_message(s) for s in strokes}
    return {kind: json.loads(text) for kind, text in words.words(messages)}


def test_a_page_is_told_all_once_and_then_each_change() -> None:
    words, one, two = WrittenWords(), stroke(1, (5, 5)), stroke(2, (7, 7))
    assert [s["number"] for s in told(words, one)["ink"]["strokes"]] == [1]  # type: ignore[index,union-attr]
    assert told(words, one) == {}
    (kind,) = new = told(words, one, two)
    assert kind == "ink 2" and not new[kind]["whole"]
    grown = one.grown([(9, 9)])
    assert list(told(words, grown, two)) == ["ink 1"]
    assert told(words, two)["ink 1"]["gone"] == [1]
    words.again()
    whole = told(words, two)["ink"]
    assert whole["whole"] and len(whole["strokes"]) == 1  # type: ignore[arg-type]


def test_a_page_learns_where_one_writes_on_a_board_and_reads_on_a_panel_and_on_nothing_else() -> None:
    rows = face_rows(board("b", "b"))
    corner, across, up = rows["face"] or ([], [], [])
    assert rows["front"] == rows["face"]
    assert across == pytest.approx([1.8, 0.0, 0.0]) and up == pytest.approx([0.0, 1.2, 0.0])
    assert corner[0] == pytest.approx(-0.9)
    rows = face_rows(panel("p", "p", 1.5, Pages(("x",), 0, "ann")))
    assert rows["face"] is None and rows["front"] is not None
    corner, across, up = rows["front"]
    assert across == pytest.approx([1.5, 0.0, 0.0]) and up == pytest.approx([0.0, 1.0, 0.0])
    assert corner[:2] == pytest.approx([-0.75, 0.36])
    assert rows["screen"] is None
    assert face_rows(panel("p", "p", 1.5, Pages(("x",), 0, "ann", live=True)))["screen"] == "ann"
    assert all(face_rows(t) == {"face": None, "front": None, "screen": None} for t in meeting_room(3).things)


def test_an_svg_file_has_every_stroke_the_later_over_the_earlier_with_its_top_at_the_top() -> None:
    text = svg([stroke(2, (0, 0), (100, 2400)), stroke(1, (7, 7))])
    colours, lines = zip(*re.findall(r'<polyline stroke="(\S+)" stroke-width="12" points="([^"]+)"/>', text), strict=True)
    assert lines[0] == "7,2393 7,2393"
    assert lines[1].startswith("0,2400 ") and lines[1].endswith(" 100,0")
    assert set(colours) == {"#c23b32"}
    assert text == svg([stroke(1, (7, 7)), stroke(2, (0, 0), (100, 2400))])


def test_a_pdf_has_each_stroke_where_it_is_on_the_board_and_in_its_colour() -> None:
    """Drawn by pdfium: a red stroke across the middle, and a dot over the lower left corner."""
    pdfium = pytest.importorskip("pypdfium2")
    from vistel.space.boards.pdf import pdf

    data = pdf([stroke(2, (0, 1200), (3600, 1200)), stroke(1, (200, 200))])
    document = pdfium.PdfDocument(data)
    assert len(document) == 1
    page = document[0]
    wide, high = page.get_size()
    assert (wide, high) == pytest.approx((1800 / 25.4 * 72, 1200 / 25.4 * 72), abs=0.1), "as large as the board"
    kinds = [found.type for found in page.get_objects()]
    assert kinds == [pdfium.raw.FPDF_PAGEOBJ_PATH] * 3, "lines, no pictures"
    picture = page.render(scale=1800 / wide).to_pil().convert("RGB")  # a pixel a millimetre
    red = (0xC2, 0x3B, 0x32)
    assert [picture.getpixel((x, 600)) for x in (5, 900, 1795)] == [red] * 3
    assert picture.getpixel((100, 1100)) == red
    ground = picture.getpixel((900, 300))
    assert ground == picture.getpixel((300, 1100)) != red
    assert picture.getpixel((900, 596)) == ground, "6 mm wide"
