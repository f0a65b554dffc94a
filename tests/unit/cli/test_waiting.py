"""What a command says while it waits."""

from __future__ import annotations

import io
import re
from collections.abc import Callable

import pytest
from rich.console import Console
from waiting import wait_until

from vistel_cli.waiting import progress, silent_of, waiting


@pytest.mark.parametrize("what", ["reading [log]: 45%", lambda: "reading [log]: 45%"], ids=["a text", "what is true then"])
def test_what_takes_long_is_said_with_its_seconds(what: str | Callable[[], str], capsys: pytest.CaptureFixture[str]) -> None:
    printed: list[str] = []

    def said() -> bool:
        printed.append(capsys.readouterr().err)
        return any(printed)

    with waiting(what, silent_s=0.0):
        wait_until(said)
    assert all(re.fullmatch(r"reading \[log\]: 45% … \d+ s", line) for line in "".join(printed).splitlines())


def test_what_is_soon_done_says_nothing_even_where_it_fails(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ValueError, match="no"), waiting("waiting for the world"):
        raise ValueError("no")
    assert capsys.readouterr() == ("", "")


def test_how_far_it_is_is_said_in_lines_where_there_is_no_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("vistel_cli.waiting.SILENT_S", 0.0)
    printed: list[str] = []

    def said() -> bool:
        printed.append(capsys.readouterr().err)
        return any(printed)

    with progress("tracing [den].toml") as tell:
        tell(0.45)
        wait_until(said)
    lines = "".join(printed).splitlines()
    assert re.fullmatch(r"tracing \[den\]\.toml: (0|45)% … \d+ s", lines[0])


def test_how_far_it_is_is_a_bar_in_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Console(file=io.StringIO(), force_terminal=True, width=100)
    monkeypatch.setattr("vistel_cli.terminal.err", terminal)
    with progress("tracing [den].toml") as tell:
        tell(0.45)
    assert re.search(r"tracing \[den\]\.toml.*━.* 45%", terminal.file.getvalue())  # type: ignore[attr-defined]


def test_nothing_is_said_where_nothing_is_to_be_shown(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("vistel_cli.waiting.SILENT_S", 0.0)
    with progress("tracing", show=False) as tell:
        tell(0.45)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("since_s", "silent_s"), [(0.0, 1.0), (0.4, 0.6), (3.0, 0.0), (6.0, 1.0)])
def test_on_a_terminal_the_waits_at_the_beginning_of_a_command_are_one(
    monkeypatch: pytest.MonkeyPatch, since_s: float, silent_s: float
) -> None:
    monkeypatch.setattr("vistel_cli.waiting.SILENT_S", 2.0)
    assert silent_of(since_s, on_terminal=True) == pytest.approx(silent_s)
    assert silent_of(since_s, on_terminal=False) == 2.0
