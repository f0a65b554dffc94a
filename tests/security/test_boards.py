"""A board against those who mean ill: what a page sends, and what a site sends in the name of others or without end."""

from __future__ import annotations

import json
import math

import pytest

from vistel.session.page_writing import written_by
from vistel.space.actions import Draw, PutUpBoard, Rub, Undo, Wipe, WriteNote
from vistel.space.arguments import Which
from vistel.space.boards.stroke import MOST_POINTS, unpacked
from vistel.space.notes.note import MOST_TEXT
from vistel.v1.command_pb2 import Command
from vistel.wire.limits import most_bytes
from vistel.wire.topics import BY_NAME

DRAWN = {"draw": [1, 2, 3, 4], "board": "board", "stroke": "s", "colour": "#c23b32"}


def test_what_a_page_asks_for_is_what_is_done() -> None:
    assert written_by(DRAWN) == Draw((1, 2, 3, 4), Which("board"), 0xC23B32FF, None, "s")
    assert written_by({"rub": [1, 2], "board": "board"}) == Rub((1, 2), Which("board"))
    assert written_by({"wipe": "board"}) == Wipe(Which("board"))
    assert written_by({"undo": True}) == Undo()
    assert written_by({"new_board": True}) == PutUpBoard()
    assert written_by({"note": "buy milk"}) == WriteNote("buy milk")


@pytest.mark.parametrize(
    "wrong",
    [
        {"draw": [1, 2, 3]},
        {"draw": []},
        {"draw": [0, 0] * (MOST_POINTS + 1)},
        {"draw": [math.nan, 0]},
        {"draw": [math.inf, 0]},
        {"draw": [1.5, 0]},
        {"draw": [-1, 0]},
        {"draw": [1 << 70, 0]},
        {"draw": [True, 0]},
        {"draw": ["1", "2"]},
        {"draw": {"0": 1}},
        {"draw": "12"},
        {"board": ""},
        {"board": "b" * 41},
        {"board": 7},
        {"stroke": ""},
        {"stroke": "s" * 41},
        {"stroke": None},
        {"colour": "red"},
        {"colour": "#c23b3"},
        {"colour": "#c23b32ff"},
        {"colour": "#c23b32\n"},
        {"colour": 0xC23B32},
    ],
)
def test_words_of_a_page_that_cannot_be_are_no_command(wrong: dict[str, object]) -> None:
    said = json.loads(json.dumps(DRAWN | wrong))  # as they come, NaN included
    assert written_by(said) is None


@pytest.mark.parametrize("note", ["x" * (MOST_TEXT + 1), 7, None, True, ["a"], {"a": 1}])
def test_a_note_that_cannot_be_is_no_command(note: object) -> None:
    assert written_by({"note": note}) is None


def test_a_stroke_of_a_million_points_is_larger_than_any_message_of_a_site() -> None:
    command = Command(id="c", participant="ben")
    command.draw.points.extend([3000, 2000] * 1_000_000)
    assert command.ByteSize() > most_bytes(BY_NAME["command"])


@pytest.mark.parametrize("ink", [b"", b"\x00\x00\x00", b"\x00\x00\x00\x00\x01", b"\xff\xff\x00\x00", b"\x00\x00\x00\x00\xff\x00"])
def test_ink_that_is_none_is_refused_wherever_it_is_read(ink: bytes) -> None:
    with pytest.raises(ValueError, match="ink of a stroke"):
        unpacked(ink)
