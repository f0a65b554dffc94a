"""What a command says while it waits."""

from __future__ import annotations

import pytest
from waiting import wait_until

from vistel_cli.waiting import waiting


def test_what_takes_long_is_said_with_its_seconds(capsys: pytest.CaptureFixture[str]) -> None:
    printed: list[str] = []

    def said() -> bool:
        printed.append(capsys.readouterr().err)
        return any(printed)

    with waiting("waiting for the world at [tokyo]", silent_s=0.0):
        wait_until(said)
    assert "".join(printed) == "waiting for the world at [tokyo] … 0 s\n"


def test_what_is_soon_done_says_nothing_even_where_it_fails(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ValueError, match="no"), waiting("waiting for the world"):
        raise ValueError("no")
    assert capsys.readouterr() == ("", "")
