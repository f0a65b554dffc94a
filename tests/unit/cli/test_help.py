"""The help of the command: square brackets in its texts reach the terminal."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import typer
from rich.markup import render

from vistel_cli.main import app
from vistel_cli.terminal import print_error

STYLES = re.compile(r"\[/?(bold|dim)\]")


def texts(command: Any, path: str) -> Iterator[tuple[str, str]]:
    """The help texts of a command, of its parameters and of the commands below it."""
    yield path, command.help or ""
    for parameter in command.params:
        yield f"{path} {parameter.name}", getattr(parameter, "help", None) or ""
    for name, below in getattr(command, "commands", {}).items():
        yield from texts(below, f"{path} {name}")


def test_no_square_bracket_of_a_help_text_vanishes_as_markup() -> None:
    found = list(texts(typer.main.get_command(app), "vistel"))
    assert len(found) > 100
    lost = [where for where, text in found if render(text).plain != STYLES.sub("", text).replace("\\[", "[")]
    assert lost == []


def test_an_error_keeps_its_square_brackets(capsys: Any) -> None:
    print_error("name certificates under [bus.tls]")
    assert capsys.readouterr().err == "error: name certificates under [bus.tls]\n"
