"""What a page may ask of a log is bounded, and what it may have as a file, too."""

from __future__ import annotations

import asyncio
import csv
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import vistel.log
from vistel.log import exports
from vistel.log.exports import asked, written
from vistel.log.playhead import NotUnderstoodError
from vistel.log.questions import MOST_NAMES, MOST_WIDE, plot_asked

MEETING = Path(__file__).parents[2] / "replay" / "meeting.mcap"
GOOD = {"id": 1, "names": ["a.b"], "from": 0, "to": 1, "wide": 100}
HAND = "participant.ben.motion.left_hand.x"


def test_a_question_for_a_plot_is_taken_as_it_is_meant() -> None:
    plot = plot_asked(GOOD | {"names": ["a", "b", "a"], "wide": 1e9}, 0.25)
    assert (plot.names, plot.wide, plot.offset) == (("a", "b"), MOST_WIDE, 0.25)


@pytest.mark.parametrize(
    "wrong",
    [
        {"names": []},
        {"names": "a"},
        {"names": ["x"] * (MOST_NAMES + 1)},
        {"names": ["x" * 200]},
        {"names": ["\n"]},
        {"names": [3]},
        {"from": 1, "to": 1},
        {"from": -1},
        {"to": float("inf")},
        {"to": 10**400},
        {"wide": None},
        {"wide": "9"},
        {"id": True},
    ],
)
def test_a_question_that_is_none_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(NotUnderstoodError):
        plot_asked(GOOD | wrong, 0.0)


@given(
    st.none()
    | st.integers()
    | st.text(max_size=5)
    | st.dictionaries(st.sampled_from(list(GOOD)), st.none() | st.floats() | st.text(max_size=3))
)
def test_whatever_is_asked_is_taken_or_refused(said: object) -> None:
    try:
        plot = plot_asked(said, 0.0)
    except NotUnderstoodError:
        return
    assert 0 < len(plot.names) <= MOST_NAMES and 0 < plot.wide <= MOST_WIDE


@pytest.mark.parametrize(
    "wrong", [{"kind": "exe"}, {"kind": ""}, {"from": "x"}, {"to": "nan"}, {"from": "3", "to": "2"}, {"offset": "1e99"}]
)
def test_a_file_that_cannot_be_meant_is_refused(wrong: dict[str, str]) -> None:
    with pytest.raises(NotUnderstoodError):
        asked({"kind": "csv", "from": "1", "to": "2"} | wrong, [HAND], MEETING, None)
    with pytest.raises(NotUnderstoodError):
        asked({"kind": "csv", "from": "1", "to": "2"}, ["x"] * (MOST_NAMES + 1), MEETING, None)


def test_files_hold_the_part_that_was_asked_for_and_what_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    async def get(kind: str, *of: str) -> bytes:
        async with written(asked({"kind": kind, "from": "1", "to": "2"}, of, MEETING, MEETING)) as file:
            return file.read_bytes()

    async def every() -> tuple[bytes, bytes, bytes]:
        return await get("csv", HAND, f"difference.{HAND}"), await get("bvh", "ben"), await get("mcap")

    table, skeleton, piece = asyncio.run(every())
    rows = list(csv.reader(table.decode().splitlines()))
    assert rows[0] == ["t", HAND, f"difference.{HAND}"]
    assert 55 <= len(rows) <= 65 and all(0.9 < float(row[0]) < 2.0 and float(row[2]) == 0.0 for row in rows[1:])
    assert skeleton.startswith(b"HIERARCHY")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(piece)
    with vistel.log.open(cut) as log:
        assert 0.9 < log.duration <= 1.0 and log.participants == ["aiko", "ben"] and not log.damage
    for kind, of in (("wav", ("ben",)), ("bvh", ("nobody",)), ("csv", ("thing.nothing.x",)), ("csv", ())):
        with pytest.raises(ValueError, match=r"^[^\n]+$"):
            asyncio.run(get(kind, *of))


def test_the_name_of_a_file_has_no_letters_that_mean_something() -> None:
    assert exports.Asked("csv", (), exports.Part(Path('/x/a"; b\r\n.mcap'), 0, 1)).name == "a---b--.csv"
