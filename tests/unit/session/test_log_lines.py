"""The newest log lines of a run, filtered."""

from __future__ import annotations

from pathlib import Path

from vistel.session.log_files import MOST_BYTES
from vistel.session.steering.log_lines import KEPT, MOST_LETTERS, SHOWN, LogLines


def line(second: int, text: str, level: str = "INFO", node: str = "hub/world") -> str:
    return f"2026-11-21T09:{second // 60:02d}:{second % 60:02d}.000Z {level:7} {node} vistel.x {text}\n"


def test_lines_of_several_files_are_in_the_order_of_time_and_filtered(tmp_path: Path) -> None:
    (tmp_path / "hub-world.log").write_text(line(1, "a") + line(3, "B broken", "ERROR"))
    (tmp_path / "tokyo-renderer.log").write_text("of a library\n" + line(2, "late", "WARNING", "tokyo/renderer"))
    (tmp_path / "other.txt").write_text(line(4, "no log"))
    lines = LogLines(tmp_path)
    lines.take()
    assert [(each.node, each.text) for each in lines.newest()] == [
        ("tokyo/renderer", "of a library"),
        ("hub/world", "vistel.x a"),
        ("tokyo/renderer", "vistel.x late"),
        ("hub/world", "vistel.x B broken"),
    ]
    assert [each.level for each in lines.newest("WARNING")] == ["WARNING", "ERROR"]
    assert [each.text for each in lines.newest(node="hub/world", text="b BROKEN")] == ["vistel.x B broken"]
    assert lines.nodes() == ["hub/world", "tokyo/renderer"]


def test_what_is_written_later_comes_once_and_a_half_line_when_it_is_whole(tmp_path: Path) -> None:
    log = tmp_path / "hub-world.log"
    log.write_text(line(1, "first") + line(2, "second")[:-10])
    lines = LogLines(tmp_path)
    lines.take()
    assert len(lines.newest()) == 1
    with log.open("a") as file:
        file.write(line(2, "second")[-10:])
    lines.take()
    lines.take()
    assert [each.text for each in lines.newest()] == ["vistel.x first", "vistel.x second"] and lines.changes == 2
    log.rename(tmp_path / "hub-world.log.1")
    log.write_text(line(3, "third"))
    lines.take()
    assert [each.text for each in lines.newest()][-1] == "vistel.x third" and len(lines.newest()) == 3


def test_what_is_hostile_is_bounded_and_without_steering_letters(tmp_path: Path) -> None:
    log = tmp_path / "hub-world.log"
    log.write_bytes(
        b"\x00\xff" * MOST_BYTES + b"\n" + line(1, "x" * 10_000 + "\x1b[2J").encode() + line(2, "\x1b[2J\u202eend").encode()
    )
    lines = LogLines(tmp_path)
    lines.take()
    assert all(len(each.text) <= MOST_LETTERS and each.text.isprintable() for each in lines.newest())
    assert lines.newest()[-1].text == "vistel.x  [2J end"
    log.write_text("".join(line(n % 3600, f"number {n}") for n in range(3 * KEPT)))
    lines.take()
    assert len(lines.newest()) == SHOWN and len(lines.newest(text="number")) == SHOWN


def test_a_folder_that_is_not_there_has_no_lines(tmp_path: Path) -> None:
    lines = LogLines(tmp_path / "none")
    lines.take()
    assert lines.newest() == [] and lines.nodes() == []
