"""What a start says where there is no terminal."""

from __future__ import annotations

import pytest
from rich.console import Console
from rich.progress import Progress

from vistel_cli.run import steps
from vistel_cli.run.steps import Steps, time_taken, words


class Seconds:
    """A clock that is set."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        return self.now


def test_a_step_is_a_line_at_once_and_what_is_awaited_one_every_two_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Seconds()
    monkeypatch.setattr(steps, "time", clock)
    console = Console(width=40, force_terminal=False, markup=False)
    with console.capture() as printed:
        said = Steps(console, silent=False)
        said.begin("loading")
        for tenth in range(1, 41):
            clock.now = 100.0 + 0.1 * tenth
            said.show("waiting for [picture] of tokyo; 3 of 13 are there")
    assert printed.get().splitlines() == [
        "loading",
        "waiting for [picture] of tokyo; 3 of 13 are there, 2 s",
        "waiting for [picture] of tokyo; 3 of 13 are there, 4 s",
    ]


def test_nothing_is_printed_over_the_bar_of_a_terminal_or_where_only_the_report_is_wanted() -> None:
    for console, silent in ((Console(force_terminal=True), False), (Console(force_terminal=False), True)):
        with console.capture() as printed:
            Steps(console, silent=silent).begin("loading")
        assert printed.get() == ""


def test_in_a_narrow_terminal_progress_is_two_lines_beside_the_time() -> None:
    console = Console(width=40, force_terminal=False)
    bar = Progress(time_taken(), words(), console=console)
    bar.add_task("waiting for the first picture of columbus and 2 more")
    with console.capture() as printed:
        console.print(bar)
    lines = [line.split(maxsplit=1) for line in printed.get().splitlines()]
    assert lines[0][0] == "0:00:00"
    assert " ".join([lines[0][1].strip(), *(" ".join(line).strip() for line in lines[1:])]) == (
        "waiting for the first picture of columbus and 2 more"
    )
