"""What `vistel ask` and `vistel board` say of words that they do not understand: one line, before any conference is looked for."""

import pytest
from typer.testing import CliRunner

from vistel.space.commands.phrase import entries
from vistel_cli.main import app


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("ask", "fly", "away"), "there is no command 'fly'"),
        (("ask", "turn", "the", "ball"), "turn by how many degrees?"),
        (("board", "--save", "board.txt"), "--save board.txt: expected a name that ends in .svg or .pdf"),
    ],
)
def test_words_that_are_not_understood_get_one_line(words: tuple[str, ...], said: str) -> None:
    done = CliRunner().invoke(app, [*words])
    assert done.exit_code == 2
    assert said in done.stderr and len(done.stderr.splitlines()) == 1


def test_the_help_of_ask_lists_what_can_be_asked() -> None:
    shown = CliRunner().invoke(app, ["ask", "--help"], env={"COLUMNS": "80"}).stdout
    lines = [line.strip() for line in shown.splitlines()]
    assert [entry for entry in entries() if entry not in lines] == []
