"""`vistel chat`, `vistel raise` and `vistel react` say in one line what is wrong, before they ask any conference."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from vistel.conference.files import DEMO_FILE
from vistel_cli.main import app
from vistel_cli.terminal import USAGE

FILE = str(DEMO_FILE)
NOBODY = ("--hub", "tcp/127.0.0.1:1")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("chat", FILE, "hello", "--as", "aiko", "--to", "nobody"), "--to nobody: no such participant; there are aiko,"),
        (("chat", FILE, "hello", "--as", "aiko", "--to", "aiko"), "--to aiko: expected somebody else than the one who writes"),
        (("chat", FILE, "--as", "aiko", "--to", "ben"), "--to says who gets the line; expected a text, as in: vistel chat hello"),
        (("chat", FILE, "hello", "--as", "nobody", "--to", "ben"), "--as nobody: no such participant"),
        (
            ("react", "tears", "--conference", FILE),
            "there is no reaction 'tears'; there are thumb-up, clap, heart, laugh, surprise",
        ),
        (("raise", "--as", "nobody", "--conference", FILE), "--as nobody: no such participant"),
    ],
    ids=["to nobody", "to oneself", "no text", "as nobody", "no reaction", "raise as nobody"],
)
def test_what_is_wrong_is_said_in_one_line(words: tuple[str, ...], says: str) -> None:
    done = CliRunner().invoke(app, [*words, *NOBODY])
    assert done.exit_code == USAGE
    assert says in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr
