"""What a command says while it waits."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from waiting import wait_until

from vistel_cli.waiting import waiting


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
